"""A browser for all tests: CHROMIUM names it [default: chromium]."""

import os
import shutil

import pytest
from playwright.sync_api import expect, sync_playwright

# The time that a busy computer may take for what is expected.
expect.set_options(timeout=30_000)


@pytest.fixture(scope="session")
def browser():
    program = shutil.which(os.environ.get("CHROMIUM", "chromium"))
    # Without a graphics card the processor computes WebGL.
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=flags)
        yield started
        started.close()
