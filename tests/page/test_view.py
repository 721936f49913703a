"""A recording in the page of `bbz view`."""

import subprocess

import pytest
from playwright.sync_api import expect
from test_page import SCENARIO, SCRIPT, SECONDS_MAX, address, at, bbz, go, place, robot


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    (folder / "s.bzz").write_text(SCRIPT)
    # A sample each half second.
    (folder / "s.toml").write_text(SCENARIO.replace("[output]\n", "[output]\nevery = 0.5\n"))
    subprocess.run(bbz("sim", "s.toml", "--headless", "--record", "s.bbr"), cwd=folder, capture_output=True, timeout=SECONDS_MAX)
    return folder / "s.bbr"


@pytest.fixture
def page(browser, recording):
    process = subprocess.Popen(bbz("view", recording, "--no-browser"), stdout=subprocess.PIPE, text=True)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    problems = []
    page.on("console", lambda message: problems.append(message.text))
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto(address(process))
    at(page, 0)
    yield page
    page.close()
    assert process.wait(timeout=60) == 0, "it ends with its page"
    assert problems == []


def test_a_recording_plays_and_steps_back(page):
    page.click("#step")
    at(page, 5)
    page.click("#back")
    at(page, 0)
    page.locator("#rate").select_option("100")
    page.click("#play")
    at(page, 600)
    expect(page.locator("#status")).to_have_text("The run is over.")
    # Between two samples nothing is known.
    page.locator("#time").fill("148")
    at(page, 145)
    go(page, 20)


def test_robots_are_shown_and_nothing_can_be_changed(page):
    go(page, 15)
    page.mouse.click(*place(page, 40, 0))
    panel = robot(page, 7)
    expect(panel.locator(".facts")).to_contain_text("(40.0, 0.0) mm, 90°")
    expect(panel.locator(".state")).to_have_text("running")
    for part in ["save", "messages", "tab-log", "tab-tests", "tab-ground"]:
        expect(page.locator(f"#{part}")).to_be_hidden()
    expect(panel.get_by_role("button")).to_have_count(0)
    expect(page.get_by_label("Color by")).to_be_disabled()
    page.focus("#canvas")
    page.keyboard.press("Shift+ArrowUp")
    expect(page.locator("#status")).to_contain_text("a recording has places, LEDs and states alone")


def test_a_truncated_recording_is_reported(browser, recording, tmp_path):
    cut = tmp_path / "cut.bbr"
    cut.write_bytes(recording.read_bytes()[:-20])
    process = subprocess.Popen(bbz("view", cut, "--no-browser"), stdout=subprocess.PIPE, text=True)
    page = browser.new_page()
    page.goto(address(process))
    expect(page.locator("#status")).to_have_text("The recording ends early: it is cut off.")
    page.close()
    process.wait(timeout=60)


def test_a_file_that_is_no_recording_is_an_error(recording):
    scenario = recording.with_name("s.toml")
    result = subprocess.run(bbz("view", scenario, "--no-browser"), capture_output=True, text=True, timeout=SECONDS_MAX)
    assert result.returncode == 3
    assert "it is not a recording" in result.stderr and "--record" in result.stderr
