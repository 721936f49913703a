"""The report of a sweep: its pictures, and links that open runs in the page."""

import csv
import io
import signal
import subprocess

import pytest
from conftest import note_problems
from playwright.sync_api import expect
from test_page import address, bbz

pytestmark = pytest.mark.sample

SCENARIO = """[world]
size = [500, 500]
duration = 10

[[robots]]
name = "walkers"
robot = "kilobot"
script = "s.bzz"
count = 2

[[measure]]
name = "total"
value = "sum(global.n)"

[sweep]
seeds = 3
chance = "independent"

[[sweep.parameter]]
key = "robots.walkers.count"
name = "crowd"
values = [2, 3, 4]

[[sweep.parameter]]
key = "medium.ir.loss"
name = "loss"
values = [0.0, 0.5]
"""
SCRIPT = "n = 0\nfunction step() { n = n + math.rng.uniform(10) }\n"


@pytest.fixture
def study(tmp_path):
    """The folder of a sweep that is finished."""
    (tmp_path / "s.toml").write_text(SCENARIO)
    (tmp_path / "s.bzz").write_text(SCRIPT)
    for command in ["plan", "s.toml"], ["run", "s.sweep", "--headless"]:
        subprocess.run(bbz("sweep", *command), cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)
    return tmp_path


def expect_run(page, row):
    """Checks the seed and the text of the run of a row."""
    page.click("#tab-ground")
    expect(page.get_by_label("Seed", exact=True)).to_have_value(row["seed"])
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    expect(page.locator("#text .cm-content")).to_contain_text(f"count = {row['crowd']}")
    expect(page.locator("#text .cm-content")).to_contain_text(f"loss = {row['loss']}")


def test_a_report_opens_its_runs(browser, study):
    table = subprocess.run(bbz("sweep", "merge", "s.sweep"), cwd=study, check=True, capture_output=True, text=True).stdout
    rows = list(csv.DictReader(io.StringIO(table)))
    process = subprocess.Popen(bbz("sweep", "report", "s.sweep", "--view", "--no-browser"), cwd=study, stdout=subprocess.PIPE, text=True)
    page = browser.new_page(viewport={"width": 1000, "height": 800})
    problems = []
    note_problems(page, problems)
    url = address(process)
    page.goto(url)
    expect(page.get_by_role("heading", level=1)).to_have_text("Runs of s.toml")
    # Curves of both parameters and their map.
    expect(page.locator("svg")).to_have_count(3)
    highest = page.locator("tr", has_text="Highest").first
    best = max(range(len(rows)), key=lambda run: float(rows[run]["total"]))
    expect(highest).to_contain_text(rows[best]["seed"])
    with page.expect_popup() as opened:
        highest.get_by_role("link").click()
    run = opened.value
    note_problems(run, problems)
    # The run has the values and the seed of its row.
    expect_run(run, rows[best])
    # Another run, while the first is open.
    with page.expect_popup() as opened:
        page.locator("tr", has_text="Lowest").first.get_by_role("link").click()
    worst = min(range(len(rows)), key=lambda run: float(rows[run]["total"]))
    expect_run(opened.value, rows[worst])
    # The address alone opens nothing: neither another secret nor a run that the plan does not have.
    assert page.request.get(url[:-3] + "00/").status == 404
    missing = page.request.get(f"{url}run/18")
    assert (missing.status, missing.text()) == (409, "there is no run 18: the plan has runs 0 to 17")
    page.context.close()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 0
    assert problems == []


def test_a_run_is_shown_by_its_number(browser, study):
    process = subprocess.Popen(bbz("sweep", "view", "s.sweep", "17", "--no-browser"), cwd=study, stdout=subprocess.PIPE, text=True)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(address(process))
    # The last point, and its last seed.
    table = subprocess.run(bbz("sweep", "merge", "s.sweep"), cwd=study, check=True, capture_output=True, text=True).stdout
    expect_run(page, list(csv.DictReader(io.StringIO(table)))[17])
    page.close()
    assert process.wait(timeout=60) == 0, "it ends with its page"
    refused = subprocess.run(bbz("sweep", "view", "s.sweep", "18"), cwd=study, capture_output=True, text=True)
    assert refused.returncode == 3 and "there is no run 18" in refused.stderr
