"""Measures, which the page lists below the expectations."""

import json
import subprocess

import pytest
from playwright.sync_api import expect
from test_page import SCENARIO, SCRIPT, SECONDS_MAX, bbz, end, go, page, show, window

pytestmark = pytest.mark.sample

__all__ = ["page", "window"]

MEASURES = """
[[measure]]
name = "ten"
value = "max(global.n)"
above = 9

[[measure]]
name = "thousand"
value = "max(global.n)"
above = 1000

[[measure]]
name = "small"
value = "swarm.nearest"
at = 1

[[measure]]
name = "sum_n"
value = "sum(global.n)"
"""


@pytest.fixture
def session(tmp_path):
    (tmp_path / "s.bzz").write_text(SCRIPT)
    (tmp_path / "s.toml").write_text(SCENARIO + MEASURES)
    process = show(tmp_path)
    yield process
    end(process)


def test_measures_are_shown_as_on_the_command_line(page, session):
    page.click("#tab-tests")
    shown = page.locator("#measures p")
    expect(shown.locator("b")).to_have_text(["open"] * 4)
    expect(shown.locator("span").first).to_have_text("ten: first time of max(global.n) above 9")
    go(page, 300)
    line = subprocess.run(bbz("sim", "s.toml", "--json"), cwd=session.folder, capture_output=True, check=False, timeout=SECONDS_MAX)
    values = json.loads(line.stdout)["measures"]
    expect(shown.locator("b")).to_have_text([f"{values['ten']:.1f} s", "open", f"{values['small']:.4g}", "open"])
    go(page, 600)
    expect(shown.locator("b")).to_have_text([f"{values['ten']:.1f} s", "not reached", f"{values['small']:.4g}", f"{values['sum_n']:g}"])
    # A way back forgets those of later.
    go(page, 5)
    expect(shown.locator("b")).to_have_text(["open"] * 4)
