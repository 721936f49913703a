"""Small worlds for the tests."""

from __future__ import annotations

import pathlib

import bittybuzz

COUNTS = """\
n = 0
half = 0.5
word = "low"
whole = 0
store = stigmergy.create(1)
function init() { if(id == 0) { store.put("best", 7) store.put(3, 2.5) } }
function step() { n = n + 1 whole = isint(half) if(n == 3) log("three ", id) led(id % 8) }
"""

WORLD = """\
[world]
size = [600, 600]
duration = 20

[[robots]]
robot = "zooids"
script = "counts.bzz"
count = 3
placement = "line"
spacing = 60

[[robots]]
robot = "zooids"
name = "late"
script = "counts.bzz"
placement = "list"
positions = [[200, 200]]
present = false
"""


def folder(path: pathlib.Path, script: str = COUNTS) -> pathlib.Path:
    """Writes the script of the world to a folder."""
    (path / "counts.bzz").write_text(script)
    return path


def scenario(path: pathlib.Path, text: str = WORLD) -> bittybuzz.Scenario:
    """Returns the world with its script in a folder."""
    return bittybuzz.Scenario.parse(text, folder(path))


def simulation(path: pathlib.Path, text: str = WORLD) -> bittybuzz.Simulation:
    """Returns a run of the world."""
    return scenario(path, text).start()
