"""Texts that were typed and not saved: nothing is lost when a page is closed, crashes, or loses its server."""

import os
import re
import signal

import pytest
from conftest import launch, note_problems
from playwright.sync_api import expect
from test_editor import RED, editor, text, write
from test_page import SCRIPT, SECONDS_MAX, at, end, session, show

__all__ = ["session"]

TYPED = "# Typed and not saved.\n"


@pytest.fixture
def open_page(browser):
    """A function that opens a page of a run."""
    # A page without a context of its own would take its context along, without a question.
    contexts, problems = [], []

    def opened(process):
        contexts.append(browser.new_context(viewport={"width": 1280, "height": 800}))
        page = contexts[-1].new_page()
        note_problems(page, problems)
        page.goto(process.url)
        at(page, 0)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert problems == []


def kept(folder):
    """The texts in the private files of the user."""
    return [path.read_text() for path in (folder / "state").rglob("*.json")]


def wait_until_kept(page, folder, part):
    """Waits until a file has a text with that part. The page waits in the meantime, so that it can send it."""
    for _ in range(10 * SECONDS_MAX):
        if any(part in one for one in kept(folder)):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"no file has {part}: {kept(folder)}")


def asks(page):
    """Returns true if the page asks before it is closed, and then stays."""
    dialogs = []

    def dismiss(dialog):
        dialogs.append(dialog.type)
        dialog.dismiss()

    page.once("dialog", dismiss)
    # Events come while another page waits, which stays open.
    other = page.context.new_page()
    page.close(run_before_unload=True)
    for _ in range(10 * SECONDS_MAX):
        other.wait_for_timeout(100)
        if dialogs or page.is_closed():
            other.close()
            return dialogs == ["beforeunload"]
    raise AssertionError("it is neither closed nor does it ask")


def offers(page):
    return page.locator("#unsaved li")


def test_a_page_with_a_changed_text_asks_before_it_is_closed(open_page, session):
    page = open_page(session)
    write(page, RED)
    assert asks(page), "the text that is shown"
    page.locator("#script-name").select_option("s.toml")
    editor(page, "duration")
    assert asks(page), "a text that is not shown"
    page.locator("#script-name").select_option("s.bzz")
    editor(page, "led(1)")
    # A draft that robots run is in no file either.
    page.click("#load")
    expect(page.locator("#script-status")).to_have_text("The robots run s.1.bzz.")
    assert asks(page), "a draft"
    page.click("#write")
    expect(page.locator("#script-status")).to_have_text("s.bzz is saved.")
    assert not asks(page)


def test_a_text_survives_the_end_of_the_server(open_page, session):
    page = open_page(session)
    write(page, RED + TYPED)
    wait_until_kept(page, session.folder, TYPED.strip())
    # As `kill -9` does.
    end(session)
    expect(page.locator("body")).to_have_class(re.compile("ended"))
    again = show(session.folder)
    try:
        page = open_page(again)
        # The editor opens, and offers the text with its time.
        expect(offers(page)).to_have_count(1)
        expect(offers(page)).to_contain_text(re.compile(r"s\.bzz, typed \d+ \w+ \d{4}, \d\d:\d\d and not saved"))
        expect(offers(page)).not_to_contain_text("The file has changed since.")
        assert text(page).splitlines() == [*SCRIPT.splitlines(), ""]
        page.get_by_role("button", name="Restore").click()
        expect(offers(page)).to_have_count(0)
        assert text(page).splitlines() == [*(RED + TYPED).splitlines(), ""]
        # It is kept until it is saved.
        wait_until_kept(page, session.folder, TYPED.strip())
        page.click("#write")
        expect(page.locator("#script-status")).to_have_text("s.bzz is saved.")
        page.click("#step")
        at(page, 1)
        assert kept(session.folder) == []
    finally:
        end(again)


def test_a_text_survives_a_crash_of_the_page(browser, open_page, session):
    # Its processes belong to no other page of the tests.
    own = launch(browser.browser_type)
    page = own.new_page()
    page.goto(session.url)
    at(page, 0)
    write(page, RED + TYPED)
    wait_until_kept(page, session.folder, TYPED.strip())
    processes = own.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    with page.expect_event("crash"):
        for process in processes:
            if process["type"] == "renderer":
                os.kill(process["id"], signal.SIGKILL)
    own.close()
    page = open_page(session)
    expect(offers(page)).to_have_count(1)


def test_a_text_of_a_file_that_has_changed_says_so_and_is_discarded(open_page, session):
    page = open_page(session)
    write(page, RED + TYPED)
    wait_until_kept(page, session.folder, TYPED.strip())
    end(session)
    (session.folder / "s.bzz").write_text(SCRIPT + "# By another program.\n")
    again = show(session.folder)
    try:
        page = open_page(again)
        expect(offers(page)).to_contain_text("The file has changed since.")
        # What is typed now does not replace it.
        write(page, "# Other words.\n")
        wait_until_kept(page, session.folder, "Other words")
        assert len(kept(session.folder)) == 2
        page.get_by_role("button", name="Discard").click()
        expect(offers(page)).to_have_count(0)
        page.click("#step")
        at(page, 1)
        assert len(kept(session.folder)) == 1
    finally:
        end(again)


def test_a_text_comes_back_after_a_reload(open_page, session):
    page = open_page(session)
    write(page, RED + TYPED)
    page.on("dialog", lambda dialog: dialog.accept())
    page.reload()
    expect(offers(page)).to_have_count(1)
    page.get_by_role("button", name="Restore").click()
    expect(page.locator("#text .cm-content")).to_contain_text(TYPED.strip())


def test_another_page_is_offered_the_text_of_the_first(open_page, session):
    first = open_page(session)
    write(first, RED + TYPED)
    wait_until_kept(first, session.folder, TYPED.strip())
    second = open_page(session)
    expect(offers(second)).to_have_count(1)
    second.close()
    # The first page has the text already.
    expect(first.locator("#take-over")).to_be_hidden()
    expect(offers(first)).to_have_count(0)
    assert text(first).splitlines() == [*(RED + TYPED).splitlines(), ""]
    wait_until_kept(first, session.folder, TYPED.strip())


def test_a_file_that_changed_meanwhile_is_not_overwritten_without_a_question(open_page, session):
    page = open_page(session)
    write(page, RED)
    (session.folder / "s.bzz").write_text("# By another program.\n")
    page.click("#write")
    notice = page.locator("#changed")
    expect(notice).to_contain_text("s.bzz has another text on disk than this page has read.")
    assert (session.folder / "s.bzz").read_text() == "# By another program.\n"
    notice.get_by_role("button", name="Load").click()
    expect(page.locator("#text .cm-content")).to_have_text("# By another program.")
    expect(notice).to_be_hidden()
    # Undo brings the own text back.
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+z")
    expect(page.locator("#text .cm-content")).to_contain_text("led(1)")
    (session.folder / "s.bzz").write_text("# Once more.\n")
    page.click("#write")
    notice.get_by_role("button", name="Overwrite").click()
    expect(page.locator("#script-status")).to_have_text("s.bzz is saved.")
    assert (session.folder / "s.bzz").read_text() == RED


def test_a_text_that_was_typed_is_not_replaced_by_that_of_the_file(open_page, session):
    page = open_page(session)
    write(page, RED)
    (session.folder / "s.bzz").write_text("# By another program.\n")
    page.locator("#script-name").select_option("s.toml")
    editor(page, "duration")
    page.locator("#script-name").select_option("s.bzz")
    expect(page.locator("#changed")).to_contain_text("The session has another text of s.bzz.")
    expect(page.locator("#text .cm-content")).to_contain_text("led(1)")
    page.locator("#changed").get_by_role("button", name="Load").click()
    expect(page.locator("#text .cm-content")).to_have_text("# By another program.")


def test_only_the_user_can_read_the_texts(open_page, session):
    page = open_page(session)
    write(page, RED + TYPED)
    wait_until_kept(page, session.folder, TYPED.strip())
    for path in (session.folder / "state").rglob("*.json"):
        assert os.stat(path).st_mode & 0o777 == 0o600
