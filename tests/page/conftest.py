"""A browser for all tests: CHROMIUM names it [default: chromium-headless-shell].

`cargo xtask soak page` runs all tests. CI runs those with the mark `sample` while the page is as it was when all passed, and after a
change all but those with the mark `soak`, which repeat others with more examples.
"""

import os
import pathlib
import shutil
import time

import pytest
from playwright.sync_api import expect, sync_playwright

# The time that a busy computer may take for what is expected.
expect.set_options(timeout=30_000)


def pytest_configure(config):
    config.addinivalue_line("markers", "sample: CI runs it for every change")
    config.addinivalue_line("markers", "soak: one of many like it, for `cargo xtask soak page`")


def sampled(values, sample):
    """The values as parameters of a test, of which CI has those that `sample` accepts."""
    return [value if sample(value) else pytest.param(value, marks=pytest.mark.soak) for value in values]


def launch(chromium):
    # Chromium without its own windows and menus, which take a third of the time and are not tested.
    program = shutil.which(os.environ.get("CHROMIUM", "chromium-headless-shell"))
    # Without a graphics card the processor computes WebGL. It would compute the rest of the page the same way, which takes a
    # third more time than Chromium's other way.
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
    return chromium.launch(executable_path=program, args=flags)


def note_problems(page, problems):
    """Appends to `problems` each message of the page's console, and each error that no code catches."""

    def note(text):
        # The picture of a canvas is read back, as the rest of the page is not computed by WebGL (`launch`).
        is_reading = "GPU stall due to ReadPixels" in text
        # In Firefox, Playwright adds this style to a page of which it takes a picture, and the policy of the page forbids it.
        is_picture = "sha256-YjaKGiklmzC6wjXA513HAMmzus8VE61XCOT+SmwNZWA=" in text
        if not is_reading and not is_picture:
            problems.append(text)

    page.on("console", lambda message: note(message.text))
    page.on("pageerror", lambda error: note(str(error)))


def saved(page, act, seconds=30):
    """Returns the path of the file that the page saves by `act`."""
    browser = page.context.browser
    if not hasattr(browser, "saves_in"):
        with page.expect_download(timeout=seconds * 1000) as download:
            act()
        return pathlib.Path(download.value.path())
    # Firefox reports no download that a script of the page begins, so the folder is watched.
    before = set(browser.saves_in.iterdir())
    act()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        # The file has its name from the beginning, and is empty until its other part has been renamed.
        new = [file for file in browser.saves_in.iterdir() if file not in before and file.suffix != ".part" and file.stat().st_size > 0]
        if new:
            return new[0]
        page.wait_for_timeout(50)
    raise AssertionError("no file was saved")


@pytest.fixture(scope="session")
def playwright():
    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="session")
def browser(playwright):
    started = launch(playwright.chromium)
    yield started
    started.close()
