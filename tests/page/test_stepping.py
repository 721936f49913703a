"""Line by line in the page: a robot's script while the world waits, and breakpoints."""

import os
import re
import subprocess

import pytest
from playwright.sync_api import expect
from test_editor import editor, write
from test_page import address, bbz, digest, page_with_events, session, window

__all__ = ["session", "window"]

# Robot 3 calls `double` once more than robot 2 in each step.
SCRIPT = """\
n = 0
sum = 0
words = {.a = 1, .b = 2}

# A comment, before which nothing can pause.
function double(x) {
    var twice = x + x
    return twice
}

function step() {
    n = n + 1
    for(i = 2, i <= id, i = i + 1) {
        sum = sum + double(n)
    }
    log("sum ", sum, words.a)
}
"""

SCENARIO = """\
[world]
size = [800, 600]
duration = 60

[[robots]]
robot = "kilobot"
script = "walk.bzz"
count = 2
first_id = 2
clock_skew = 0
"""


@pytest.fixture
def page(window, tmp_path):
    """A page at 0.1 s, before the first step of the robots."""
    (tmp_path / "walk.bzz").write_text(SCRIPT)
    (tmp_path / "walk.toml").write_text(SCENARIO)
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")}
    process = subprocess.Popen(bbz("sim", str(tmp_path / "walk.toml"), "--view", "--no-browser"), stdout=subprocess.PIPE, text=True, env=environment)
    window.problems.clear()
    window.goto(address(process))
    expect(window.locator("#clock")).to_have_text("0.0 s of 60.0 s")
    window.click("#step")
    at(window, 1)
    editor(window, "double")
    yield window
    window.goto("about:blank")
    assert window.problems == []
    process.terminate()
    process.wait()


def at(page, tick):
    expect(page.locator("#clock")).to_have_text(f"{tick / 10:.1f} s of 60.0 s")


def place(page):
    return page.locator("#step-place")


def is_before(page, robot, line, of, number, count, seconds):
    """Waits until the page shows a robot before a line, and compares the marked line with the text."""
    expect(place(page)).to_have_text(f"Robot {robot}, before walk.bzz:{line}, in {of}")
    expect(page.locator("#step-number")).to_have_text(f"(statement {number} of {count} of the tick after {seconds} s)")
    marked = page.locator("#text .cm-statement")
    expect(marked).to_have_count(1)
    assert marked.inner_text().strip().startswith(SCRIPT.splitlines()[line - 1].strip())


def gutter(page, line):
    """Clicks beside a line number."""
    number = page.locator("#text .cm-lineNumbers .cm-gutterElement", has_text=re.compile(f"^{line}$")).bounding_box()
    beside = page.locator("#text .cm-breakpoints").bounding_box()
    page.mouse.click(beside["x"] + beside["width"] / 2, number["y"] + number["height"] / 2)


def has_dots(page, lines):
    """Waits until these lines have breakpoints, and no others, by the heights of dots and numbers."""
    page.wait_for_function("""(lines) => {
        const inside = document.getElementById("text").shadowRoot;
        const middle = (one) => one.getBoundingClientRect().y + one.getBoundingClientRect().height / 2;
        const numbers = [...inside.querySelectorAll(".cm-lineNumbers .cm-gutterElement")].filter((one) => one.style.visibility !== "hidden");
        const elements = [...inside.querySelectorAll(".cm-breakpoints .cm-gutterElement")].filter((one) => one.style.visibility !== "hidden");
        const found = elements.filter((one) => one.querySelector(".cm-breakpoint"))
            .map((one) => Number(numbers.find((number) => Math.abs(middle(number) - middle(one)) < 4)?.textContent));
        return JSON.stringify(found) === JSON.stringify(lines);
    }""", arg=lines)


def choose(page, robot):
    """Chooses the robot with an id by the table of all robots."""
    page.click("#tab-table")
    page.locator("#robots-rows [role=row]", has_text=re.compile(f"^{robot}")).click()
    page.click("#tab-script")


def test_one_steps_through_a_script_while_the_world_waits(page):
    choose(page, 3)
    before = digest(page, 1)
    page.click("#tab-script")
    page.click("#step-in")
    is_before(page, 3, 12, "step", 1, 14, "0.1")
    expect(page.locator("#text .cm-values")).to_have_text("n = 0")
    page.click("#step-in")
    is_before(page, 3, 13, "step", 2, 14, "0.1")
    for _ in range(4):
        page.keyboard.press("F8")
    is_before(page, 3, 8, "double", 6, 14, "0.1")
    expect(page.locator("#text .cm-values")).to_have_text("twice = 2")
    memory = page.locator("#step-memory")
    expect(memory.locator("section").first).to_contain_text("double")
    expect(memory.locator("section").first.locator("dl div")).to_have_text(["x1", "twice2"])
    page.keyboard.press("Shift+F8")
    is_before(page, 3, 13, "step", 7, 14, "0.1")
    page.keyboard.press("F7")
    is_before(page, 3, 8, "double", 6, 14, "0.1")
    page.click("#step-out")
    page.click("#step-in")
    page.click("#step-in")
    is_before(page, 3, 14, "step", 9, 14, "0.1")
    expect(page.locator("#step-named")).to_have_text("sum = 2, n = 1")
    # The call is passed.
    page.keyboard.press("F10")
    is_before(page, 3, 13, "step", 12, 14, "0.1")
    at(page, 1)
    assert digest(page, 1) == before


def test_steps_lead_into_the_next_tick_and_back(page):
    choose(page, 3)
    for _ in range(14):
        page.keyboard.press("F8")
    is_before(page, 3, 16, "step", 14, 14, "0.1")
    expect(page.locator("#text .cm-values")).to_have_text("sum = 4, words = {2 entries}")
    page.keyboard.press("F10")
    is_before(page, 3, 12, "step", 1, 14, "0.2")
    at(page, 2)
    page.click("#tab-log")
    expect(page.locator("#log p")).to_have_count(2)
    page.click("#tab-script")
    page.click("#step-back")
    is_before(page, 3, 16, "step", 14, 14, "0.1")
    at(page, 1)


def test_the_first_step_chooses_a_robot_and_a_tick_leaves_it(page):
    page.click("#step-over")
    is_before(page, 2, 12, "step", 1, 9, "0.1")
    page.click("#step")
    at(page, 2)
    expect(page.locator("#step-at")).to_be_hidden()
    expect(page.locator("#text .cm-statement")).to_have_count(0)
    expect(page.locator("#text .cm-values")).to_have_count(0)


def test_the_run_pauses_at_breakpoints(page):
    gutter(page, 8)
    has_dots(page, [8])
    page.click("#play")
    for robot, number, count, seconds in [(2, 6, 9, "0.1"), (3, 6, 14, "0.1"), (3, 11, 14, "0.1"), (2, 6, 9, "0.2")]:
        is_before(page, robot, 8, "double", number, count, seconds)
        expect(page.locator("#play")).to_have_text("Play")
        page.click("#play")
    is_before(page, 3, 8, "double", 6, 14, "0.2")
    # Robot 2 is passed now.
    page.check("#break-chosen")
    page.click("#play")
    is_before(page, 3, 8, "double", 11, 14, "0.2")
    page.click("#play")
    is_before(page, 3, 8, "double", 6, 14, "0.3")
    # Without a breakpoint it runs.
    gutter(page, 8)
    has_dots(page, [])
    page.click("#play")
    expect(page.locator("#step-at")).to_be_hidden()
    expect(page.locator("#clock")).to_have_text(re.compile(r"^[1-9]\.\d s"))


def test_a_breakpoint_is_set_by_the_keyboard_at_the_next_statement(page):
    page.locator("#text .cm-line", has_text="function double").click()
    page.keyboard.press("F9")
    # Neither the comment nor the head of a function is a statement.
    expect(page.locator("#text .cm-breakpoints .cm-breakpoint:visible")).to_have_count(1)
    expect(page.locator("#script-status")).to_have_text("Breakpoint at line 6")
    has_dots(page, [7])
    gutter(page, 17)
    expect(page.locator("#script-status")).to_have_text("No statement follows line 17, so it has no breakpoint.")
    has_dots(page, [7])
    page.click("#play")
    is_before(page, 2, 7, "double", 5, 9, "0.1")
    # The cursor is where it was.
    page.locator("#text .cm-content").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("F9")
    expect(page.locator("#script-status")).to_have_text("No breakpoint at line 7")
    has_dots(page, [])


def test_breakpoints_move_with_their_lines(page):
    gutter(page, 12)
    page.locator("#text .cm-line").first.click()
    page.keyboard.press("Home")
    page.keyboard.type("# One line more.\n")
    has_dots(page, [13])
    # The robots run the text without that line.
    page.click("#play")
    expect(place(page)).to_have_text("Robot 2, before walk.bzz:12, in step")
    expect(page.locator("#text .cm-statement")).to_have_text(re.compile(r"n = n \+ 1"))
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    expect(place(page)).to_have_text("Robot 2, before walk.bzz:13, in step")
    has_dots(page, [13])


def test_a_line_that_is_removed_has_no_breakpoint(page):
    gutter(page, 12)
    gutter(page, 13)
    has_dots(page, [12, 13])
    write(page, "function step() {\n    led(id)\n}\n", "double")
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    expect(page.locator("#clock")).to_have_text(re.compile(r"^[1-9]\.\d s"))


def test_a_world_without_breakpoints_shows_none(browser, session):
    page, send = page_with_events(browser, session)
    editor(page)
    gutter(page, 3)
    has_dots(page, [3])
    # So a session with emulated robots answers.
    send({"event": "breakpoints", "lines": []})
    has_dots(page, [])
    page.close()


def test_an_error_comes_after_its_statement(page):
    write(page, SCRIPT.replace("n = n + 1", "n = n + words.c"), "double")
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    page.click("#play")
    page.check("#stop-on-error")
    page.click("#start")
    at(page, 0)
    choose(page, 2)
    for _ in range(4):
        page.keyboard.press("F8")
    expect(place(page)).to_have_text("Robot 2, before walk.bzz:12, in step")
    page.keyboard.press("F8")
    expect(page.locator("#status")).to_contain_text("Robot 2 stopped by an error")
    expect(page.locator("#fault")).to_contain_text("words.c")
