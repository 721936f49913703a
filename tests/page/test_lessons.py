"""Follows the numbered steps of each lesson and of the tutorial in the page, as they are written in docs.

Pages in French have the same steps as the pages in English, so that either can be followed.

A sentence of a step either is one of ACTIONS, which are done and checked in the page, or it is about the script alone. A sentence that
names a part of the page in any other words fails the test, so that the texts and the page stay the same.
"""

import json
import os
import pathlib
import re
import subprocess
import tomllib
import xml.etree.ElementTree

import pytest
from conftest import note_problems, saved
from french_steps import FRENCH_STEPS
from playwright.sync_api import expect
from test_editor import write
from test_page import address, bbz

LESSONS = sorted(pathlib.Path("docs/lessons").glob("[0-9]*.md"))
FRENCH_LESSONS = [path.parent / "fr" / path.name for path in LESSONS]

# Words of sentences that ask for something in the page, in English and in French.
OF_THE_PAGE = re.compile(
    r"\*\w|\b(press|click|drag|type|open|choose|select|page|button|tab|lights?|mouse|ctrl"
    r"|pressez|cliquez|glisser|tapez|ouvrez|choisissez|bouton|onglet|voyants?|souris)\b",
    re.IGNORECASE,
)


def name_of(lesson):
    return lesson.stem.split("-", 1)[1]


def steps(text):
    """The sentences of the numbered steps of an assignment."""
    section = re.search(r"^## (?:The assignment|Le devoir)\n(.*?)^## ", text.replace("\N{NO-BREAK SPACE}", " "), re.MULTILINE | re.DOTALL)[1]
    found = re.findall(r"^\d+\. (.*(?:\n {3}.*)*)", section, re.MULTILINE)
    return [sentence.strip() for step in found for line in step.split("\n") for sentence in re.split(r"(?<=[.?!]) (?=[A-ZÀÉ*])", line)]


def wrong_script(lesson):
    """The first wrong answer, which is a change to the solution."""
    script = solution(lesson)
    first = next(one for one in tomllib.loads(pathlib.Path("tests/lessons/wrong.toml").read_text())["wrong"] if one["lesson"] == lesson)
    for old, new in first["replace"]:
        assert old in script
        script = script.replace(old, new)
    return script


def solution(lesson):
    return pathlib.Path(f"examples/lessons/solutions/{lesson}.bzz").read_text()


class Learner:
    """A reader of a lesson beside the page, in the language of the page."""

    def __init__(self, page, lesson):
        self.page, self.lesson = page, lesson
        with open(f"examples/lessons/{lesson}.toml", "rb") as file:
            self.scenario = tomllib.load(file)
        self.handed_in = None

    def text(self, name, *arguments):
        """A text of the page by its name in the files of texts, which stand within the one script of the playground."""
        language = self.page.evaluate("() => document.documentElement.lang")
        source = pathlib.Path(f"bbz/page/web/texts-{language}.js").read_text()
        texts = re.sub(r"^export const \w+", "const texts", source, flags=re.MULTILINE)
        return self.page.evaluate(
            f"""([name, values]) => {{
                {texts}
                const text = texts[name];
                return typeof text === "function" ? text(...values) : text;
            }}""",
            [name, arguments],
        )

    def clock(self, seconds):
        return self.text("clock", seconds, self.scenario["world"]["duration"])

    def is_at_the_end(self):
        expect(self.page.locator("#status")).to_have_text(self.text("over"), timeout=120_000)
        expect(self.page.locator("#clock")).to_have_text(self.clock(self.scenario["world"]["duration"]))

    def has_started(self):
        expect(self.page.locator("#script-status")).to_have_text(self.text("began"))

    def is_playing(self):
        expect(self.page.locator("#play")).to_have_text(self.text("pause"))

    def lights(self):
        self.page.click("#tab-tests")
        return self.page.locator("#expectations p")

    def count(self):
        return len(self.scenario["expect"])

    def plays(self, *_):
        # At the end of a run, it starts again.
        self.page.evaluate("document.getElementById('status').textContent = ''")
        self.page.click("#play")
        self.is_at_the_end()

    def sees_the_tests(self, *_):
        expect(self.lights()).to_have_count(self.count())
        expect(self.page.locator("#expectations .failed")).not_to_have_count(0)

    def sees_trails(self, *_):
        """Steps, as a run that is over at once may have no picture of the way."""
        page, trails = self.page, self.page.get_by_label(self.text("trails"), exact=True)
        page.click("#start")
        expect(page.locator("#clock")).to_have_text(self.clock(0))
        trails.check()
        for tick in range(1, 9):
            page.click("#step")
            expect(page.locator("#clock")).to_have_text(self.clock(tick / 10))
        self.is_painted()
        shown = page.locator("#canvas").screenshot()
        trails.uncheck()
        self.is_painted()
        assert page.locator("#canvas").screenshot() != shown

    def is_painted(self):
        self.page.evaluate("() => new Promise((shown) => requestAnimationFrame(() => requestAnimationFrame(shown)))")

    def answers(self, *_):
        """First a wrong answer, then the right one."""
        page = self.page
        write(page, wrong_script(self.lesson), "# Robots:")
        # The lights of the run before are not those of the new text.
        self.lights()
        expect(page.locator("#older")).to_have_text(self.text("older")["edited"])
        page.click("#tab-script")
        page.click("#run")
        self.has_started()
        self.is_at_the_end()
        expect(self.lights()).to_have_count(self.count())
        expect(page.locator("#expectations .failed")).not_to_have_count(0)
        expect(page.locator("#older")).to_be_hidden()
        write(page, solution(self.lesson), "# Robots:")
        page.keyboard.press("Control+Enter")
        self.has_started()
        self.is_at_the_end()
        expect(self.lights()).to_have_count(self.count())
        expect(page.locator("#expectations .held")).to_have_count(self.count())
        expect(page.locator("#older")).to_be_hidden()

    def hands_in(self, *_):
        page = self.page
        expect(self.lights()).to_have_count(self.count())
        expect(page.locator("#expectations .held")).to_have_count(self.count())
        page.get_by_label(self.text("by")).fill("Ada")
        path = saved(page, page.get_by_role("button", name=self.text("handIn"), exact=True).click, seconds=120)
        self.handed_in = json.loads(path.read_text())
        names = re.escape(self.text("handedIn", {"name": "NAME", "held": self.count(), "count": self.count(), "success": True}))
        expect(page.locator("#assignment [role=status]")).to_have_text(re.compile(names.replace("NAME", r"[\w-]+\.json")))

    def drags_the_lamp(self, *_):
        page = self.page
        page.locator("#rate").select_option("1")
        page.click("#play")
        self.is_playing()
        page.click("#tab-ground")
        lamp = page.get_by_label(self.text("lampX", 1))
        expect(lamp).to_have_value("-400")
        self.sees_robots(left=2, right=1)
        # To the other side: the robots look outwards.
        drag(page, self.scenario, (-400, 0), (395, 0))
        expect(lamp).to_have_value(re.compile(r"^39\d(\.\d+)?$"))
        self.sees_robots(left=1, right=2)

    def sees_robots(self, left, right):
        """Waits for the colors of the robots on both sides, in a drawing of the world."""
        for _ in range(40):
            lit = leds(self.page, self.text("drawing"))
            if [lit[robot] for robot in sorted(lit)] == [left] * 6 + [right] * 6:
                return
            # The next drawing is that of a later tick.
            before = self.page.locator("#clock").inner_text()
            expect(self.page.locator("#clock")).not_to_have_text(before)
        raise AssertionError(lit)

    def sees_messages(self, *_):
        self.page.get_by_label(self.text("messages"), exact=True).check()

    def plays_to_see_them(self, *_):
        """Robots stand, and their colors change each five seconds: what else changes are the lines."""
        page = self.page
        page.click("#start")
        expect(page.locator("#clock")).to_have_text(self.clock(0))
        page.locator("#time").fill("10")
        expect(page.locator("#clock")).to_have_text(self.clock(1))
        before = page.locator("#canvas").screenshot()
        for tick in range(11, 31):
            page.click("#step")
            expect(page.locator("#clock")).to_have_text(self.clock(tick / 10))
            if page.locator("#canvas").screenshot() != before:
                break
        assert page.locator("#canvas").screenshot() != before
        page.click("#play")
        self.is_at_the_end()

    def clicks_on_a_robot(self, *_):
        click(self.page, self.scenario, (0, 0))
        expect(self.page.locator("#robot h2")).to_contain_text("Robot")
        expect(self.page.locator("#robot section", has_text=self.text("neighbors"))).to_contain_text(re.compile(r"\d mm"))

    def fails_robots(self, *_):
        page = self.page
        page.locator("#rate").select_option("1")
        page.click("#play")
        self.is_playing()
        click(page, self.scenario, (-150, 30))
        expect(page.locator("#robot h2")).to_contain_text("Robot")
        page.get_by_role("button", name=self.text("fail"), exact=True).click()
        expect(page.locator("#robot .state")).to_have_text(self.text("states")[2])


ACTIONS = [
    (r"Press \*Play\*: [^*]+", Learner.plays),
    (r"\*Tests\* shows the expectations, and which of them fail\.", Learner.sees_the_tests),
    (r"\*Trails\* shows its path\.", Learner.sees_trails),
    (r"Write your answer in \*Script\*, and press \*Run\* or Ctrl \+ Enter: the run starts from the beginning with your text\.", Learner.answers),
    (r"When all lights in \*Tests\* are green at the end of the run, press \*Hand in\*\.", Learner.hands_in),
    (r"Press \*Play\*, which starts again at the end of a run, and drag the lamp with the mouse: the colors follow it\.", Learner.drags_the_lamp),
    (r"\*Messages\* draws a line for each message that arrives, and a different line for each message that gets lost\.", Learner.sees_messages),
    (r"Press \*Play\*, which starts again at the end of a run, to see them\.", Learner.plays_to_see_them),
    (r"Click on a robot: the page shows its neighbors and their distances\.", Learner.clicks_on_a_robot),
    (r"Press \*Play\*, which starts again at the end of a run, click on other robots, and press \*Fail\*\.", Learner.fails_robots),
    *((words, getattr(Learner, act)) for words, act in FRENCH_STEPS),
]


def action(sentence):
    """What a sentence asks for in the page; None if it asks for nothing there."""
    known = [do for words, do in ACTIONS if re.fullmatch(words, sentence)]
    if known:
        return known[0]
    # Code is no part of the page.
    assert not OF_THE_PAGE.search(re.sub("`[^`]*`", "", sentence)), f"no action is known for these words: {sentence}"
    return None


def place(page, scenario, x, y):
    """The place on the screen of a place in the world, in mm: the view shows all of it."""
    box = page.locator("#canvas").bounding_box()
    width, height = scenario["world"]["size"]
    scale = min(box["width"] / width, box["height"] / height) * 0.94
    return box["x"] + box["width"] / 2 + x * scale, box["y"] + box["height"] / 2 - y * scale


def click(page, scenario, at):
    page.mouse.click(*place(page, scenario, *at))


def drag(page, scenario, start, end):
    page.mouse.move(*place(page, scenario, *start))
    page.mouse.down()
    page.mouse.move(*place(page, scenario, *end), steps=4)
    page.mouse.up()


# The colors of a drawing, as sums of 1 red, 2 green and 4 blue.
LIT = {f"rgb({','.join('242' if color >> part & 1 else '26' for part in range(3))})": color for color in range(1, 8)}


def leds(page, drawing="Drawing"):
    """The colors of the LEDs by the ids of the robots, from a drawing of the world."""
    path = saved(page, page.get_by_role("button", name=drawing).click)
    name = "{http://www.w3.org/2000/svg}"
    bodies = xml.etree.ElementTree.parse(path).getroot().iter(f"{name}g")
    titled = [body for body in bodies if body.find(f"{name}title") is not None]
    return {int(body.find(f"{name}title").text): max(LIT.get(disc.get("fill"), 0) for disc in body.iter(f"{name}circle")) for body in titled}


@pytest.fixture
def opened(browser, tmp_path):
    """Opens scenarios in pages of `bbz sim --view`."""
    # No text of another test is offered, and none of the user's.
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state")}
    processes, pages, problems = [], [], []

    def open_page(scenario, folder="."):
        process = subprocess.Popen(bbz("sim", scenario, "--view", "--no-browser"), cwd=folder, stdout=subprocess.PIPE, text=True, env=environment)
        processes.append(process)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.on("dialog", lambda dialog: dialog.accept())
        note_problems(page, problems)
        page.goto(address(process))
        expect(page.locator("#clock")).to_contain_text("0.0 s ")
        pages.append(page)
        return page

    yield open_page
    for page in pages:
        page.goto("about:blank")
        page.close()
    for process in processes:
        process.kill()
        process.wait(timeout=60)
    assert problems == [], "\n".join(problems)


@pytest.mark.parametrize("lesson", LESSONS, ids=name_of)
def test_the_steps_of_a_lesson_lead_to_green_lights(opened, lesson):
    text = lesson.read_text()
    command = re.search(r"^bbz sim (\S+) --view$", text, re.MULTILINE)[1]
    assert command == f"examples/lessons/{name_of(lesson)}.toml"
    found = [action(sentence) for sentence in steps(text)]
    assert Learner.answers in found and Learner.hands_in in found
    page = opened(command)
    learner = Learner(page, name_of(lesson))
    page.locator("#rate").select_option(learner.text("asFast"))
    for do in filter(None, found):
        do(learner)
    assert learner.handed_in["success"] is True
    assert [one["text"] for one in learner.handed_in["scripts"]] == [solution(learner.lesson)]


CODE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def linked(path):
    """The files to which a page leads, but for the same page in another language."""
    targets = [(path.parent / target.split("#")[0]).resolve() for target in re.findall(r"\]\((.*?)\)", path.read_text())]
    # A lesson in French leads to other lessons in French.
    names = {str(target).replace("/lessons/fr/", "/lessons/") for target in targets}
    return names - {str(path.resolve()).replace("/lessons/fr/", "/lessons/")}


@pytest.mark.parametrize("lesson", LESSONS, ids=name_of)
def test_a_lesson_in_french_is_that_in_english(lesson):
    french = lesson.parent / "fr" / lesson.name
    texts = [path.read_text() for path in (lesson, french)]
    assert f"\n[Français](fr/{lesson.name})\n" in texts[0] and f"\n[English](../{lesson.name})\n" in texts[1]
    found = [[action(sentence) for sentence in steps(text)] for text in texts]
    assert [do for do in found[1] if do] == [do for do in found[0] if do]
    assert CODE.findall(texts[1]) == CODE.findall(texts[0])
    assert linked(french) == linked(lesson)
    # A line is a sentence, a heading, or a row of a table. Sentences name the same words of a script.
    prose = [CODE.sub("", text) for text in texts]
    forms = [[re.match(r"(#+ |\d+\. |\* | +|\||)", line)[0] if line else None for line in text.split("\n")] for text in prose]
    assert forms[1] == forms[0]
    words = [sorted(re.findall(r"`[^`\n]+`", text)) for text in prose]
    assert words[1] == words[0]


def test_the_list_of_lessons_in_french_is_that_in_english():
    pages = [pathlib.Path("docs/lessons") / name for name in ("README.md", "fr/README.md")]
    assert linked(pages[1]) == linked(pages[0])
    titles = [re.findall(r"^\| \[(.*?)\]", page.read_text(), re.MULTILINE) for page in pages]
    assert titles[0] == [lesson.read_text().split("\n")[0].removeprefix("# ") for lesson in LESSONS]
    assert titles[1] == [lesson.read_text().split("\n")[0].removeprefix("# ") for lesson in FRENCH_LESSONS]


@pytest.mark.parametrize("page", [*FRENCH_LESSONS, pathlib.Path("docs/lessons/fr/README.md")], ids=lambda page: page.stem)
def test_no_line_ends_before_a_colon_in_french(page):
    """A space before these signs, and within quotation marks, breaks no line."""
    assert re.findall(r".* [:;!?»].*|.*« .*", CODE.sub("", page.read_text())) == []


def test_an_unknown_wording_is_an_error():
    for sentence in ["Press *Start*.", "Click the robot.", "*Script* has an editor.", "Open the tab.", "Pressez *Départ*.", "Ouvrez un onglet."]:
        with pytest.raises(AssertionError, match="no action is known"):
            action(sentence)
    assert action("Use the value that `goto` returns: if it is 1, the next corner becomes the goal.") is None
    # Sentences of one step, and of one line.
    text = "## The assignment\n1. Press *Play*: one.\n   Two? Three\n   four.\n\nNone.\n\n2. *Five* is six. 7 is.\n\n## If\n1. No.\n"
    assert steps(text) == ["Press *Play*: one.", "Two?", "Three", "four.", "*Five* is six. 7 is."]


def test_names_in_italics_are_those_of_the_page(opened):
    page = opened("examples/lessons/rhythm.toml")
    page.locator("#canvas").press("n")
    expect(page.locator("#robot h2")).to_contain_text("Robot")
    shown = page.locator("button, [role=tab], label span, #trials h3, #options span").all_text_contents()
    for text in [*LESSONS, pathlib.Path("docs/start.md"), pathlib.Path("docs/lessons/README.md")]:
        names = re.findall(r"(?<![*\w])\*([A-Z][^*\n]*)\*(?!\*)", text.read_text())
        assert set(names) <= set(shown), text


def tutorial(folder):
    """Writes the files of the tutorial, with the change that it makes."""
    text = pathlib.Path("docs/start.md").read_text()
    for name, content in re.findall(r"New file `(.*?)`:\n\n```\w+\n(.*?)```", text, re.DOTALL):
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(content)
    name, old, new = re.search(r"In `(.*?)`:\n\n```diff\n-(.*?)\n\+(.*?)\n```", text).groups()
    path = folder / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return text


def test_the_first_touch_of_the_tutorial_shows_a_change(opened, tmp_path):
    text = tutorial(tmp_path)
    touch = "press *Play*, click on a robot, and drag it away from the others: its color changes, and so do those of its old neighbors."
    assert f"Now open the swarm in a browser page: {touch}\n" in text
    command = re.search(r"^bbz sim (\S+) --view$", text, re.MULTILINE)[1]
    page = opened(command, tmp_path)
    scenario = tomllib.loads((tmp_path / command).read_text())
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Pause")
    # Colors before the touch, once the robots have received messages.
    expect(page.locator("#clock")).to_contain_text(re.compile(r"^[1-9]\."))
    before = leds(page)
    assert 0 not in before.values()
    # The robot with the most neighbors, which are the others that are near.
    chosen = max(before, key=before.get)
    for _ in range(chosen + 1):
        page.locator("#canvas").press("n")
    expect(page.locator("#robot h2")).to_have_text(f"Robot {chosen}")
    at = re.match(r"\((.*?), (.*?)\)", page.locator("#robot .facts dd", has_text="mm,").inner_text()).groups()
    corner = (-320, 195) if float(at[0]) > 0 else (320, 195)
    click(page, scenario, tuple(map(float, at)))
    drag(page, scenario, tuple(map(float, at)), corner)
    # The mouse moves by pixels, which are larger than a millimeter.
    sign = "-" if corner[0] < 0 else ""
    expect(page.locator("#robot .facts")).to_contain_text(re.compile(rf"\({sign}(31[7-9]|32[0-3])\."))
    # A neighbor that is silent is forgotten after three seconds. Chromium refuses the eleventh download of a page, so the test looks
    # once per second.
    for _ in range(8):
        second = page.locator("#clock").inner_text().split(".")[0]
        expect(page.locator("#clock")).not_to_contain_text(re.compile(rf"^{second}\."))
        after = leds(page)
        changed = [robot for robot in before if after[robot] != before[robot]]
        if chosen in changed and len(changed) >= 3:
            break
    assert chosen in changed and len(changed) >= 3, (before, after)
    # The same page loads another text while the run goes on.
    load = "Change `% 8` to `% 4` and press *Load now*: the robots stay at their positions and run the new text."
    assert f"In the page, *Script* opens an editor.\n{load}\n" in text
    script = (tmp_path / "first/hello.bzz").read_text()
    assert "% 8" in script
    write(page, script.replace("% 8", "% 4"))
    page.click("#load")
    expect(page.locator("#script-status")).to_have_text("The robots run hello.1.bzz.")
    expect(page.locator("#clock")).not_to_contain_text(re.compile(r"^0\."))
    page.click("#tab-robot")
    expect(page.locator("#robot .facts")).to_contain_text(re.compile(rf"\({sign}(31[7-9]|32[0-3])\."))
