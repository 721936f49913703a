"""Crazyflies with a flight controller: what their surroundings do to them is seen in the page."""

import re

import pytest
from playwright.sync_api import expect
from test_page import at, end, go, show, window

__all__ = ["window"]

SCENARIO = """\
[world]
size = [4000, 3000]
duration = 60

[body.crazyflie]
armed = true
fidelity = "flight"
positioning = "capture"
wind = 1500
wind_direction = 90
latency = 60

[[robots]]
robot = "crazyflie"
script = "s.bzz"
name = "fleet"
count = 3
first_id = 4
positions = [[-1000, 0], [0, 0], [1000, 0]]
settings = ["height_mm=1500", "fence_front_mm=1200", "fence_back_mm=1300", "fence_left_mm=900"]

[[robots]]
robot = "rover.toml"
script = "s.bzz"
positions = [[0, 1000]]
first_id = 9

[[event]]
at = 1
displace = 4
by = [200, -50]

[[event]]
at = 2
relabel = [5, 6]

[[event]]
at = 3
battery = 4
volts = 3.5
"""

# Its battery is empty after a minute.
ROVER = """name = "rover"

[body]
drive = "unicycle"
radius_mm = 40
speed_mm_s = 100
turn_deg_s = 90

[[sensor]]
name = "cell"
kind = "battery"
full_mv = 4000
empty_mv = 3000
minutes = 1
"""


@pytest.fixture
def page(window, tmp_path):
    (tmp_path / "s.bzz").write_text("function step() { }\n")
    (tmp_path / "s.toml").write_text(SCENARIO)
    (tmp_path / "rover.toml").write_text(ROVER)
    process = show(tmp_path)
    window.problems.clear()
    window.goto(process.url)
    at(window, 0)
    yield window
    window.goto("about:blank")
    end(process)
    assert window.problems == []


def poses(page):
    return page.locator("#ground section p", has_text=re.compile("^robot "))


def test_the_fence_is_shown(page):
    page.click("#tab-ground")
    fence = page.locator(".fence")
    expect(fence.locator("h3")).to_have_text("Fence of fleet")
    expect(fence.locator("dd")).to_have_text(["-1300 to 1200 mm", "no limit to 900 mm", "0 to 1500 mm"])
    with page.expect_download() as download:
        page.click("#drawing")
    lines = re.findall(r'<line x1="([^"]+)" y1="([^"]+)" x2="([^"]+)" y2="([^"]+)"[^>]*stroke-dasharray', download.value.path().read_text())
    # Three walls, of which two end with the world where there is no fourth.
    assert [tuple(map(float, line)) for line in lines] == [(1200, -1500, 1200, 900), (1200, 900, -1300, 900), (-1300, 900, -1300, -1500)]


def test_wind_latency_and_wrong_poses_are_shown(page):
    expect(page.locator("#wind")).to_have_text(re.compile("wind 1500 mm/s"))
    page.click("#tab-ground")
    rows = page.locator(".surroundings")
    expect(rows.locator("h3")).to_have_text("Surroundings of fleet")
    expect(rows.locator("dt")).to_have_text(["wind", "wind_direction", "latency"])
    expect(rows.locator("dd")).to_have_text(["1500 mm/s", "90 degrees", "60 ms"])
    expect(poses(page)).to_have_count(0)
    go(page, 15)
    expect(poses(page)).to_have_text(["robot 4: displaced by 200, -50 mm"])
    go(page, 25)
    exchanged = ["robot 5: those of robot 6", "robot 6: those of robot 5"]
    expect(poses(page)).to_have_text(["robot 4: displaced by 200, -50 mm", *exchanged])
    # The drawing has a ring where each of them is believed to be.
    with page.expect_download() as download:
        page.click("#drawing")
    circles = re.findall(r'<circle cx="([^"]+)"[^>]*fill="none"', download.value.path().read_text())
    assert [round(float(place), -2) for place in circles] == [-800, 1000, 0]
    # The way back takes the errors back.
    go(page, 5)
    expect(poses(page)).to_have_count(0)


def test_the_panel_shows_where_the_robot_believes_to_be(page):
    page.locator("#canvas").press("n")
    go(page, 20)
    facts = page.locator("#robot dt")
    expect(facts.filter(has_text="Estimate")).to_have_count(1)
    # Its poses are displaced by 200 mm and 50 mm, which the filter does not follow at once.
    shown = page.locator("#robot dd", has_text="mm away")
    expect(shown).to_have_text(re.compile(r"^-?\d+, -?\d+, -?\d+ mm \(\d+ mm away\)$"))
    far = int(re.search(r"\((\d+) mm away", shown.inner_text())[1])
    assert far < 250


def test_the_panel_shows_the_battery(page):
    battery = page.locator("#robot dl > div", has=page.locator("dt", has_text="Battery"))
    page.locator("#canvas").press("n")
    go(page, 25)
    # A full cell of 4.2 V feeds the electronics.
    expect(battery.locator("dd")).to_have_text(re.compile(r"^4\.1\d V$"))
    go(page, 35)
    # The event sets the voltage, and says nothing of the charge.
    expect(battery.locator("dd")).to_have_text("3.50 V")
    expect(battery.locator("meter")).to_have_count(0)
    for _ in range(3):
        page.locator("#canvas").press("n")
    go(page, 300)
    expect(battery.locator("dd")).to_have_text("3.50 V, 50 % left")
    assert float(battery.locator("meter").get_attribute("value")) == 0.5
