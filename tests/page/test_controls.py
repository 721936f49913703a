"""Characters that control a terminal or turn the direction of text, in every text that the page gets from others."""

import re

import pytest
from conftest import note_problems
from playwright.sync_api import expect
from test_page import at, end, page_with_events, show

pytestmark = pytest.mark.sample

# Of each kind one: C0, DEL, C1, and the controls of Unicode Standard Annex 9.
EVIL = "\u001b[31m\u007f\u009b\u061c\u200f\u202e\u2066"
SHOWN = r"\u001b[31m\u007f\u009b\u061c\u200f\u202e\u2066"
IN_TOML = EVIL.translate({ord(one): f"\\u{ord(one):04x}" for one in EVIL if one not in "[31m"})

SCRIPT = f"""# slider: SPEED 0..9 step 1
SPEED = 3
WORD = ""
function step() {{
  var t = {{}}
  t["{EVIL}"] = 1
  log("said {EVIL}", SPEED)
  if(id == 1) led(t.none + 1)
}}
"""

SCENARIO = f"""[world]
size = [400, 300]
duration = 60

[assignment]
title = "title {IN_TOML}"
text = "text {IN_TOML}"

[[robots]]
name = "group"
robot = "crazyflie"
script = "s.bzz"
count = 3

[[expect]]
at = 1
value = "global.WORD"
equals = "expectation {IN_TOML}"
"""

# Texts and labels of the page outside the editor, which shows such characters as dots.
TEXTS = """() => {
    const texts = [];
    const walker = document.createTreeWalker(document.documentElement, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        if (!walker.currentNode.parentElement.closest("#text, script, style")) {
            texts.push(walker.currentNode.data);
        }
    }
    for (const one of document.querySelectorAll("*")) {
        if (!one.closest("#text")) {
            texts.push(...["title", "aria-label", "label"].map((name) => one.getAttribute(name) ?? ""));
        }
    }
    return texts;
}"""

CONTROL = re.compile("[\\u0000-\\u0008\\u000b-\\u001f\\u007f-\\u009f\\u061c\\u200e\\u200f\\u202a-\\u202e\\u2066-\\u2069]")


@pytest.fixture(name="session")
def session_of_controls(tmp_path):
    (tmp_path / "s.bzz").write_text(SCRIPT)
    (tmp_path / "s.toml").write_text(SCENARIO)
    process = show(tmp_path)
    yield process
    end(process)


def check(page):
    """No text has a control, and some have what stands for them."""
    texts = page.evaluate(TEXTS)
    assert [text for text in texts if CONTROL.search(text)] == []
    return "\n".join(texts)


def test_no_text_of_a_session_has_controls(browser, session):
    page, _ = page_with_events(browser, session)
    problems = []
    note_problems(page, problems)
    page.click("#step")
    for tick in range(1, 12):
        at(page, tick)
        page.click("#step")
    for name in ["title", "text", "expectation"]:
        assert f"{name} {SHOWN}" in check(page), name
    page.click("#tab-log")
    expect(page.locator("#log")).to_contain_text(f"said {SHOWN}")
    check(page)
    page.click("#tab-robot")
    page.locator("#canvas").press("n")
    check(page)
    page.click("#tab-script")
    # The editor shows a mark in the place of each.
    expect(page.locator("#text .cm-specialChar").first).to_be_visible()
    assert not CONTROL.search(page.locator("#text .cm-content").inner_text())
    page.click("#tab-tests")
    check(page)
    assert problems == []
    page.close()


def test_no_text_of_an_event_has_controls(browser, session):
    page, send = page_with_events(browser, session)
    evil = f"said {EVIL}"
    place = {"file": evil, "line": 1, "column": 1, "end_line": 1, "end_column": 2, "function": evil, "text": evil, "script": None}
    fault = {"tick": 0, "robot": 0, "consequence": "stop", "code": "R0001", "message": evil, "help": evil, "places": [place], "values": []}
    for event in [
        {"event": "logs", "lost": 1, "lines": [{"tick": 0, "robot": 0, "text": evil}]},
        {"event": "refused", "text": evil, "help": evil},
        {"event": "failed", "text": evil},
        {"event": "written", "name": evil, "sha256": ""},
        {"event": "digest", "tick": 0, "digest": evil},
        {"event": "explanation", "code": "E0201", "text": f"# {evil}\n\n{evil}\n```\n{evil}\n```\n"},
        {"event": "marks", "marks": [], "csv": evil},
        {"event": evil},
        {"event": "fault", **fault},
        {"event": "defect", "text": evil, "help": evil},
    ]:
        send(event)
        page.wait_for_timeout(200)
        check(page)
    assert SHOWN in check(page)
    page.close()
