"""Run, Load now and Play at any time of a run, and the lights and the hand-in that belong to the texts."""

import json
import re

import pytest
from playwright.sync_api import expect
from test_editor import RED, write
from test_page import SCENARIO, SCRIPT, at, digest, drag, go, page, place, robot, session, simulated, value, window

__all__ = ["page", "session", "window"]

# The first light needs a script that counts by two, from the beginning.
TASK = SCENARIO.replace("equals = 19", "equals = 38") + """
[assignment]
title = "Two"
text = "Count by two."
"""
BY_TWO = SCRIPT.replace("n + 1", "n + 2")
OVER = "the run is over (go back, or start the run again)"


def pass_errors(page):
    """Asks for runs that go on after the error of the script. Those of an assignment stop there."""
    page.check("#stop-on-error")
    page.uncheck("#stop-on-error")


def begin(page, session, text=TASK):
    """Runs the scenario of an assignment to its end, with the first script."""
    pass_errors(page)
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    write(page, text, "[world]")
    page.locator("#rate").select_option("as fast as it can")
    run(page)
    at(page, 600)
    page.locator("#script-name").select_option("s.bzz")


def run(page):
    """Presses Run, and waits for the end of the run."""
    page.click("#tab-script")
    page.evaluate("document.getElementById('script-status').textContent = ''")
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    expect(page.locator("#status")).to_have_text("The run is over.")


def lights(page):
    page.click("#tab-tests")
    return [one.get_attribute("class") for one in page.locator("#expectations p").all()]


def colors(page):
    return page.locator("#expectations b").evaluate_all("all => all.map((one) => getComputedStyle(one).color)")


def hand_in(page):
    page.click("#tab-tests")
    page.get_by_label("Your name").fill("Ada")
    with page.expect_download() as download:
        page.get_by_role("button", name="Hand in").click()
    return json.loads(download.value.path().read_text())


def verdict(page):
    return page.locator("#assignment [role=status]")


def test_run_at_the_end_starts_from_the_beginning_with_the_text(page, session):
    begin(page, session)
    assert lights(page) == ["failed", "held"]
    write(page, BY_TWO)
    run(page)
    at(page, 600)
    assert lights(page) == ["held", "held"]
    assert hand_in(page)["success"] is True
    expect(verdict(page)).to_have_text("2 of 2 held. two-ada.json is saved: hand it in.")


def test_run_in_the_middle_starts_from_the_beginning_with_all_texts(page, session, tmp_path):
    pass_errors(page)
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    write(page, TASK.replace("duration = 60", "duration = 50").replace("always = [0, 60]", "always = [0, 50]"), "[world]")
    page.locator("#script-name").select_option("s.bzz")
    write(page, BY_TWO)
    go(page, 77)
    page.mouse.click(*place(page, 40, 0))
    page.click("#tab-robot")
    page.get_by_role("button", name="Fail", exact=True).click()
    page.click("#tab-script")
    page.locator("#rate").select_option("as fast as it can")
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+Enter")
    expect(page.locator("#clock")).to_have_text("50.0 s of 50.0 s")
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_have_count(0)
    assert lights(page) == ["held", "held"]
    # The place in the text, and the robot, stay chosen.
    page.click("#tab-script")
    expect(page.locator("#script-name")).to_have_value("s.bzz")
    page.click("#tab-robot")
    expect(value(robot(page, 7), "Globals", "n")).not_to_have_text("0")


def test_a_run_keeps_the_changes_of_the_user(page):
    go(page, 20)
    drag(page, (-30, 0), (-200, 100))
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_have_count(1)
    write(page, BY_TWO)
    page.check("#keep-changes")
    page.locator("#rate").select_option("as fast as it can")
    run(page)
    at(page, 600)
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_contain_text(["move = 6"])
    # They are those of a scenario with the same change and the same text.
    shown = digest(page, 600)
    page.click("#tab-script")
    page.uncheck("#keep-changes")
    run(page)
    at(page, 600)
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_have_count(0)
    assert digest(page, 600) != shown


def test_the_session_of_a_new_run_is_saved(page, session, tmp_path):
    write(page, BY_TWO)
    page.locator("#rate").select_option("as fast as it can")
    run(page)
    at(page, 600)
    shown = digest(page, 600)
    (tmp_path / "s.bzz").write_text(BY_TWO)
    assert simulated(tmp_path / "s.toml")["digest"] == shown


def test_typing_goes_on_while_the_run_starts(page):
    write(page, BY_TWO)
    page.keyboard.press("Control+Home")
    page.keyboard.press("Control+Enter")
    page.keyboard.type("# typed on\n")
    expect(page.locator("#script-status")).to_have_text(re.compile("^$|The run has started"))
    expect(page.locator("#text .cm-line").first).to_have_text("# typed on")
    expect(page.locator("#play")).to_have_text("Pause")
    # The text that is shown is not the one that runs.
    page.click("#tab-tests")
    expect(page.locator("#older")).to_contain_text("of an older text")
    page.click("#tab-script")
    expect(page.locator("#text .cm-line").first).to_have_text("# typed on")


def test_play_at_the_end_starts_again(page):
    go(page, 600)
    page.locator("#rate").select_option("0.5")
    page.click("#play")
    expect(page.locator("#clock")).to_have_text(re.compile(r"^0\.[1-9] s"))
    expect(page.locator("#status")).to_have_text("")
    expect(page.locator("#play")).to_have_text("Pause")


def test_log_lines_of_a_run_that_starts_again_are_listed_once(page):
    page.locator("#rate").select_option("as fast as it can")
    page.click("#tab-log")
    for _ in range(2):
        page.click("#play")
        at(page, 600)
        expect(page.locator("#log p", has_text="n is 5")).not_to_have_count(0)
        times = page.locator("#log p", has_text="n is 5").locator("time").all_inner_texts()
        assert times == sorted(set(times), key=float)


def test_every_command_at_the_end_is_refused_with_a_plain_sentence(page):
    go(page, 600)
    status = page.locator("#status")

    def refused():
        expect(status).to_have_text(OVER)
        # The next refusal is another one.
        page.evaluate("document.getElementById('status').textContent = ''")

    page.mouse.click(*place(page, 40, 0))
    panel = robot(page, 7)
    panel.get_by_label("x in mm").fill("10")
    panel.get_by_label("y in mm").fill("10")
    for name in ["Fail", "Stop", "Resume", "Restart", "Cut off", "Reconnect", "Move"]:
        panel.get_by_role("button", name=name, exact=True).click()
        refused()
    drag(page, (-30, 0), (-200, 100))
    refused()
    drag(page, (0, -100), (-100, -150))
    refused()
    page.click("#tab-ground")
    page.get_by_label("share of the messages by ir that get lost").fill("40")
    refused()
    page.get_by_role("button", name="Heal").click()
    refused()
    page.get_by_label("robots that hear only each other").fill("6")
    page.keyboard.press("Enter")
    refused()
    page.get_by_label("lamp 1: x in mm").fill("10")
    page.get_by_label("lamp 1: x in mm").press("Enter")
    refused()
    write(page, RED)
    page.click("#load")
    refused()
    expect(page.locator("#play")).to_have_text("Play")
    page.click("#step")
    expect(status).to_have_text("The run is over.")
    at(page, 600)


def test_lights_of_an_older_text_are_gray_and_say_so(page, session):
    begin(page, session)
    assert lights(page) == ["failed", "held"]
    expect(page.locator("#older")).to_be_hidden()
    red, green = colors(page)
    assert red != green
    write(page, BY_TWO)
    page.click("#tab-tests")
    expect(page.locator("#older")).to_contain_text("Press Run")
    expect(page.locator("#expectations p")).to_contain_text(["(of an older text)", "(of an older text)"])
    gray = colors(page)
    assert gray[0] == gray[1] and gray[0] not in [red, green]
    # The text before is the one that has run.
    write(page, SCRIPT)
    page.click("#tab-tests")
    expect(page.locator("#older")).to_be_hidden()
    assert colors(page) == [red, green]
    # A text that is refused has not run either.
    write(page, BY_TWO + "}")
    page.click("#run")
    expect(page.locator("#status")).to_contain_text("`s.bzz` has errors")
    page.click("#tab-tests")
    expect(page.locator("#older")).to_be_visible()


def test_lights_after_a_text_was_loaded_are_gray_and_say_so(page, session):
    begin(page, session)
    go(page, 77)
    write(page, BY_TWO)
    page.click("#load")
    expect(page.locator("#script-status")).to_have_text("The robots run s.1.bzz.")
    at(page, 600)
    page.click("#tab-tests")
    expect(page.locator("#older")).to_contain_text("a text was loaded during the run")
    # After a reload, too.
    page.reload()
    at(page, 600)
    page.click("#tab-tests")
    expect(page.locator("#older")).to_contain_text("a text was loaded during the run")


@pytest.mark.parametrize("act", ["type", "refuse", "load"])
def test_a_text_that_has_not_run_is_not_handed_in(page, session, act):
    begin(page, session)
    if act == "load":
        go(page, 77)
    write(page, BY_TWO + ("}" if act == "refuse" else ""))
    if act != "type":
        page.click("#run" if act == "refuse" else "#load")
        expect(page.locator("#status" if act == "refuse" else "#script-status")).not_to_have_text("")
    page.click("#tab-tests")
    page.get_by_label("Your name").fill("Ada")
    downloads = []
    page.on("download", lambda download: downloads.append(download))
    page.get_by_role("button", name="Hand in").click()
    expect(verdict(page)).to_contain_text("press Run")
    # What to do: run it, and hand it in.
    write(page, BY_TWO)
    page.locator("#rate").select_option("as fast as it can")
    run(page)
    at(page, 600)
    assert downloads == []
    page.click("#tab-tests")
    expect(page.get_by_label("Your name")).to_have_value("Ada")
    result = hand_in(page)
    assert (result["success"], result["scripts"][0]["text"]) == (True, BY_TWO)


def test_trials_stay_when_the_run_starts_again(page):
    page.click("#tab-tests")
    page.fill("[name=seeds]", "2")
    page.locator(".trials").get_by_role("button", name="Start").click()
    expect(page.locator("#trials tbody tr")).to_have_count(1)
    expect(page.locator("#trials progress")).to_be_hidden()
    write(page, BY_TWO)
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    page.click("#tab-tests")
    expect(page.locator("#trials tbody tr")).to_have_count(1)
    expect(page.locator("[name=seeds]")).to_have_value("2")
