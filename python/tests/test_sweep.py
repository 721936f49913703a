"""Sweeps on executors: the same table, whoever carries out the chunks."""

from __future__ import annotations

import pathlib
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor

import bittybuzz
import pytest

SCENARIO = """
[world]
size = [500, 500]
duration = 5

[[robots]]
name = "walkers"
robot = "kilobot"
script = "s.bzz"
count = 5

[output]
plot = ["x", "global.n"]
"""
SET = "robots.walkers.globals.G=1:3"


@pytest.fixture
def study(tmp_path: pathlib.Path) -> pathlib.Path:
    (tmp_path / "s.toml").write_text(SCENARIO)
    (tmp_path / "s.bzz").write_text("n = 0\nG = 1\nfunction step() { n = n + G forward() }\n")
    return tmp_path / "s.toml"


def simulated(study: pathlib.Path, runs: int) -> bytes:
    """The table of one process that simulates all runs."""
    table = study.with_name("whole.csv")
    words: list[str | pathlib.Path] = ["sim", study, "--runs", str(runs), "--set", SET, "--csv", table]
    subprocess.run([sys.executable, "-m", "bittybuzz", *words], check=True, capture_output=True)
    return table.read_bytes()


class Sequential:
    """An executor that has nothing but `submit`."""

    def __init__(self) -> None:
        self.chunks = 0

    def submit(self, fn: Callable[..., None], /, *args: object) -> Future[None]:
        self.chunks += 1
        fn(*args)
        future: Future[None] = Future()
        future.set_result(None)
        return future


def test_all_executors_give_the_table_of_one_process(study: pathlib.Path) -> None:
    expected = simulated(study, 4)
    others = [None, Sequential(), ThreadPoolExecutor(2), ProcessPoolExecutor(2)]
    for number, executor in enumerate(others):
        folder = study.with_name(f"{number}.sweep")
        table = bittybuzz.sweep(study, folder=folder, runs=4, set=[SET], chunk=2, executor=executor)
        assert table == study.with_name(f"{number}.csv")
        assert table.read_bytes() == expected


def test_more_runs_keep_those_that_are_finished(study: pathlib.Path) -> None:
    executor = Sequential()
    bittybuzz.sweep(study, runs=2, set=[SET], chunk=2, executor=executor)
    assert executor.chunks == 3
    assert bittybuzz.sweep(study, runs=2, set=[SET], executor=executor).name == "s.csv"
    assert executor.chunks == 3
    table = bittybuzz.sweep(study, runs=4, set=[SET], executor=executor)
    # Chunks of which all runs were finished before are not given away.
    assert executor.chunks == 6
    assert table.read_bytes() == simulated(study, 4)


def test_mistakes_are_errors_with_the_message_of_the_tool(study: pathlib.Path, tmp_path: pathlib.Path) -> None:
    with pytest.raises(bittybuzz.Error, match="nothing.toml"):
        bittybuzz.sweep(tmp_path / "nothing.toml")
    with pytest.raises(bittybuzz.Error, match="both give the seed"):
        bittybuzz.sweep(study, seed=3, set=["world.seed=1,2"])
    study.with_name("s.bzz").write_text("function step( {\n")
    with pytest.raises(bittybuzz.Error, match="s.bzz:1"):
        bittybuzz.sweep(study)
