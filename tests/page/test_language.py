"""The page and the texts of the lessons in English and in French."""

import os
import pathlib
import re
import subprocess
import tomllib

import pytest
from playwright.sync_api import expect
from test_page import address, bbz, end, page, session, window

pytestmark = pytest.mark.sample

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


LESSONS = [path for path in sorted(pathlib.Path("examples/lessons").glob("*.toml")) if "[assignment]" in path.read_text()]


def translations(kind, text):
    """The meanings by their colors, or the labels by their commands."""
    if kind.startswith("led"):
        return dict(re.findall(rf"^# {re.escape(kind)}: (\d) = (.*)$", text, re.MULTILINE))
    return {keys: label for label, keys in re.findall(rf"^# {re.escape(kind)}: (.*?)\s*: (.*)$", text, re.MULTILINE)}


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_texts_of_a_lesson_are_translated(path):
    task = tomllib.loads(path.read_text())["assignment"]
    french = task["fr"]
    assert french["title"] != task["title"]
    paragraphs = [one["text"].strip().split("\n\n") for one in (task, french)]
    assert len(paragraphs[1]) == len(paragraphs[0])
    # A paragraph is about the same words of the script.
    for one, other in zip(*paragraphs):
        assert set(re.findall(r"`[^`]*`", other)) == set(re.findall(r"`[^`]*`", one))
    # A space before these signs, and within quotation marks, breaks no line.
    assert re.findall(r".* [:;!?»].*|.*« .*", french["text"]) == []
    # Colors have their meanings, and commands their labels.
    script = path.with_suffix(".bzz").read_text()
    for kind in ["led", "led.fr"], ["try", "try.fr"]:
        english, translated = (translations(one, script + path.read_text()) for one in kind)
        assert set(translated) == set(english)
        assert not set(translated.values()) & set(english.values())
    assert script.split("\n")[2].startswith(f"# text.fr: {french['title']}\N{NO-BREAK SPACE}: ")


def test_a_lesson_is_in_the_language_of_the_page(browser, tmp_path):
    process = subprocess.Popen(bbz("sim", "examples/lessons/hops.toml", "--view", "--no-browser"), stdout=subprocess.PIPE, text=True, env={**os.environ, "XDG_STATE_HOME": str(tmp_path)})
    url = address(process)
    context = browser.new_context(locale="fr-FR", viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.goto(url)
    about = page.locator("#about")
    expect(about.locator("h2")).to_have_text("Compter les sauts")
    expect(about).to_contain_text("Le robot 1 a 0 saut.")
    expect(about.locator(".leds li").nth(2)).to_contain_text("vert : à 2 sauts")
    expect(about).to_contain_text("le début d'un devoir (hops.toml)")
    expect(about).not_to_contain_text("hops away")
    expect(about).not_to_contain_text("the beginning of an assignment")
    about.get_by_role("button", name="Le robot 15 tombe en panne").click()
    page.click("#tab-ground")
    expect(page.locator("#ground")).to_contain_text("fail = 15")
    page.locator("#canvas").press("n")
    page.click("#tab-robot")
    expect(page.locator("#robot")).to_contain_text("éteinte : la source, à 8 sauts, ou inconnu")
    page.click("#tab-tests")
    expect(page.locator("#assignment h2")).to_have_text("Compter les sauts")
    expect(page.locator("#assignment")).to_contain_text("Le script envoie déjà")
    page.click("#keys")
    page.locator("#language").select_option("English")
    expect(about.locator("h2")).to_have_text("Count the hops")
    expect(about.locator(".leds li").nth(2)).to_contain_text("green: 2 hops away")
    page.click("#tab-tests")
    expect(page.locator("#assignment h2")).to_have_text("Count the hops")
    context.close()
    end(process)


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
