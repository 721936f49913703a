"""The list of the session's own changes: undo, redo and delete."""

import pytest
from playwright.sync_api import expect
from test_page import at, digest, drag, go, page, robot, place, save, session, simulated, window

pytestmark = pytest.mark.sample

__all__ = ["page", "session", "window"]


def changes(page):
    return page.locator("#changes code")


def button(page, name):
    return page.locator("#changes").get_by_role("button", name=name, exact=True)


def test_changes_are_undone_redone_and_deleted(page, tmp_path):
    go(page, 300)
    untouched = digest(page, 300)
    expect(button(page, "Undo")).to_be_disabled()
    go(page, 20)
    page.mouse.click(*place(page, -30, 0))
    robot(page, 6).get_by_role("button", name="Stop", exact=True).click()
    go(page, 40)
    drag(page, (40, 0), (200, 100))
    page.click("#tab-ground")
    expect(changes(page)).to_have_count(2)
    go(page, 300)
    both = digest(page, 300)
    # A single one, and the present stays.
    button(page, "Delete stop = 6 at 2.0 s").click()
    expect(changes(page)).to_have_count(1)
    expect(changes(page)).to_contain_text("move = 7")
    expect(button(page, "Undo")).to_be_focused()
    at(page, 300)
    moved = digest(page, 300)
    button(page, "Undo").click()
    expect(changes(page)).to_have_count(2)
    at(page, 300)
    assert digest(page, 300) == both
    for count in [1, 0]:
        button(page, "Undo").click()
        expect(changes(page)).to_have_count(count)
    at(page, 300)
    assert digest(page, 300) == untouched
    expect(button(page, "Undo")).to_be_disabled()
    for count in [1, 2, 1]:
        button(page, "Redo").click()
        expect(changes(page)).to_have_count(count)
    expect(button(page, "Redo")).to_be_disabled()
    at(page, 300)
    assert digest(page, 300) == moved
    # The saved scenario has what remains.
    go(page, 600)
    end = digest(page, 600)
    assert simulated(save(page, tmp_path))["digest"] == end
    assert len({untouched, moved, both}) == 3


def test_lines_are_those_of_the_way_that_is_shown(page):
    go(page, 10)
    page.mouse.click(*place(page, 40, 0))
    robot(page, 7).get_by_role("button", name="Fail", exact=True).click()
    # Before the script starts again after its fault.
    go(page, 25)
    faults = page.locator("#log .fault")
    page.click("#tab-log")
    expect(page.locator("#log")).to_contain_text("n is 5")
    expect(faults).to_have_count(0)
    for name, count in [("Undo", 1), ("Redo", 0), ("Undo", 1)]:
        page.click("#tab-ground")
        button(page, name).click()
        expect(changes(page)).to_have_count(1 - count)
        at(page, 25)
        page.click("#tab-log")
        expect(faults).to_have_count(count)
        expect(page.locator("#marks .fault")).to_have_count(count)
        expect(page.locator("#log p", has_text="n is 5")).to_have_count(1)
