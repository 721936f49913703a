"""The lessons in Firefox, which Playwright controls by WebDriver BiDi: in French, so that one run has another browser and another language.

Another test holds that the steps in French are those in English (test_lessons.py).
"""

import os
import shutil
import subprocess

import pytest
import test_lessons
from conftest import sampled
from playwright.sync_api import expect
from test_lessons import FRENCH_LESSONS, name_of, opened
from test_site import plays_a_lesson_offline

__all__ = ["opened"]


@pytest.fixture(scope="module")
def display():
    """A display without a screen: a Firefox without one has no WebGL."""
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"], pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as number:
        yield f":{number.readline().strip()}"
    server.terminate()
    server.wait(timeout=60)


@pytest.fixture(scope="module")
def browser(playwright, display, tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    started = playwright.firefox.launch(
        channel="moz-firefox",
        executable_path=shutil.which(os.environ.get("FIREFOX", "firefox-esr")),
        downloads_path=folder,
        env={**os.environ, "DISPLAY": display},
        # Without a graphics card the processor computes WebGL.
        firefox_user_prefs={"webgl.force-enabled": True, "intl.accept_languages": "fr"},
    )
    started.saves_in = folder
    yield started
    started.close()


@pytest.mark.parametrize("lesson", sampled(FRENCH_LESSONS, lambda lesson: name_of(lesson) in ("lamp", "flight")), ids=name_of)
def test_the_steps_of_a_lesson_lead_to_green_lights_in_firefox(opened, lesson):
    test_lessons.test_the_steps_of_a_lesson_lead_to_green_lights(opened, lesson)


def test_the_zip_of_the_playground_needs_no_server_and_no_network(browser, tmp_path):
    plays_a_lesson_offline(browser, tmp_path)


def test_the_language_is_that_of_the_browser(opened):
    page = opened("examples/lessons/hops.toml")
    expect(page.locator("html")).to_have_attribute("lang", "fr")
    expect(page.locator("#about h2")).to_have_text("Compter les sauts")
