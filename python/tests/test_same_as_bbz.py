"""Runs of the module are those of the command line."""

from __future__ import annotations

import csv
import os
import pathlib
import subprocess
from collections.abc import Callable
from typing import Any

import bittybuzz
import pytest

SCENARIOS = [
    "flight/hover.toml",
    "ground/line.toml",
    "kilobot/distance.toml",
    "kilobot/stigmergy.toml",
    "lessons/hops.toml",
    "patrol.toml",
    "random_walk.toml",
    "swarm/consensus.toml",
    "swarm/gradient.toml",
    "zooids/consensus.toml",
]


def whole(simulation: bittybuzz.Simulation) -> str:
    """Simulates to the end, in pieces of different lengths."""
    while simulation.step(7) or simulation.step(1000):
        pass
    return simulation.digest()


@pytest.mark.parametrize("name", SCENARIOS)
def test_digests_are_equal(name: str, root: pathlib.Path, simulated: Callable[..., dict[str, Any]]) -> None:
    expected = simulated(f"examples/{name}")
    simulation = bittybuzz.Scenario.load(root / "examples" / name).start()
    assert whole(simulation) == expected["digest"]
    assert simulation.time == expected["seconds"] and simulation.seed == expected["seed"]
    held = [one.verdict == "held" for one in simulation.expectations()]
    assert held == [one["held"] for one in expected["expects"]]
    since = [(one.text, one.line, one.first, one.since) for one in simulation.expectations()]
    assert since == [(one["text"], one["line"], one["first"], one["since"]) for one in expected["expects"]]


def test_values_seeds_and_threads_are_those_of_the_command_line(
    root: pathlib.Path, simulated: Callable[..., dict[str, Any]]
) -> None:
    path = "examples/swarm/gradient.toml"
    set = {"medium.ir.loss": [0.1, 0.3], "world.duration": 125, "robots.0.heading": "random", "world.size": (400, 900)}
    expected = simulated(
        path, "--seed", "9", "--set", "medium.ir.loss=[0.1, 0.3]", "--set", "world.duration=125",
        "--set", 'robots.0.heading="random"', "--set", "world.size=[400, 900]",
    )  # fmt: skip
    scenario = bittybuzz.Scenario.load(root / path, set=set)
    digests = {whole(scenario.start(seed=9, threads=threads)) for threads in (0, 1, 3)}
    assert digests == {expected["digest"]}
    assert whole(scenario.start(seed=10)) != expected["digest"]


def test_a_recording_is_the_same_byte_for_byte(root: pathlib.Path, tmp_path: pathlib.Path) -> None:
    path = root / "examples/patrol.toml"
    command = [os.environ["BBZ"], "sim", str(path), "--headless", "--json", "--record", str(tmp_path / "a.bbr")]
    subprocess.run(command, check=True, capture_output=True)
    simulation = bittybuzz.Scenario.load(path).start()
    with simulation.record(tmp_path / "b.bbr"):
        whole(simulation)
        assert not (tmp_path / "b.bbr").exists()
    assert (tmp_path / "b.bbr").read_bytes() == (tmp_path / "a.bbr").read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.bbr", "b.bbr"]


@pytest.mark.parametrize("robot", [None, "kilobot"])
@pytest.mark.parametrize("name", ["blink", "breathing", "counter", "traffic_light", "swarm/gradient"])
def test_a_script_on_this_computer_prints_the_same(
    name: str, robot: str | None, root: pathlib.Path, bbz: Callable[..., str]
) -> None:
    path = root / "examples" / f"{name}.bzz"
    named = ["--robot", robot] if robot else []
    expected = bbz("run", str(path), "--steps", "40", "--destroy", "--id", "3", "--seed", "5", *named)
    assert bittybuzz.run(path, robot=robot, steps=40, destroy=True, id=3, seed=5) == expected
    assert expected


def test_an_image_is_the_same(root: pathlib.Path, tmp_path: pathlib.Path, bbz: Callable[..., str]) -> None:
    path = root / "examples/swarm/gradient.bzz"
    bbz("build", str(path), "--robot", "kilobot", "-o", str(tmp_path / "gradient.bbi"))
    script = bittybuzz.compile(path, robot="kilobot")
    assert script.image == (tmp_path / "gradient.bbi").read_bytes()
    assert script.diagnostics == []


def test_measures_are_the_columns_of_the_table(tmp_path: pathlib.Path, bbz: Callable[..., str]) -> None:
    (tmp_path / "s.bzz").write_text("n = 0\nfunction step() { n = n + 1 }\n")
    (tmp_path / "s.toml").write_text(
        """[world]
size = [300, 300]
duration = 9
[[robots]]
robot = "kilobot"
script = "s.bzz"
count = 3
[[measure]]
name = "total"
value = "sum(global.n)"
[[measure]]
name = "half"
value = "mean(global.n)"
above = 40
[[measure]]
name = "never"
value = "mean(global.n)"
above = 1000
"""
    )
    simulation = bittybuzz.Scenario.load(tmp_path / "s.toml").start()
    simulation.step(20)
    before = simulation.measures()
    assert list(before) == ["total", "half", "never"]
    assert before["half"] is None and before["total"] == simulation.read("global.n").sum()
    whole(simulation)
    table = tmp_path / "runs.csv"
    bbz("sim", str(tmp_path / "s.toml"), "--runs", "1", "--csv", str(table))
    [row] = csv.DictReader(table.open())
    cells = {name: "" if value is None else f"{value:g}" for name, value in simulation.measures().items()}
    assert cells == {name: row[name] for name in cells}
    assert cells["half"] != "" and cells["never"] == ""
