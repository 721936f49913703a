"""A recording in the page of `bbz view`."""

import re
import subprocess
import xml.etree.ElementTree

import pytest
from conftest import note_problems
from playwright.sync_api import expect
from test_page import SCENARIO, SCRIPT, SECONDS_MAX, address, at, bbz, go, place, robot

pytestmark = pytest.mark.sample


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
    note_problems(page, problems)
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
    # Played at its end, it starts again.
    page.locator("#rate").select_option("0.1")
    page.click("#play")
    expect(page.locator("#clock")).to_contain_text(re.compile(r"^[0-4]\."))
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Play")
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
    expect(panel.locator(".facts")).to_contain_text(re.compile(r"Radius16\.5 mmLED[A-Z]?[a-z]+"))
    expect(page.locator("#scenario")).to_have_text("s.bbr")
    for part in ["save", "messages", "tab-log", "tab-tests", "tab-ground", "build-mode"]:
        expect(page.locator(f"#{part}")).to_be_hidden()
    expect(panel.get_by_role("button")).to_have_count(0)
    expect(page.get_by_label("Color by")).to_be_hidden()
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


# The robot touches the disc from the start and pushes it to the right.
PUSHED = """\
[world]
size = [800, 600]
duration = 60
obstacles = [{ at = [50, 0], radius = 60, movable = true }]

[[robots]]
robot = "kilobot"
script = "s.bzz"
positions = [[-26.5, 0]]
heading = 0
"""


def circles(path):
    root = xml.etree.ElementTree.parse(path).getroot()
    return [circle.attrib for circle in root.iter("{http://www.w3.org/2000/svg}circle")]


def test_movable_discs_are_drawn_where_they_are(browser, tmp_path):
    (tmp_path / "s.bzz").write_text("function step() { forward() }\n")
    (tmp_path / "s.toml").write_text(PUSHED)
    command = bbz("sim", "s.toml", "--headless", "--record", "s.bbr", "--svg", "pictures")
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=SECONDS_MAX)
    # The picture is 900 wide, with a rim of 10; the outline at the end is the thick one.
    ends = [circle for circle in circles(tmp_path / "pictures/trajectories.svg") if circle.get("stroke-width") == "2"]
    [end] = [(float(circle["cx"]) - 10) * 800 / 900 - 400 for circle in ends]
    assert end > 60
    process = subprocess.Popen(bbz("view", tmp_path / "s.bbr", "--no-browser"), stdout=subprocess.PIPE, text=True)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(address(process))
    for tick, x in [(0, 50), (600, end), (0, 50)]:
        go(page, tick)
        with page.expect_download() as download:
            page.get_by_role("button", name="Drawing").click()
        download.value.save_as(tmp_path / "drawing.svg")
        drawn = circles(tmp_path / "drawing.svg")
        [disc] = [circle for circle in drawn if circle["r"] == "60"]
        assert float(disc["cx"]) == pytest.approx(x, abs=0.15)
        # The ring lies over the disc, in the color of the ground.
        [ring] = [circle for circle in drawn if circle["r"] == "36"]
        assert (ring["cx"], ring["fill"], ring["stroke"]) == (disc["cx"], "none", "rgb(255,255,255)")
    page.close()
    process.wait(timeout=60)
