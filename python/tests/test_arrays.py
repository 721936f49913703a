"""Arrays of a simulation, and changes of it that replay."""

from __future__ import annotations

import pathlib

import bittybuzz
import numpy as np
import pytest

import worlds


def test_arrays_have_a_row_for_each_robot(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    assert simulation.ids == [0, 1, 2, 3]
    poses = simulation.poses()
    assert poses.shape == (4, 4) and poses.dtype == np.float32
    # A line along x from the middle of the world.
    assert np.array_equal(poses[:3, :3], [[0, 0, 0], [60, 0, 0], [120, 0, 0]])
    assert np.isfinite(poses[:3]).all() and np.isnan(poses[3]).all()
    simulation.step(5)
    leds = simulation.leds()
    assert leds.dtype == np.uint8 and leds.tolist() == [0, 1, 2, 0]
    n = simulation.read("global.n")
    assert n.dtype == np.float64 and np.array_equal(n, [4, 4, 4, np.nan], equal_nan=True)
    # A string is no number.
    assert np.isnan(simulation.read("global.word")).all()
    x = simulation.read("x")
    assert np.array_equal(x, simulation.poses()[:, 0].astype(np.float64), equal_nan=True)
    assert simulation.read("swarm.spread").shape == (1,)
    assert simulation.read("share(running)").tolist() == [np.nanmean(simulation.read("running"))]
    assert np.isclose(simulation.read("quantile(0.9, x)")[0], np.nanquantile(x, 0.9))
    # An array is the caller's own.
    poses[:] = 1
    assert simulation.poses()[0, 0] != 1


def test_a_robot_that_joins_gets_values(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.command('join = "late"')
    simulation.step(3)
    assert simulation.poses()[3, :2].tolist() == [200, 200]
    assert simulation.read("global.n")[3] == 2


def test_stigmergies_are_dictionaries_and_arrays(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    assert simulation.stigmergy(3) == {}
    simulation.step(100)
    assert simulation.stigmergy(0) == simulation.stigmergy(2) == {1: {"best": 7, 3: 2.5}}
    assert simulation.read("stigmergy.1.best")[:3].tolist() == [7, 7, 7]
    assert simulation.read("stigmergy.1.3")[:3].tolist() == [2.5, 2.5, 2.5]
    with pytest.raises(KeyError, match="no robot has the id 9"):
        simulation.stigmergy(9)


def test_written_globals_are_integers_and_floats(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.step(5)
    simulation.write("global.half", np.array([1, 2, 3, 4]))
    simulation.step(1)
    assert simulation.read("global.half")[:3].tolist() == [1, 2, 3]
    assert simulation.read("global.whole")[:3].tolist() == [1, 1, 1]
    simulation.write("global.half", [1.0, np.nan, 0.125, np.nan])
    simulation.step(1)
    assert simulation.read("global.half")[:3].tolist() == [1, 2, 0.125]
    assert simulation.read("global.whole")[:3].tolist() == [0, 1, 0]
    simulation.write("global.half", np.float32(0.25))
    simulation.step(1)
    assert simulation.read("global.half")[:3].tolist() == [0.25] * 3
    simulation.write("global.n", 1000)
    simulation.step(1)
    assert simulation.read("global.n")[:3].tolist() == [1001] * 3


def test_floats_of_32_bits_are_exact(tmp_path: pathlib.Path) -> None:
    text = worlds.WORLD.replace('"zooids"', '"crazyflie"').replace("spacing = 60", "spacing = 120")
    simulation = worlds.simulation(tmp_path, text)
    values = (np.sqrt(np.arange(4)) / 7).astype(np.float32)
    simulation.write("global.half", values)
    simulation.step(2)
    assert simulation.read("global.half")[:3].tolist() == values[:3].tolist()


def test_a_write_is_one_command_that_replays(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.write("global.n", np.array([100, 200, 300, 400]))
    simulation.step(30)
    # Floats that have no short decimal form.
    simulation.write("global.half", np.sqrt(np.arange(4)).astype(np.float32) / 7)
    simulation.command("move = 1\nto = [0, 100]")
    simulation.step(20)
    assert simulation.commands.count("[[event]]") == 3
    replayed = worlds.simulation(tmp_path, f"{worlds.WORLD}\n{simulation.commands}")
    replayed.step(50)
    assert replayed.digest() == simulation.digest()
    assert replayed.read("global.half").tolist()[:3] == simulation.read("global.half").tolist()[:3]
    assert replayed.commands == ""


def test_a_refused_write_changes_nothing(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.step(2)
    digest = simulation.digest()
    for quantity, values, kind, text in [
        ("global.n", [1, 2], ValueError, r"array of shape \(4,\), not \(2,\)"),
        ("global.n", [[1, 2, 3, 4]], ValueError, r"not \(1, 4\)"),
        ("global.n", [], ValueError, r"not \(0,\)"),
        ("global.n", ["a", "b", "c", "d"], TypeError, "must be numbers, not a str"),
        ("global.n", None, TypeError, "must be numbers, not a NoneType"),
        ("global.n", 2**70, bittybuzz.ScenarioError, "`number`"),
        ("global.n", np.inf, bittybuzz.ScenarioError, "`number`"),
        ("global.n", [1, 2, 3, 2**40], bittybuzz.ScenarioError, "`numbers`"),
        ("global.m", 1, bittybuzz.ScenarioError, "no script has a global `m`\n  help: .*n"),
        ('global."\n', 1, bittybuzz.ScenarioError, "no script has a global"),
        ("x", 1, ValueError, "`x` cannot be written\n  help: only a global"),
        ("global.t.a", 1, ValueError, "cannot be written"),
        ("", 1, ValueError, "cannot be written"),
    ]:
        with pytest.raises(kind, match=text):
            simulation.write(quantity, values)  # type: ignore[arg-type]
    assert simulation.digest() == digest and simulation.commands == ""


def test_snapshots_return_to_a_state(tmp_path: pathlib.Path) -> None:
    scenario = worlds.scenario(tmp_path)
    simulation = scenario.start(seed=3)
    simulation.step(10)
    snapshot = simulation.snapshot()
    assert snapshot.time == 1.0
    simulation.write("global.n", 5)
    simulation.step(40)
    digest = simulation.digest()
    for other in (simulation, scenario.start(seed=4)):
        for _ in range(2):
            other.restore(snapshot)
            assert other.time == 1.0 and other.commands == "" and other.seed == 3
            other.write("global.n", 5)
            other.step(40)
            assert other.digest() == digest
    with pytest.raises(bittybuzz.Error, match="another scenario"):
        worlds.simulation(tmp_path).restore(snapshot)


def test_logs_are_taken_once(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    start = simulation.snapshot()
    simulation.step(20)
    lines = simulation.logs()
    assert [(line.robot, line.text) for line in lines] == [(0, "three 0"), (1, "three 1"), (2, "three 2")]
    assert len({line.time for line in lines}) == 1 and 0 < lines[0].time < 2
    assert simulation.logs() == []
    # Lines of a future that was left do not come.
    simulation.restore(start)
    simulation.step(20)
    simulation.restore(start)
    assert simulation.logs() == []
    simulation.step(20)
    assert simulation.logs() == lines
