"""A browser for all tests: CHROMIUM names it [default: chromium-headless-shell]."""

import os
import shutil

import pytest
from playwright.sync_api import expect, sync_playwright

# The time that a busy computer may take for what is expected.
expect.set_options(timeout=30_000)


def launch(chromium):
    # Chromium without its own windows and menus, which take a third of the time and are not tested.
    program = shutil.which(os.environ.get("CHROMIUM", "chromium-headless-shell"))
    # Without a graphics card the processor computes WebGL. It would compute the rest of the page the same way, which takes a
    # third more time than Chromium's other way.
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
    return chromium.launch(executable_path=program, args=flags)


def note_problems(page, problems):
    """Appends to `problems` each message of the page's console, and each error that no code catches."""

    def note(message):
        # The picture of a canvas is read back, as the rest of the page is not computed by WebGL (`launch`).
        if "GPU stall due to ReadPixels" not in message.text:
            problems.append(message.text)

    page.on("console", note)
    page.on("pageerror", lambda error: problems.append(str(error)))


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        started = launch(playwright.chromium)
        yield started
        started.close()
