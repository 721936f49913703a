"""Questions to the chosen robot, and their answers."""

import re

from playwright.sync_api import expect
from test_page import at, digest, go, page, place, robot, save, session, simulated, window

__all__ = ["page", "session", "window"]


def field(page):
    return page.locator(".ask input")


def answers(page):
    return page.locator(".answers li")


def choose(page, number):
    x = {6: -30, 7: 40}[number]
    page.mouse.click(*place(page, x, 0))
    return robot(page, number)


def ask(page, question):
    field(page).fill(question)
    field(page).press("Enter")


def test_a_question_that_is_typed_meanwhile_stays(page):
    choose(page, 6)
    go(page, 10)
    page.evaluate("""() => {
        const field = document.querySelector(".ask input");
        field.value = "n";
        field.form.requestSubmit();
        field.value = "n + 1";
    }""")
    expect(answers(page)).to_have_count(1)
    expect(field(page)).to_have_value("n + 1")


def test_a_paused_robot_answers_at_once(page):
    choose(page, 6)
    go(page, 10)
    before = digest(page, 10)
    page.click("#tab-robot")
    expect(field(page)).to_have_attribute("aria-label", "Expression or call to ask the robot")
    ask(page, "n * 2 + t.deep.b")
    expect(answers(page)).to_have_text(["1.0n * 2 + t.deep.b = 20"])
    expect(field(page)).to_have_value("")
    at(page, 10)
    ask(page, "neighbors.count()")
    expect(answers(page)).to_have_text(["1.0neighbors.count() = 1", "1.0n * 2 + t.deep.b = 20"])
    # The run gives the same answers, in the order in which they were asked.
    page.keyboard.press("Escape")
    page.click("#step")
    at(page, 11)
    expect(answers(page)).to_have_text(["1.0neighbors.count() = 1", "1.0n * 2 + t.deep.b = 20"])
    page.click("#tab-log")
    expect(page.locator("#log .answer")).to_have_text(["1.06n * 2 + t.deep.b = 20", "1.06neighbors.count() = 1"])
    # Nothing of the run changes: without the questions it has the digest of now.
    go(page, 40)
    asked = digest(page, 40)
    page.click("#tab-ground")
    expect(page.locator("#changes code")).to_have_count(2)
    for _ in range(2):
        page.locator("#changes").get_by_role("button", name="Undo", exact=True).click()
    expect(page.locator("#changes code")).to_have_count(0)
    at(page, 40)
    assert digest(page, 40) == asked
    # Neither is there an answer any more.
    page.click("#tab-robot")
    expect(answers(page)).to_have_count(0)
    go(page, 10)
    assert digest(page, 10) == before


def test_a_call_has_its_effect_and_replays(page, tmp_path):
    panel = choose(page, 6)
    go(page, 40)
    untouched = digest(page, 40)
    go(page, 10)
    page.click("#tab-robot")
    ask(page, "n = 1002 led(2)")
    expect(answers(page)).to_have_text(["1.0n = 1002 led(2) = [nil]"])
    # The step that follows the question counts on and sets the LED.
    page.click("#step")
    at(page, 11)
    expect(panel.locator(".facts")).to_contain_text("LEDYyellow")
    ask(page, "t.color = \"amber\"")
    ask(page, "t.color")
    expect(answers(page).first).to_have_text("1.1t.color = amber")
    page.click("#tab-ground")
    go(page, 60)
    changed = digest(page, 60)
    go(page, 600)
    assert simulated(save(page, tmp_path))["digest"] == digest(page, 600)
    # Back and forward again: the same answer.
    go(page, 10)
    page.click("#tab-robot")
    expect(answers(page)).to_have_text(["1.0n = 1002 led(2) = [nil]"])
    page.click("#step")
    page.click("#step")
    at(page, 12)
    expect(answers(page)).to_have_text(["1.1t.color = amber", '1.1t.color = "amber": done', "1.0n = 1002 led(2) = [nil]"])
    page.click("#tab-ground")
    go(page, 60)
    assert digest(page, 60) == changed
    # Without the questions, the run is the one that had none.
    for count in [2, 1, 0]:
        page.locator("#changes").get_by_role("button", name="Undo", exact=True).click()
        expect(page.locator("#changes code")).to_have_count(count)
    go(page, 40)
    assert digest(page, 40) == untouched


def test_mistakes_stand_at_the_field(page):
    choose(page, 7)
    page.click("#tab-robot")
    ask(page, "n + ledd(3)")
    refusal = page.locator(".ask .refusal")
    expect(refusal).to_have_text("column 5: there is no function `ledd`; did you mean `led`?")
    expect(refusal).to_have_attribute("role", "alert")
    expect(field(page)).to_have_value("n + ledd(3)")
    expect(page.locator("#status")).to_have_text("")
    expect(answers(page)).to_have_count(0)
    ask(page, "(n")
    expect(refusal).to_have_text("column 3: `(` is never closed")
    ask(page, "x" * 3000)
    expect(refusal).to_contain_text("nothing ever assigns")
    # What was asked comes back.
    ask(page, "n")
    expect(refusal).to_be_hidden()
    expect(answers(page)).to_have_text(["0.0n = 0"])
    for key, shown in [("ArrowUp", "n"), ("ArrowUp", "x" * 2000), ("ArrowUp", "(n"), ("ArrowDown", "x" * 2000), ("ArrowDown", "n"), ("ArrowDown", "")]:
        field(page).press(key)
        expect(field(page)).to_have_value(shown)
    # Nothing is asked.
    field(page).press("Enter")
    expect(answers(page)).to_have_count(1)


def test_errors_and_loops_end_the_question_alone(page):
    panel = choose(page, 6)
    go(page, 5)
    page.click("#tab-robot")
    ask(page, "1 / (n - n)")
    expect(answers(page)).to_have_text(["0.51 / (n - n): ended by an error: integer division by zero"])
    expect(answers(page).first).to_have_class("missing")
    ask(page, "while(1) { led(1) }")
    expect(answers(page).first).to_contain_text("ended, because it takes more than")
    page.click("#step")
    at(page, 6)
    expect(panel).to_contain_text("integer division by zero")
    expect(panel).to_contain_text("<question>:1, in the question")
    expect(panel.locator(".facts")).to_contain_text("running")
    ask(page, "n")
    expect(answers(page).first).to_have_text("0.6n = 5")


def test_answers_are_those_of_the_chosen_robot(page):
    choose(page, 6)
    page.click("#tab-robot")
    ask(page, "id")
    expect(answers(page)).to_have_text(["0.0id = 6"])
    choose(page, 7)
    expect(answers(page)).to_have_count(0)
    ask(page, "id")
    expect(answers(page)).to_have_text(["0.0id = 7"])
    # While the run plays, the answer comes with its tick.
    page.click("#play")
    ask(page, "id + 1")
    expect(answers(page).first).to_have_text(re.compile(r"^\d+\.\did \+ 1 = 8$"))
    page.click("#play")
    choose(page, 6)
    expect(answers(page)).to_have_text(["0.0id = 6"])
