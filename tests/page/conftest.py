"""A browser for all tests: CHROMIUM names it [default: chromium]."""

import os
import shutil

import pytest
from playwright.sync_api import expect, sync_playwright

# The time that a busy computer may take for what is expected.
expect.set_options(timeout=30_000)


def launch(chromium):
    program = shutil.which(os.environ.get("CHROMIUM", "chromium"))
    # Without a graphics card the processor computes WebGL.
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    return chromium.launch(executable_path=program, args=flags)


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        started = launch(playwright.chromium)
        yield started
        started.close()
