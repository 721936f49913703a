"""The page in English and in French."""

import pytest
from playwright.sync_api import expect
from test_page import page, session, window

__all__ = ["page", "session", "window"]

# Texts that are equal in both languages: words, names, numbers, signs and files.
SAME = {
    "Pause", "Messages", "3-D", "Robot", "Script", "Tests", "Partition", "Robots", "LED", "Attitude", "magenta", "cyan", "Ctrl + S",
    "CSV", "R", "B", "M", "C", "W", "x", "y", "z", "nRF24", "P2P", "medium.ir.loss", "0, 0.1, 0.3", "3, 5..8", "session.toml", "Tab",
    "bittybuzz.png", "bittybuzz.svg", "bittybuzz.html", ",  .", "Script •", "min", "max", "", "n  p", "f", "c", "F7", "F9",
    "b", "Ctrl + C  V  D", "Ctrl + Z  Y", "r", "h", "Obstacles",
}


@pytest.fixture
def french(browser, session):
    context = browser.new_context(locale="fr-FR", viewport={"width": 1280, "height": 800})
    yield context.new_page()
    context.close()


def test_the_language_is_that_of_the_browser(french, session):
    french.goto(session.url)
    expect(french.locator("#play")).to_have_text("Lecture")
    expect(french.locator("html")).to_have_attribute("lang", "fr")
    expect(french.locator("#tab-ground")).to_have_text("Monde")
    expect(french.locator("#clock")).to_contain_text("0.0 s sur ")
    # The tabs are in one row, and nothing is wider than the window.
    tabs = french.locator("nav [role=tab]")
    assert len({tab.bounding_box()["y"] for tab in tabs.all()}) == 1
    assert french.evaluate("document.documentElement.scrollWidth") <= 1280


def test_the_language_is_chosen_and_kept(page):
    expect(page.locator("#play")).to_have_text("Play")
    page.click("#keys")
    page.locator("#language").select_option("Français")
    expect(page.locator("#play")).to_have_text("Lecture")
    page.reload()
    expect(page.locator("#play")).to_have_text("Lecture")
    page.click("#keys")
    expect(page.locator("#help h2")).to_have_text("Touches et langue")
    expect(page.locator("#languages")).to_contain_text("sont en anglais")
    page.locator("#language").select_option("English")
    expect(page.locator("#play")).to_have_text("Play")
    expect(page.locator("html")).to_have_attribute("lang", "en")


def test_every_text_is_translated(page):
    texts = page.evaluate("""async () => {
        const [{ english }, { french }] = await Promise.all([import("./texts-en.js"), import("./texts-fr.js")]);
        const flat = (value) => typeof value === "object" ? Object.values(value).flatMap(flat) : [typeof value === "function" ? value.toString() : value];
        return Object.keys(english).map((name) => [name, flat(english[name]), flat(french[name])]);
    }""")
    assert len(texts) > 250
    for name, english, french in texts:
        assert len(english) == len(french), name
        for one, other in zip(english, french):
            # Functions that only put numbers together are equal in both.
            is_word = any(letter.isalpha() for letter in one) and "=>" not in one
            assert not is_word or one != other or one in SAME, f"{name}: {one}"
