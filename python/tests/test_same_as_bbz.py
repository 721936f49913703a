"""Runs of the module are those of the command line."""

from __future__ import annotations

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
