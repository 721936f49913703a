"""The editor in the page of `bbz sim --view`."""

import re

import pytest
from playwright.sync_api import expect
from test_page import SCRIPT, digest, go, page, place, robot, save, session, simulated, value, window

__all__ = ["page", "session", "window"]

RED = "function step() {\n  led(1)\n}\n"


def editor(page, part="function"):
    """The editor, once it shows a text with that part."""
    page.click("#tab-script")
    content = page.locator("#text .cm-content")
    expect(content).to_contain_text(part)
    return content


def write(page, text, part="function"):
    """Replaces a text with that part, without the help of the editor."""
    editor(page, part).click()
    page.keyboard.press("Control+a")
    # Chromium would give the new text the style of the old one, which the page's policy forbids.
    page.keyboard.press("Delete")
    page.keyboard.insert_text(text)


def text(page):
    return "\n".join(page.locator("#text .cm-line").all_inner_texts())


def messages(page):
    return page.locator("#diagnostics li")


def test_the_script_is_shown(page):
    editor(page)
    assert text(page).splitlines() == [*SCRIPT.splitlines(), ""]
    expect(page.locator("#script-name")).to_have_value("s.bzz")


def test_an_error_is_reported_explained_and_fixed(page):
    write(page, "function step() {\n  led(3\n}\n")
    expect(messages(page).first).to_contain_text("line 2")
    expect(page.locator("#text .cm-lint-marker-error")).not_to_have_count(0)
    code = messages(page).first.get_by_role("button").first
    name = code.inner_text()
    assert re.fullmatch(r"E\d{4}", name)
    code.click()
    expect(page.locator("#explanation")).to_be_visible()
    expect(page.locator("#explanation h2")).to_contain_text(name)
    page.locator("#explanation").get_by_role("button").click()
    # Robots go on with what they have.
    for button in ["#run", "#load"]:
        page.click(button)
        expect(page.locator("#status")).to_have_text("`s.bzz` has errors: the robots go on with what they have")
        page.click("#step")
        expect(page.locator("#status")).to_have_text("")
    write(page, RED)
    expect(messages(page)).to_have_count(0)


def test_a_suggested_change_is_applied(page):
    write(page, "function step() {\n  neihgbors.broadcast(\"a\", 1)\n}\n")
    messages(page).first.get_by_role("button", name="Fix").click()
    expect(page.locator("#text .cm-content")).to_contain_text("neighbors.broadcast(\"a\", 1)")
    expect(messages(page)).to_have_count(0)


def test_names_complete_with_their_help(page):
    write(page, "")
    page.keyboard.type("neighbors.br")
    options = page.locator("#text .cm-tooltip-autocomplete")
    expect(options).to_contain_text("neighbors.broadcast(topic, value)")
    options.get_by_role("option").first.click()
    expect(page.locator("#text .cm-content")).to_have_text("neighbors.broadcast")
    page.keyboard.type("\nset_mo")
    expect(options).to_contain_text("set_motor")
    expect(page.locator("#text .cm-completionInfo")).to_contain_text(re.compile(r"\w"))


def test_a_new_line_after_a_comment_or_a_name_takes_no_other_name(page):
    write(page, "n = 0\nnorth = 1\n")
    page.keyboard.press("Control+End")
    options = page.locator("#text .cm-tooltip-autocomplete")
    page.keyboard.type("no = n")
    page.keyboard.press("Control+Space")
    expect(options.get_by_role("option").first).to_have_text("n")
    options.get_by_role("option").first.click()
    expect(options).to_have_count(0)
    for start in ["# no", "s = \"no"]:
        page.keyboard.type(f"\n{start}")
        page.keyboard.press("Control+Space")
        page.keyboard.type("\n")
    expect(page.locator("#text .cm-line")).to_have_text(["n = 0", "north = 1", "no = n", "# no", "", "s = \"no", "\""])


def test_all_robots_load_a_draft(page):
    write(page, RED)
    page.keyboard.press("Control+Shift+Enter")
    expect(page.locator("#script-status")).to_have_text("The robots run s.1.bzz.")
    expect(page.locator("#play")).to_have_text("Pause")
    page.click("#play")
    # It may have been paused before the first tick, in which the robots take the draft.
    page.click("#step")
    page.click("#tab-robot")
    page.mouse.click(*place(page, 40, 0))
    expect(value(robot(page, 7), "Globals", "n")).to_have_count(0)
    page.click("#tab-ground")
    expect(page.locator("#ground")).to_contain_text("s.1.bzz")


def test_the_chosen_robot_alone_loads_a_draft_and_the_session_is_saved(page, tmp_path):
    go(page, 10)
    page.mouse.click(*place(page, 40, 0))
    robot(page, 7)
    write(page, "var other = 5\nshown = other\nfunction step() { shown = shown + 1 }\n")
    page.select_option("#run-on", label="on robot 7")
    page.click("#load")
    expect(page.locator("#script-status")).to_have_text("The robots run s.1.bzz.")
    page.click("#play")
    go(page, 20)
    page.click("#tab-robot")
    # Global code, `init` and no step in the tick of the start.
    expect(value(robot(page, 7), "Globals", "shown")).to_have_text("14")
    # The other one has the old script.
    page.mouse.click(*place(page, -30, 0))
    expect(value(robot(page, 6), "Globals", "n")).to_have_text("19")
    go(page, 600)
    at_end = digest(page, 600)
    assert simulated(save(page, tmp_path))["digest"] == at_end


def test_a_script_is_written_to_its_file(page, session):
    write(page, RED)
    page.click("#write")
    expect(page.locator("#script-status")).to_have_text("s.bzz is saved.")
    assert (session.folder / "s.bzz").read_text() == RED
    page.keyboard.press("Control+End")
    write(page, RED + "# More.\n")
    page.keyboard.press("Control+s")
    expect(page.locator("#script-status")).to_have_text("s.bzz is saved.")
    assert (session.folder / "s.bzz").read_text() == RED + "# More.\n"


@pytest.mark.parametrize("session", [["--read-only"]], indirect=True)
def test_a_page_that_may_only_read_writes_no_file(page, session):
    write(page, RED)
    with page.expect_download() as download:
        page.click("#write")
    assert download.value.suggested_filename == "s.bzz"
    assert download.value.path().read_text() == RED
    assert (session.folder / "s.bzz").read_text() == SCRIPT


def test_controls_set_globals(page):
    write(page, "# slider: level 1..50 step 1\n# switch: lit\n# button: go\n# slider: broken\nlevel = 20\nlit = 0\ngo = 0\n"
                "function step() { led(lit) }\n")
    expect(messages(page)).to_contain_text(["write `# slider: NAME 1..50 step 1`"])
    page.click("#load")
    slider = page.get_by_role("slider", name="level")
    expect(slider).to_have_value("20")
    expect(page.locator("#play")).to_have_text("Pause")
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Play")
    # Not at the beginning, to which the way back leads.
    go(page, 20)
    slider.fill("33")
    page.get_by_role("checkbox", name="lit").check()
    page.get_by_role("button", name="go", exact=True).click()
    page.click("#tab-robot")
    page.mouse.click(*place(page, 40, 0))
    page.click("#step")
    panel = robot(page, 7)
    for name, number in [("level", "33"), ("lit", "1"), ("go", "1")]:
        expect(value(panel, "Globals", name)).to_have_text(number)
    # Back to before the change, and forward again.
    page.click("#start")
    expect(slider).to_have_value("20")
    # A text with another control keeps the numbers, if asked.
    write(page, "# slider: level 1..60 step 1\nlevel = 5\nfunction step() { }\n")
    go(page, 100)
    page.check("#keep")
    page.click("#load")
    expect(page.get_by_role("checkbox", name="lit")).to_have_count(0)
    page.click("#play")
    page.click("#step")
    page.click("#tab-robot")
    expect(value(panel, "Globals", "level")).to_have_text("33")
    expect(slider).to_have_value("33")
