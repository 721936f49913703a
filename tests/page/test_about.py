"""The tab About, and what one recognizes: kinds of robots, colors, ranges."""

import os
import pathlib
import re
import subprocess
import xml.etree.ElementTree

import pytest
from conftest import note_problems, sampled
from playwright.sync_api import expect
from test_accessibility import contrast
from test_page import address, at, bbz, end, go, place, robot, show, window

__all__ = ["window"]

ROOT = pathlib.Path(__file__).parents[2]

SCRIPT = """\
# A script with `colors`.
#
# led: 1 = waiting
# led: 5 = in a group
#
# Robots: kilobot

function step() {
  if(id == 2) led(5)
}
"""

SCENARIO = """\
# Three kinds of robots, which
# show colors.
#
# try: The first one fails: fail = 1
# try: move = 2, to = [0, 200]
#
# bbz sim s.toml

[world]
size = [2000, 2000]
duration = 60
lights = [[-300, -200]]

[body.crazyflie]
armed = true
fidelity = "flight"
positioning = "capture"

[[robots]]
robot = "kilobot"
name = "crawlers"
script = "s.bzz"
count = 2
first_id = 1
positions = [[0, 0], [80, 0]]

[[robots]]
robot = "zooids"
name = "rollers"
script = "s.bzz"
first_id = 5
positions = [[300, 0]]
heading = 90

[[robots]]
robot = "crazyflie"
name = "fliers"
script = "fly.bzz"
first_id = 9
positions = [[-500, 500]]
heading = 0
"""

FLY = """\
up = 0
function step() {
  if(up == 0) up = takeoff(500)
  else move_toward(150, 0)
}
"""


@pytest.fixture
def page(window, tmp_path):
    for name, text in [("s.bzz", SCRIPT), ("s.toml", SCENARIO), ("fly.bzz", FLY)]:
        (tmp_path / name).write_text(text)
    process = show(tmp_path)
    window.problems.clear()
    window.goto(process.url)
    at(window, 0)
    yield window
    window.goto("about:blank")
    end(process)
    assert window.problems == []


SVG = "{http://www.w3.org/2000/svg}"


def bodies(page, folder):
    """The bodies of a drawing, by the ids of the robots."""
    with page.expect_download() as download:
        page.click("#drawing")
    download.value.save_as(folder / "drawing.svg")
    groups = xml.etree.ElementTree.parse(folder / "drawing.svg").getroot().iter(f"{SVG}g")
    return {int(group.find(f"{SVG}title").text): group for group in groups if group.find(f"{SVG}title") is not None}


def drawn(page, folder):
    """The names of the shapes of each body."""
    return {robot: [part.tag.removeprefix(SVG) for part in body.iter()] for robot, body in bodies(page, folder).items()}


def fact(page, name):
    return page.locator("#robot .facts > div", has=page.locator("dt", has_text=re.compile(f"^{name}$"))).locator("dd")


def test_the_first_tab_tells_what_is_shown(page):
    about = page.locator("#about")
    expect(about).to_be_visible()
    expect(about.locator("h2")).to_have_text("S")
    expect(about.locator("> p")).to_have_text(["Three kinds of robots, which show colors."])
    kinds = about.locator(".kinds li")
    expect(kinds).to_have_text([
        "2 × kilobot, ids 1 to 2, script s.bzz, Infrared within 117 mm from rim to rim",
        "1 × zooids, id 5, script s.bzz, nRF24 without a limit of range",
        "1 × crazyflie, id 9, script fly.bzz, P2P without a limit of range",
    ])
    assert kinds.locator("use").evaluate_all("all => all.map(one => one.getAttribute('href'))") == ["#g-legs", "#g-wheels", "#g-rotors"]
    expect(about.locator(".leds li")).to_have_text(["Rred: waiting", "Mmagenta: in a group"])
    expect(about).to_contain_text("Lamp at (-300, -200) mm, brightness 1023")
    expect(about.locator("section", has_text="Script s.bzz").locator("code")).to_have_text("colors")


def test_things_to_try_are_commands(page):
    tries = page.locator(".tries button")
    expect(tries).to_have_text(["The first one fails", "move = 2, to = [0, 200]"])
    for one in [0, 1]:
        tries.nth(one).click()
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_have_text(["fail = 1", "move = 2, to = [0, 200]"])
    page.click("#step")
    at(page, 1)
    page.locator("#canvas").press("n")
    expect(robot(page, 1).locator(".state")).to_have_text("failed")


def test_the_panel_names_the_color_and_the_range(page):
    page.locator("#canvas").press("n")
    go(page, 20)
    expect(fact(page, "LED")).to_have_text("off")
    expect(fact(page, "Range")).to_have_text("Infrared within 117 mm from rim to rim")
    page.locator("#canvas").press("n")
    expect(fact(page, "LED")).to_have_text("Mmagenta: in a group")
    page.locator("#canvas").press("n")
    expect(fact(page, "Range")).to_have_text("nRF24 without a limit of range")


def test_a_malformed_meaning_is_reported(page):
    page.click("#tab-script")
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+Home")
    page.keyboard.insert_text("# led: red = wrong\n")
    expect(page.locator("#diagnostics")).to_contain_text("# led: 2 = in a group")


def test_each_kind_of_robot_has_its_glyph_in_a_drawing(page, tmp_path):
    bodies = drawn(page, tmp_path)
    # A body and three legs; a body, a notch and two wheels; four rotors, two arms, a nose and a middle.
    assert {id: (parts.count("circle"), parts.count("rect"), parts.count("line"), parts.count("path")) for id, parts in bodies.items()} == {
        1: (4, 0, 0, 0), 2: (4, 0, 0, 0), 5: (1, 3, 0, 0), 9: (5, 0, 2, 1),
    }


def test_a_flying_robot_offers_the_third_dimension_before_it_flies_and_has_an_attitude(page):
    expect(page.locator("#tilt")).to_be_visible()
    page.focus("#canvas")
    for _ in range(4):
        page.keyboard.press("n")
    robot(page, 9)
    expect(fact(page, "Attitude")).to_have_count(0)
    go(page, 60)
    # The nose sinks on its way ahead.
    expect(fact(page, "Attitude")).to_have_text(re.compile(r"^roll -?\d+°, pitch -?\d+°, thrust \d\d+ %$"))
    thrust = int(re.search(r"thrust (\d+)", fact(page, "Attitude").inner_text())[1])
    assert 60 < thrust < 200
    go(page, 0)
    expect(fact(page, "Attitude")).to_have_count(0)


def name_place(page):
    return page.locator("#name").bounding_box()


def test_all_robots_are_fitted_and_one_is_followed(page):
    scale = page.locator("#bar-text")
    before = scale.inner_text()
    page.click("#fit-robots")
    expect(scale).not_to_have_text(before)
    page.locator("#canvas").press("0")
    expect(scale).to_have_text(before)
    page.focus("#canvas")
    for _ in range(4):
        page.keyboard.press("n")
    robot(page, 9)
    page.keyboard.press("f")
    expect(page.locator("#follow")).to_be_checked()
    page.wait_for_function("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
    there = name_place(page)
    canvas = page.locator("#canvas").bounding_box()
    assert abs(there["x"] - canvas["x"] - canvas["width"] / 2) < 40
    go(page, 80)
    page.wait_for_function("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
    after = name_place(page)
    assert (after["x"], after["y"]) == (pytest.approx(there["x"], abs=1), pytest.approx(there["y"], abs=1))
    # Who looks elsewhere follows no more.
    page.focus("#canvas")
    page.keyboard.press("ArrowRight")
    expect(page.locator("#follow")).not_to_be_checked()


def painted_labels(page):
    """The number of pixels of labels."""
    return page.evaluate("""() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => {
        const labels = document.getElementById("labels");
        const context = new OffscreenCanvas(labels.width, labels.height).getContext("2d");
        context.drawImage(labels, 0, 0);
        const { data } = context.getImageData(0, 0, labels.width, labels.height);
        done(data.filter((part, at) => at % 4 === 3 && part > 0).length);
    })))""")


def test_labels_appear_where_there_is_room(page):
    go(page, 20)
    page.locator("#canvas").press("0")
    alone = painted_labels(page)
    page.focus("#canvas")
    for key in ["n", "n", "f", *["+"] * 8]:
        page.keyboard.press(key)
    robot(page, 2)
    with_labels = painted_labels(page)
    assert with_labels > alone + 50, (alone, with_labels)
    page.uncheck("#show-labels")
    assert painted_labels(page) == 0


SAMPLE = ["examples/flight/hover.toml", "examples/kilobot/distance.toml", "examples/zooids/recharge.toml"]


def proposing():
    return [path.relative_to(ROOT).as_posix() for path in sorted(ROOT.glob("examples/**/*.toml")) if "# try:" in path.read_text()]


@pytest.mark.parametrize("scenario", sampled(proposing(), SAMPLE.__contains__))
def test_what_examples_propose_works(browser, tmp_path, scenario):
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path)}
    process = subprocess.Popen(bbz("sim", scenario, "--view", "--no-browser"), cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment)
    page = browser.new_page()
    problems = []
    note_problems(page, problems)
    page.goto(address(process))
    tries = page.locator(".tries button")
    count = len(re.findall(r"^# try:", (ROOT / scenario).read_text(), re.MULTILINE))
    expect(tries).to_have_count(count)
    for one in range(count):
        tries.nth(one).click()
        expect(page.locator("#ground code")).to_have_count(one + 1)
    expect(page.locator("#status")).to_have_text("")
    page.close()
    process.wait(timeout=60)
    assert problems == []


def test_a_recording_shows_robots_without_names(browser, tmp_path):
    (tmp_path / "s.bzz").write_text("function step() { led(3) }\n")
    (tmp_path / "s.toml").write_text("[world]\nsize = [400, 400]\nduration = 2\n[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n")
    subprocess.run(bbz("sim", "s.toml", "--headless", "--record", "s.bbr"), cwd=tmp_path, check=True, capture_output=True, timeout=120)
    process = subprocess.Popen(bbz("view", tmp_path / "s.bbr", "--no-browser"), stdout=subprocess.PIPE, text=True)
    page = browser.new_page()
    page.goto(address(process))
    expect(page.locator("#about .kinds li")).to_have_text(["3 robots, ids 0 to 2"])
    page.locator("#time").fill("20")
    page.locator("#canvas").press("n")
    expect(fact(page, "LED")).to_have_text("Yyellow")
    page.close()
    process.wait(timeout=60)


def test_groups_have_colors_of_their_own(page, tmp_path):
    def colors():
        return {robot: body.find(f".//{SVG}circle").get("fill") for robot, body in bodies(page, tmp_path).items()}

    before = colors()
    page.get_by_label("Color by").select_option("group")
    expect(page.locator("#group-legend span")).to_have_text(["crawlers", "rollers", "fliers"])
    crawler, other, roller, flier = (colors()[robot] for robot in [1, 2, 5, 9])
    assert crawler == other
    assert len({crawler, roller, flier}) == 3
    page.get_by_label("Color by").select_option("state")
    expect(page.locator("#group-legend")).to_be_hidden()
    assert colors() == before


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_least_value_is_seen_on_the_ground(page, tmp_path, scheme):
    page.emulate_media(color_scheme=scheme)
    page.get_by_label("Color by").select_option("group")
    ground = page.evaluate("() => getComputedStyle(document.documentElement).getPropertyValue('--ground').trim()")
    edge = bodies(page, tmp_path)[1].find(f".//{SVG}circle").get("stroke")
    page.emulate_media(color_scheme="light")
    assert contrast(f"#{''.join(f'{int(part):02x}' for part in re.findall('[0-9]+', edge))}", ground) >= 3, edge
