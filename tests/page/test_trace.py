"""A robot that reports, in the page of `bbz trace --view`."""

import subprocess

import pytest
from conftest import note_problems
from playwright.sync_api import expect
from test_page import address, bbz

pytestmark = pytest.mark.sample


def test_lines_of_a_robot_are_shown(browser, tmp_path):
    (tmp_path / "s.bzz").write_text("function step() { }\n")
    command = bbz("trace", "-", "--robot", "crazyflie", "--script", "s.bzz", "--view", "--no-browser")
    process = subprocess.Popen(command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    problems = []
    note_problems(page, problems)
    page.goto(address(process))
    process.stdin.write("0.250000 INFO  motors are armed\n12.500000 WARN  battery is low\n")
    process.stdin.flush()
    lines = page.locator("#log p")
    expect(lines).to_have_count(2)
    expect(lines.last).to_contain_text("WARN: battery is low")
    expect(page.locator("#clock")).to_have_text("12.5 s")
    # A page that connects later shows the same, and controls nothing.
    page.reload()
    expect(lines).to_have_count(2)
    for part in ["controls", "save", "display", "time", "tab-script", "tab-tests", "tab-ground"]:
        expect(page.locator(f"#{part}")).to_be_hidden()
    lines.last.get_by_role("button").click()
    expect(page.locator("#robot h2")).to_have_text("Robot 0")
    expect(page.locator("#robot .facts")).to_contain_text("s.bzz")
    process.stdin.close()
    expect(page.locator("#status")).to_have_text("The trace has ended.")
    page.close()
    assert process.wait(timeout=60) == 0, "it ends with its page"
    assert problems == []
