"""Notices: messages stand where one looks, move nothing, and go when they are mended."""

import re
import signal

from playwright.sync_api import expect
from test_editor import RED, write
from test_page import at, drag, go, page, page_with_events, place, robot, session, window

__all__ = ["page", "session", "window"]

WRONG = "function step() {\n  led(3\n}\n"


def box(page, selector):
    return page.locator(selector).bounding_box()


def color(page, selector):
    return page.locator(selector).evaluate("one => getComputedStyle(one).color")


def test_a_refusal_stands_next_to_the_pointer_and_moves_nothing(page):
    before = [box(page, one) for one in ["header", "#canvas", "aside"]]
    # An obstacle stands there.
    drag(page, (-30, 0), (300, 190))
    notice = page.locator("#notice-box")
    expect(notice).to_contain_text("obstacle")
    assert [box(page, one) for one in ["header", "#canvas", "aside"]] == before
    shown, (x, y) = notice.bounding_box(), place(page, 300, 190)
    assert abs(shown["x"] - x) < 60 and abs(shown["y"] - y) < 60, shown
    page.click("#close-notice")
    expect(page.locator("#status")).to_have_text("")
    expect(notice).to_be_hidden()


def test_a_message_that_was_closed_does_not_come_back(page, session):
    drag(page, (-30, 0), (300, 190))
    expect(page.locator("#status")).to_contain_text("obstacle")
    page.click("#close-notice")
    # The page takes its own message back, and shows the one before.
    session.send_signal(signal.SIGSTOP)
    expect(page.locator("#status")).to_contain_text("The session has not answered for")
    session.send_signal(signal.SIGCONT)
    expect(page.locator("#status")).to_have_text("")


def test_a_refusal_in_a_panel_covers_no_part_of_it(page):
    page.click("#tab-ground")
    field = page.get_by_label("robots that hear only each other")
    field.fill("99")
    field.press("Enter")
    expect(page.locator("#status")).to_contain_text("99")
    shown, panel, pressed = box(page, "#notice-box"), box(page, "aside"), field.bounding_box()
    assert shown["x"] + shown["width"] <= panel["x"]
    assert abs(shown["y"] - pressed["y"]) < 40
    page.keyboard.press("Escape")
    expect(page.locator("#notice-box")).to_be_hidden()


def test_a_message_goes_when_the_mistake_is_mended(page):
    write(page, WRONG)
    page.click("#run")
    expect(page.locator("#status")).to_contain_text("`s.bzz` has errors")
    write(page, RED)
    expect(page.locator("#diagnostics li")).to_have_count(0)
    expect(page.locator("#status")).to_have_text("")
    # A refused key of trials, too.
    page.click("#tab-tests")
    page.fill("[name=vary]", "medium.ir.los")
    page.fill("[name=values]", "1")
    start = page.locator(".trials").get_by_role("button", name="Start")
    start.click()
    expect(page.locator("#status")).to_contain_text("did you mean `loss`?")
    expect(page.locator("#status")).not_to_contain_text("--set")
    page.fill("[name=vary]", "medium.ir.loss")
    start.click()
    expect(page.locator("#status")).to_have_text("")


def test_a_long_error_stands_over_the_world_and_covers_no_button(browser, session):
    page, send = page_with_events(browser, session)
    before = box(page, "header")
    send({"event": "failed", "text": "a long reason " * 20})
    expect(page.locator("#status")).to_contain_text("a long reason")
    assert box(page, "header") == before
    shown, world = box(page, "#notice-box"), box(page, "#canvas")
    assert world["x"] <= shown["x"] and shown["x"] + shown["width"] <= world["x"] + world["width"], shown
    assert world["y"] <= shown["y"] and shown["y"] + shown["height"] <= world["y"] + world["height"], shown
    page.close()


def test_the_end_of_the_run_is_no_error(page):
    go(page, 600)
    expect(page.locator("#status")).to_have_text("The run is over.")
    assert color(page, "#status") == color(page, "#rate-label")
    header, status = box(page, "header"), box(page, "#status")
    assert header["y"] <= status["y"] and status["y"] + status["height"] <= header["y"] + header["height"]


def test_a_drag_beyond_the_border_ends_at_the_border(page):
    drag(page, (-30, 0), (-430, 100))
    page.click("#step")
    at(page, 1)
    expect(page.locator("#status")).to_have_text("")
    page.focus("#canvas")
    page.keyboard.press("n")
    facts = robot(page, 6).locator(".facts")
    # The robot's radius is 16.5 mm.
    expect(facts).to_contain_text(re.compile(r"\(-383\.5, (9\d|10\d)\.\d\) mm"))
    page.keyboard.press("Shift+ArrowLeft")
    page.click("#step")
    at(page, 2)
    expect(facts).to_contain_text("(-383.5, ")
    expect(page.locator("#status")).to_have_text("")


def test_a_lamp_stays_on_the_ground(page):
    drag(page, (-300, -200), (-300, -320))
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_contain_text(re.compile(r"at = \[-(299|300)\.\d, -300\.0\]"))
