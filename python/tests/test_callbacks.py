"""Callbacks of `step` and of the ground."""

from __future__ import annotations

import pathlib

import bittybuzz
import numpy as np
import numpy.typing as npt
import pytest

import worlds

Floats = npt.NDArray[np.float32]


@pytest.fixture
def tracker(root: pathlib.Path) -> bittybuzz.Scenario:
    """Robots with ground sensors on painted ground."""
    return bittybuzz.Scenario.load(root / "examples/ground/line.toml")


def test_each_sees_every_tick(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    seen: list[tuple[float, float]] = []

    def each(now: bittybuzz.Simulation) -> None:
        assert now is simulation
        seen.append((now.time, now.read("global.n")[0]))
        if now.time == 1.0:
            now.write("global.n", 100)

    assert simulation.step(20, each=each) == 20
    assert [time for time, _ in seen] == [tick / 10 for tick in range(1, 21)]
    assert seen[9] == (1.0, 9) and seen[10] == (1.1, 101)


def test_the_exception_of_each_ends_the_step(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    error = LookupError("mine")

    def each(now: bittybuzz.Simulation) -> None:
        if now.time >= 0.5:
            raise error

    with pytest.raises(LookupError) as caught:
        simulation.step(20, each=each)
    assert caught.value is error and simulation.time == 0.5
    # The simulation goes on as if nothing had happened.
    simulation.step(15)
    other = worlds.simulation(tmp_path)
    other.step(20)
    assert simulation.digest() == other.digest()


def test_each_cannot_step_or_restore(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    snapshot = simulation.snapshot()
    for act in (lambda now: now.step(), lambda now: now.restore(snapshot)):
        with pytest.raises(bittybuzz.Busy, match="a callback of `step` cannot step"):
            simulation.step(3, each=act)
    assert simulation.step() == 1


def test_the_ground_is_asked_once_in_a_tick(tracker: bittybuzz.Scenario) -> None:
    calls: list[Floats] = []

    def ground(places: Floats) -> Floats:
        calls.append(places)
        return np.ones(len(places), np.float32)

    simulation = tracker.start(ground=ground)
    simulation.step(30)
    assert len(calls) == 30
    assert all(places.shape == (len(calls[0]), 2) and places.dtype == np.float32 for places in calls)
    # The sensors are on the robots.
    middle = simulation.poses()[:, :2].mean(axis=0)
    assert np.abs(calls[-1].mean(axis=0) - middle).max() < 100


def test_the_same_ground_gives_the_same_run(tracker: bittybuzz.Scenario) -> None:
    def ground(places: Floats) -> Floats:
        return (places[:, 0] > 0).astype(np.float32)

    digests = set()
    for threads in (1, 2):
        simulation = tracker.start(ground=ground, pure=True, threads=threads)
        simulation.step(50)
        snapshot = simulation.snapshot()
        simulation.step(50)
        digests.add(simulation.digest())
        simulation.restore(snapshot)
        simulation.step(50)
        digests.add(simulation.digest())
    assert len(digests) == 1
    white = tracker.start(ground=lambda places: [1.0] * len(places))
    white.step(100)
    assert white.digest() not in digests


@pytest.mark.parametrize(
    ("result", "kind", "text"),
    [
        ([], ValueError, "array of shape \\(.*,\\), not of \\(0,\\)"),
        (None, ValueError, "not of \\(1,\\)"),
        ("black", ValueError, "black"),
        ([[0.5]], ValueError, "not of \\(1, 1\\)"),
    ],
)
def test_a_wrong_ground_is_explained(
    tracker: bittybuzz.Scenario, result: object, kind: type[Exception], text: str
) -> None:
    simulation = tracker.start(ground=lambda places: result)  # type: ignore[arg-type,return-value]
    with pytest.raises(kind, match=text):
        simulation.step(5)
    assert simulation.time == 0.1


def test_brightness_has_a_range(tracker: bittybuzz.Scenario) -> None:
    for value in (-0.1, 1.5, np.nan, np.inf):
        simulation = tracker.start(ground=lambda places: np.full(len(places), value))
        with pytest.raises(ValueError, match="from 0 \\(black\\) to 1 \\(white\\), not"):
            simulation.step()


def test_the_exception_of_the_ground_ends_the_step(tracker: bittybuzz.Scenario) -> None:
    error = LookupError("mine")
    calls = 0

    def ground(places: Floats) -> Floats:
        nonlocal calls
        calls += 1
        if calls == 5:
            raise error
        return np.ones(len(places), np.float32)

    simulation = tracker.start(ground=ground)
    with pytest.raises(LookupError) as caught:
        simulation.step(20)
    assert caught.value is error and simulation.time == 0.5
    # The values of the tick before have stood in, which are those of an even ground.
    simulation.step(15)
    even = tracker.start(ground=lambda places: np.ones(len(places)))
    even.step(20)
    assert simulation.digest() == even.digest()


def test_a_ground_that_is_not_pure_does_not_replay(tracker: bittybuzz.Scenario) -> None:
    simulation = tracker.start(ground=lambda places: np.ones(len(places)))
    simulation.step(3)
    with pytest.raises(bittybuzz.NotReplayable, match="pure=True"):
        simulation.snapshot()
    with pytest.raises(bittybuzz.NotReplayable, match="pure=True"):
        simulation.commands


def test_the_ground_cannot_use_its_simulation(tracker: bittybuzz.Scenario) -> None:
    simulations: list[bittybuzz.Simulation] = []

    def ground(places: Floats) -> Floats:
        simulations[0].poses()
        return np.ones(len(places), np.float32)

    for threads in (1, 2):
        simulations[:] = [tracker.start(ground=ground, threads=threads)]
        with pytest.raises(bittybuzz.Busy, match="in use"):
            simulations[0].step()


def test_callbacks_must_be_callable(tracker: bittybuzz.Scenario) -> None:
    with pytest.raises(TypeError, match="`ground` must be callable, not a int"):
        tracker.start(ground=5)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="`each` must be callable, not a list"):
        tracker.start().step(1, each=[])  # type: ignore[arg-type]
