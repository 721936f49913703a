"""The page with a keyboard, a screen reader, other colors: axe-core, and what it cannot see."""

import re

import pytest
from axe_playwright_python.sync_playwright import Axe
from conftest import sampled
from playwright.sync_api import expect
from test_page import SCENARIO, at, end, go, page, place, robot, session, show, window

__all__ = ["page", "session", "window"]

RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"]}}


def violations(page):
    """The rules of axe-core that the page breaks, and where."""
    found = Axe().run(page, options=RULES).response["violations"]
    return [(one["id"], node["target"], node.get("failureSummary", "")) for one in found for node in one["nodes"]]


def play_to_the_end(page):
    page.locator("#rate").select_option("as fast as it can")
    page.click("#play")
    at(page, 600)


@pytest.mark.parametrize("scheme", sampled(["light", "dark"], ["light"].__contains__))
def test_axe_finds_no_violation_in_any_tab(browser, session, scheme):
    # Axe is a script of the test, which the page's policy would refuse.
    context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 800}, bypass_csp=True)
    page = context.new_page()
    page.goto(session.url)
    at(page, 0)
    # A fault, a verdict, a command and an event; a chosen robot, a curve and a notice.
    page.get_by_label("Color by").select_option("global.n")
    play_to_the_end(page)
    go(page, 60)
    page.focus("#canvas")
    page.keyboard.press("n")
    page.keyboard.press("n")
    robot(page, 7)
    page.keyboard.press("Shift+ArrowUp")
    expect(page.locator("#marks .command")).to_have_count(1)
    page.keyboard.press("c")
    for tab in ["about", "robot", "table", "script", "log", "tests", "ground"]:
        page.click(f"#tab-{tab}")
        assert violations(page) == [], tab
    page.get_by_label("robots that hear only each other").fill("99")
    page.keyboard.press("Enter")
    expect(page.locator("#status")).to_contain_text("99")
    assert violations(page) == []
    page.click("#build-mode")
    expect(page.locator("#build")).to_be_visible()
    page.locator("#things").select_option("Robot 6")
    assert violations(page) == []
    page.click("#keys")
    assert violations(page) == []
    context.close()


def test_the_table_is_the_twin_of_the_picture(page):
    go(page, 15)
    page.click("#tab-table")
    rows = page.locator("#robots-rows [role=row]")
    expect(rows).to_have_count(2)
    expect(rows.first.locator("[role=gridcell]").first).to_have_text("6")
    expect(rows.first).to_contain_text("running")
    expect(rows.first).to_contain_text("-30.0")
    # A choice in the table is one in the picture, and the other way round.
    page.focus("#robots")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    expect(page.locator("#name")).to_have_text("7")
    expect(rows.last).to_have_attribute("aria-selected", "true")
    expect(page.locator("#robots")).to_have_attribute("aria-activedescendant", rows.last.get_attribute("id"))
    page.mouse.click(*place(page, -30, 0))
    expect(rows.first).to_have_attribute("aria-selected", "true")
    expect(page.locator("#robots")).to_be_visible()
    rows.last.click()
    expect(page.locator("#name")).to_have_text("7")
    page.focus("#robots")
    page.keyboard.press("Enter")
    robot(page, 7)
    expect(page.locator("#tab-robot")).to_be_focused()


def test_the_table_of_many_robots_has_only_the_rows_in_sight(browser, tmp_path):
    many = re.sub(r"count = 2\nfirst_id = 6\npositions = .*\n", "count = 20000\n", SCENARIO)
    many = many.replace("[800, 600]", "[20000, 20000]").replace("robots = 6\n", "")
    many = re.sub(r"obstacles = .*\n|lights = .*\n", "", many)
    (tmp_path / "s.toml").write_text(many)
    (tmp_path / "s.bzz").write_text("n = 0\nfunction step() { n = n + 1 led(2) }\n")
    process = show(tmp_path)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(process.url)
    at(page, 0)
    page.click("#tab-table")
    rows = page.locator("#robots-rows [role=row]")
    expect(rows.first).to_contain_text("0")
    expect(page.locator("#robots")).to_have_attribute("aria-rowcount", "20001")
    assert rows.count() < 60
    page.focus("#robots")
    page.keyboard.press("End")
    expect(page.locator("#name")).to_have_text("19999")
    last = page.locator("#robots-rows [aria-selected=true]")
    expect(last).to_have_attribute("aria-rowindex", "20001")
    expect(last).to_be_in_viewport()
    assert rows.count() < 60
    page.keyboard.press("PageUp")
    page.keyboard.press("ArrowUp")
    expect(page.locator("#robots-rows [aria-selected=true]")).to_be_in_viewport()
    page.close()
    end(process)


def test_a_chosen_robot_is_announced_and_the_clock_is_quiet(page):
    announced = page.locator("#announced")
    expect(announced).to_have_attribute("role", "status")
    page.focus("#canvas")
    page.keyboard.press("n")
    expect(announced).to_have_text(re.compile(r"^Robot 6, running, \(-30\.0, 0\.0\) mm, 90°, LED off$"))
    page.keyboard.press("Escape")
    expect(announced).to_have_text("No robot is chosen.")
    clock = page.locator("#clock")
    assert clock.evaluate("one => one.tagName") != "OUTPUT"
    expect(clock).to_have_attribute("aria-live", "off")
    # A pause says where the run stands.
    page.click("#play")
    expect(clock).not_to_have_text("0.0 s of 60.0 s")
    page.click("#play")
    expect(announced).to_have_text(re.compile(r"^Paused at \d+\.\d s of 60\.0 s$"))


def test_the_slider_names_the_time(page):
    go(page, 305)
    expect(page.locator("#time")).to_have_attribute("aria-valuetext", "30.5 s of 60.0 s")


def test_marks_have_names_and_are_reached_by_keys(page):
    play_to_the_end(page)
    marks = page.get_by_role("toolbar", name="Marks of the run").get_by_role("button")
    expect(page.locator("#marks .event")).to_have_count(1)
    expect(page.locator("#marks .held")).to_have_count(2)
    names = [one.get_attribute("aria-label") for one in marks.all()]
    assert "2.0 s: Robot 7: integer division by zero" in names
    assert "30.0 s: event of the scenario at 30 s" in names
    assert "2.0 s: held: robot 6: global.n equals 19, at 2 s" in names
    # One stop of the tab key for all of them; arrow keys lead on.
    assert sum(one.get_attribute("tabindex") == "0" for one in marks.all()) == 1
    page.locator("#marks button[tabindex='0']").focus()
    page.keyboard.press("Home")
    expect(marks.first).to_be_focused()
    page.keyboard.press("ArrowRight")
    expect(marks.nth(1)).to_be_focused()
    event = page.locator("#marks .event")
    for _ in range(names.index("30.0 s: event of the scenario at 30 s") - 1):
        page.keyboard.press("ArrowRight")
    expect(event).to_be_focused()
    page.keyboard.press("Enter")
    at(page, 300)
    expect(event).to_be_focused()


def luminance(color):
    parts = [int(color[at:at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    low, high = sorted([luminance(one), luminance(other)])
    return (high + 0.05) / (low + 0.05)


# Colors of what is drawn, and of what lies below: axe sees neither. Robots have an edge, except in the dark.
GRAPHICS = {
    "light": {"ground": ["edge", "running", "failed", "faulted", "obstacle", "fence", "movable", "mark", "accent", "one", "two", "three", "four", "five", "six"],
              "panel": ["border", "mark", "accent", "held", "faulted"], "outside": ["border", "mark"]},
    "dark": {"ground": ["running", "stopped", "failed", "faulted", "obstacle", "fence", "movable", "light", "mark", "accent", "one", "two", "three", "four", "five", "six"],
             "panel": ["border", "mark", "accent", "held", "faulted"], "outside": ["border", "mark"]},
}
# Colors of text, also of text that only some runs have.
TEXTS = {"panel": ["text", "soft", "faulted", "held", "accent", "number", "mark-text", "one", "two", "three", "four", "five", "six"], "outside": ["text", "soft"],
         "wrong": ["text", "soft", "faulted"], "hover": ["text", "soft"]}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_graphics_stand_out(page, scheme):
    page.emulate_media(color_scheme=scheme)
    names = {name for part in [GRAPHICS[scheme], TEXTS] for below, above in part.items() for name in [below, *above]}
    colors = {name: page.evaluate("name => getComputedStyle(document.documentElement).getPropertyValue(name).trim()", f"--{name}") for name in names}
    page.emulate_media(color_scheme="light")
    pale = [(least, below, name, round(contrast(colors[below], colors[name]), 2))
            for least, part in [(3, GRAPHICS[scheme]), (4.5, TEXTS)] for below, above in part.items() for name in above
            if contrast(colors[below], colors[name]) < least]
    assert pale == []


def test_forced_colors_keep_what_is_a_color_alone(browser, session):
    context = browser.new_context(forced_colors="active", viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.goto(session.url)
    at(page, 0)
    page.get_by_label("Color by").select_option("global.n")
    play_to_the_end(page)
    style = "(selector, pseudo) => getComputedStyle(document.querySelector(selector), pseudo)"
    look = lambda selector, pseudo, name: page.evaluate(f"([selector, pseudo, name]) => ({style})(selector, pseudo)[name]", [selector, pseudo, name])
    assert "gradient" in look("#legend i", None, "backgroundImage")
    marks = [look(f"#marks .{kind}", "::before", "backgroundColor") for kind in ["event", "fault"]]
    assert marks[0] != marks[1]
    tabs = [look(f"#tab-{name}", None, "backgroundColor") for name in ["about", "log"]]
    assert tabs[0] != tabs[1], "the shown tab looks like no other"
    context.close()
