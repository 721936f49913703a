"""Sweeps on executors: the same table, whoever carries out the chunks."""

import subprocess
import sys
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
def study(tmp_path):
    (tmp_path / "s.toml").write_text(SCENARIO)
    (tmp_path / "s.bzz").write_text("n = 0\nG = 1\nfunction step() { n = n + G forward() }\n")
    return tmp_path / "s.toml"


def simulated(study, runs):
    """The table of one process that simulates all runs."""
    table = study.with_name("whole.csv")
    words = ["sim", study, "--runs", str(runs), "--set", SET, "--csv", table]
    subprocess.run([sys.executable, "-m", "bittybuzz", *words], check=True, capture_output=True)
    return table.read_bytes()


class Sequential:
    """An executor that has nothing but `submit`."""

    def __init__(self):
        self.chunks = 0

    def submit(self, fn, /, *args):
        self.chunks += 1
        future = Future()
        future.set_result(fn(*args))
        return future


def test_all_executors_give_the_table_of_one_process(study):
    expected = simulated(study, 4)
    others = [None, Sequential(), ThreadPoolExecutor(2), ProcessPoolExecutor(2)]
    for number, executor in enumerate(others):
        folder = study.with_name(f"{number}.sweep")
        table = bittybuzz.sweep(study, folder=folder, runs=4, set=[SET], chunk=2, executor=executor)
        assert table == study.with_name(f"{number}.csv")
        assert table.read_bytes() == expected


def test_more_runs_keep_those_that_are_finished(study):
    executor = Sequential()
    bittybuzz.sweep(study, runs=2, set=[SET], chunk=2, executor=executor)
    assert executor.chunks == 3
    assert bittybuzz.sweep(study, runs=2, set=[SET], executor=executor).name == "s.csv"
    assert executor.chunks == 3
    table = bittybuzz.sweep(study, runs=4, set=[SET], executor=executor)
    # Chunks of which all runs were finished before are not given away.
    assert executor.chunks == 6
    assert table.read_bytes() == simulated(study, 4)


def test_mistakes_are_errors_with_the_message_of_the_tool(study, tmp_path):
    with pytest.raises(bittybuzz.Error, match="nothing.toml"):
        bittybuzz.sweep(tmp_path / "nothing.toml")
    with pytest.raises(bittybuzz.Error, match="both give the seed"):
        bittybuzz.sweep(study, seed=3, set=["world.seed=1,2"])
    study.with_name("s.bzz").write_text("function step( {\n")
    with pytest.raises(bittybuzz.Error, match="s.bzz:1"):
        bittybuzz.sweep(study)
