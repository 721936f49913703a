"""Run-time errors of scripts in the page: from *Play* to the line and the values, without the terminal."""

import os
import re
import subprocess

import pytest
from playwright.sync_api import expect
from test_page import address, bbz, value, window

__all__ = ["window"]

# In its tenth step robot 12 reads past the end of its table; it is tick 10, because the first one is for the global code.
SCRIPT = """\
# Each robot walks as fast as its list says.
speeds = {.0 = 10, .1 = 20, .2 = 30}
n = 0

function mean(last) {
    var total = 0
    var i = 0
    while(i <= last) {
        total = total + speeds[i]
        i = i + 1
    }
    return total / last
}

function step() {
    n = n + 1
    if(id == 12 and n == 10) {
        log("mean is ", mean(3))
    }
    led(n % 8)
}
"""

LINE = 9

SCENARIO = """\
[world]
size = [1200, 800]
duration = 60

[[robots]]
robot = "kilobot"
script = "walk.bzz"
count = 30

[[robots]]
robot = "kilobot"
script = "still.bzz"
name = "lamps"
count = 3

[[expect]]
at = 2
robots = [0, 2]
value = "global.n"
equals = 19

[[expect]]
at = 2
robots = "lamps"
value = "led"
equals = 1

[medium.ir]
clock_error = 0
"""

ASSIGNMENT = """
[assignment]
title = "Walk"
text = "Let all robots walk."
"""


@pytest.fixture
def page(window, tmp_path, request):
    """The page of an assignment, or of the scenario of a test."""
    (tmp_path / "walk.bzz").write_text(SCRIPT)
    (tmp_path / "still.bzz").write_text("function step() { led(1) }\n")
    scenario = tmp_path / "walk.toml"
    scenario.write_text(getattr(request, "param", SCENARIO + ASSIGNMENT))
    # The scenario has an absolute path, which the page must not show.
    # No text of another test is offered, and none of the user's.
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")}
    process = subprocess.Popen(bbz("sim", str(scenario), "--view", "--no-browser"), stdout=subprocess.PIPE, text=True, env=environment)
    window.problems.clear()
    window.goto(address(process))
    expect(window.locator("#clock")).to_have_text("0.0 s of 60.0 s")
    window.folder = str(tmp_path)
    yield window
    window.goto("about:blank")
    process.kill()
    process.wait(timeout=60)
    assert window.problems == []


# The number of the line whose gutter has the mark in the next picture: both stand at the same height.
MARKED = """async () => {
    await new Promise((done) => requestAnimationFrame(done));
    const root = document.querySelector("#text").shadowRoot;
    const top = (element) => element.getBoundingClientRect().top;
    const marked = top(root.querySelector(".cm-lint-marker-error").closest(".cm-gutterElement"));
    const lines = [...root.querySelectorAll(".cm-lineNumbers .cm-gutterElement")].filter((one) => one.style.visibility !== "hidden");
    return Number(lines.find((one) => Math.abs(top(one) - marked) < 2).textContent);
}"""


def marked_line(page):
    """The line of the editor that has the mark of an error in the gutter, and the text under the squiggle."""
    expect(page.locator("#text .cm-lint-marker-error")).to_have_count(1)
    return page.evaluate(MARKED), page.locator("#text .cm-lintRange-error").inner_text()


def test_play_leads_to_the_line_and_the_values_of_a_fault(page):
    expect(page.get_by_label("Stop on error")).to_be_checked()
    page.click("#play")
    # The world stands still at the end of the tick with the fault.
    expect(page.locator("#play")).to_have_text("Play")
    expect(page.locator("#clock")).to_have_text("1.1 s of 60.0 s")
    expect(page.locator("#status")).to_have_text("Robot 12 stopped by an error.")
    # The editor is open at the line, which is marked.
    expect(page.locator("#script")).to_be_visible()
    expect(page.locator("#script-name")).to_have_value("walk.bzz")
    assert marked_line(page) == (LINE, "total + speeds[i]")
    fault = page.locator("#fault")
    expect(fault).to_contain_text("Robot 12 at 1.0 s: cannot add an integer and nil: speeds[i] is nil")
    expect(fault.locator(".value")).to_have_text(["total is 60", "speeds[i] is nil", "i is 3", "speeds is {.0 = 10, .1 = 20, .2 = 30}"])
    expect(fault).to_contain_text("a variable or field that was never assigned is nil")
    expect(fault.locator(".calls")).to_have_text("called at walk.bzz:18, in step")
    page.locator("#text .cm-lintRange-error").hover()
    expect(page.locator("#text .cm-tooltip-lint")).to_contain_text("speeds[i] is nil")
    for tab in ["robot", "log", "script"]:
        page.click(f"#tab-{tab}")
        assert page.folder not in page.locator("body").inner_text(), tab


def test_an_error_leads_nobody_away_from_a_name_half_typed(page):
    page.click("#tab-tests")
    name = page.get_by_label("Your name")
    name.press_sequentially("Ad")
    # Space would be a part of the name.
    page.evaluate("document.querySelector('#play').click()")
    expect(page.locator("#status")).to_have_text("Robot 12 stopped by an error.")
    name.press_sequentially("a")
    expect(name).to_have_value("Ada")
    # The place is marked for later: in the first picture of the script already.
    assert page.evaluate(f"() => {{ document.querySelector('#tab-script').click(); return ({MARKED})(); }}") == LINE
    assert marked_line(page) == (LINE, "total + speeds[i]")
    expect(page.locator("#fault")).to_contain_text("Robot 12 at 1.0 s")


def test_the_log_shows_message_values_and_help_and_leads_to_the_line(page):
    page.click("#play")
    expect(page.locator("#fault")).to_be_visible()
    page.get_by_role("button", name="Hides the error").click()
    expect(page.locator("#fault")).to_be_hidden()
    expect(page.locator("#text .cm-lint-marker-error")).to_have_count(0)
    # Another script is open.
    page.select_option("#script-name", "still.bzz")
    expect(page.locator("#text .cm-content")).to_contain_text("led(1)")
    page.click("#tab-log")
    line = page.locator("#log .fault")
    expect(line).to_contain_text("cannot add an integer and nil: speeds[i] is nil")
    expect(line).to_contain_text("i is 3")
    expect(line).to_contain_text("never assigned")
    page.get_by_role("button", name=f"walk.bzz:{LINE}, in mean").click()
    expect(page.locator("#script-name")).to_have_value("walk.bzz")
    assert marked_line(page) == (LINE, "total + speeds[i]")
    # The call that led there.
    page.locator("#fault").get_by_role("button", name="walk.bzz:18, in step").click()
    expect(page.locator("#text .cm-lintRange-error")).to_have_text("mean(3)")


def test_the_mark_follows_the_line_until_it_is_mended(page):
    page.click("#play")
    assert marked_line(page)[0] == LINE
    # Lines before it move it.
    page.locator("#text .cm-line").first.click()
    page.keyboard.press("Control+Home")
    page.keyboard.insert_text("# A line.\n# And another one.\n")
    expect(page.locator("#text .cm-lint-marker-error")).to_have_count(1)
    expect(page.locator("#text .cm-lintRange-error")).to_have_text("total + speeds[i]")
    # A line that differs has no mark.
    page.locator("#text .cm-line", has_text="total + speeds").click()
    page.keyboard.press("End")
    page.keyboard.insert_text(" * 1")
    expect(page.locator("#text .cm-lint-marker-error")).to_have_count(0)


def test_a_robot_keeps_its_memory_of_the_moment_of_the_fault(page):
    page.click("#play")
    expect(page.locator("#fault")).to_be_visible()
    page.click("#tab-robot")
    panel = page.locator("#robot")
    expect(panel.locator("h2")).to_have_text("Robot 12")
    past = panel.locator(".at-fault")

    def check():
        expect(panel.locator("p.fault")).to_contain_text("Error R0001 at 1.0 s: cannot add an integer and nil: speeds[i] is nil")
        expect(past.locator("summary").first).to_have_text("Memory at the error, at 1.0 s")
        expect(value(past, f"In mean walk.bzz:{LINE}", "total")).to_have_text("60")
        expect(value(past, f"In mean walk.bzz:{LINE}", "last")).to_have_text("3")
        expect(value(past, "Globals", "n")).to_have_text("10")

    check()
    # The script starts again after a second.
    page.locator("#time").fill("25")
    expect(page.locator("#clock")).to_have_text("2.5 s of 60.0 s")
    expect(panel.locator(".state")).to_have_text("running")
    expect(value(panel.locator("> .memory"), "Globals", "n")).not_to_have_text("10")
    check()
    # Before the fault there is nothing to tell.
    page.locator("#time").fill("8")
    expect(page.locator("#clock")).to_have_text("0.8 s of 60.0 s")
    expect(past).to_be_hidden()
    expect(panel.locator("p.fault")).to_be_hidden()
    page.locator("#time").fill("12")
    check()


@pytest.mark.parametrize("page", [SCENARIO], indirect=True, ids=["no assignment"])
def test_without_an_assignment_the_run_goes_on(page):
    expect(page.get_by_label("Stop on error")).not_to_be_checked()
    page.locator("#rate").select_option("100")
    page.click("#play")
    expect(page.locator("#clock")).to_have_text("60.0 s of 60.0 s")
    expect(page.locator("#fault")).to_be_hidden()
    page.click("#start")
    page.get_by_label("Stop on error").check()
    page.click("#play")
    expect(page.locator("#clock")).to_have_text("1.1 s of 60.0 s")
    expect(page.locator("#fault")).to_be_visible()


def test_expectations_name_their_robots(page):
    page.click("#tab-tests")
    expect(page.locator("#expectations p span")).to_have_text(
        ["all of robots 0, 2: global.n equals 19, at 2 s", "all of lamps: led equals 1, at 2 s"])


def test_expectations_of_trials_are_told_apart(page):
    page.click("#tab-tests")
    options = page.locator("select[name=measure] optgroup").first.locator("option").all_text_contents()
    assert len(set(options)) == len(options) == 2
    assert re.fullmatch(r"all of robots 0, 2: .*", options[0])
