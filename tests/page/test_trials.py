"""Trials next to the run, assignments, and the text of the scenario in the editor."""

import csv
import json
import re
import subprocess

import pytest
from playwright.sync_api import expect
from test_editor import write
from test_page import SCENARIO, SCRIPT, SECONDS_MAX, at, bbz, page, session, window

__all__ = ["page", "session", "window"]

# The world of the other tests as an assignment.
TASK = SCENARIO.replace("60", "50") + """
[assignment]
title = "Heard"
text = \"\"\"
Let `n` be 19.

And two.
\"\"\"
"""


def fill(page, vary, values, seeds, measure):
    page.click("#tab-tests")
    page.fill("[name=vary]", vary)
    page.fill("[name=values]", values)
    page.fill("[name=seeds]", seeds)
    page.locator("[name=measure]").select_option(label=measure)
    page.locator(".trials").get_by_role("button", name="Start").click()


def rows(page):
    return [row.split("\t") for row in page.locator("#trials tbody tr").all_inner_texts()]


def test_values_are_compared(page, session, tmp_path):
    fill(page, "medium.ir.loss", "0.2, 0.9", "3", "global.n")
    expect(page.locator("#trials tbody tr")).to_have_count(2)
    expect(page.locator("#trials tbody tr").last).to_contain_text("0.93", use_inner_text=False)
    expect(page.locator(".sweep circle")).to_have_count(2)
    with page.expect_download() as download:
        page.get_by_role("button", name="Save as table").click()
    table = list(csv.DictReader(download.value.path().read_text().splitlines()))
    # The same as on the command line.
    arguments = ["sim", "s.toml", "--runs", "3", "--set", "medium.ir.loss=0.2,0.9", "--csv", "runs.csv"]
    subprocess.run(bbz(*arguments), cwd=session.folder, capture_output=True, check=False, timeout=SECONDS_MAX)
    simulated = list(csv.DictReader((session.folder / "runs.csv").read_text().splitlines()))
    assert [float(row["number"]) for row in table] == pytest.approx([float(row["mean global.n"]) for row in simulated])
    assert [row["medium.ir.loss"] for row in table] == ["0.2", "0.2", "0.2", "0.9", "0.9", "0.9"]
    at(page, 0)


def test_an_invalid_sweep_is_reported(page, session):
    fill(page, "medium.ir.los", "0", "1", "led")
    expect(page.locator("#status")).to_contain_text("did you mean `loss`?")
    fill(page, "", "", "1000", "led")
    page.locator(".trials").get_by_role("button", name="Stop").click()
    expect(page.locator("#trials progress")).to_be_hidden()


def test_the_scenario_is_edited(page, session):
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    for part in ["#keep", "#run-on", "#load"]:
        expect(page.locator(part)).to_be_hidden()
    write(page, SCENARIO.replace("count = 2", "cuont = 2"), "[world]")
    expect(page.locator("#diagnostics li").first).to_contain_text("line 10")
    expect(page.locator("#diagnostics li").first).to_contain_text("did you mean `count`?")
    write(page, TASK, "[world]")
    expect(page.locator("#diagnostics li")).to_have_count(0)
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    expect(page.locator("#clock")).to_contain_text("s of 50.0 s")
    expect(page.locator("#script-name")).to_have_value("s.toml")
    # The file has not changed.
    assert (session.folder / "s.toml").read_text() == SCENARIO
    page.click("#tab-tests")
    expect(page.locator("#assignment h2")).to_have_text("Heard")
    expect(page.locator("#assignment > p")).to_have_text(["Let n be 19.", "And two.", ""])


def test_a_hand_in_is_graded(page, session, tmp_path):
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    write(page, TASK, "[world]")
    page.locator("#script-name").select_option("s.bzz")
    write(page, SCRIPT.replace("n + 1", "n + 2"))
    page.click("#run")
    # The run of an assignment stops at an error, and the page leads to it.
    expect(page.locator("#status")).to_have_text("Robot 7 stopped by an error.")
    expect(page.locator("#clock")).to_contain_text("s of 50.0 s")
    page.click("#tab-tests")
    page.get_by_label("Your name").fill("Ada")
    with page.expect_download() as download:
        page.get_by_role("button", name="Hand in").click()
    assert download.value.suggested_filename == "heard-ada.json"
    verdict = "1 of 2 held: the assignment is not solved yet. heard-ada.json is saved all the same."
    expect(page.locator("#assignment [role=status]")).to_have_text(verdict)
    folder = tmp_path / "class"
    folder.mkdir()
    download.value.save_as(folder / "heard-ada.json")
    (folder / "s.toml").write_text(TASK)
    (folder / "s.bzz").write_text(SCRIPT)
    graded = subprocess.run(bbz("grade", folder, "--json"), capture_output=True, text=True, check=False, timeout=SECONDS_MAX)
    result = json.loads(graded.stdout)["results"][0]
    assert (result["by"], result["as_handed_in"]) == ("Ada", True), graded.stderr
    assert [one["held"] for one in result["expectations"]] == [False, True]
    # The page grades the same file, next to one that is none.
    (folder / "none.json").write_text("{}")
    page.locator("#grading input").set_input_files([folder / "heard-ada.json", folder / "none.json"])
    cells = page.locator("#grading tbody td")
    error = "it is no result of an assignment: missing field `bittybuzz` at line 1 column 2"
    reason = "it was handed in with another scenario"
    expect(cells).to_have_text(["Adaheard-ada.json", re.compile(" of "), reason, "none.json", "does not run", error])
    with page.expect_download() as download:
        page.locator("#grading").get_by_role("button", name="Save as table").click()
    assert download.value.suggested_filename == "marks.csv"
    assert download.value.path().read_text().startswith("file,by,runs,success,held,expectations,")
