"""Libraries for tables read those of `bbz sim --data` without options, and find the arrays of the module in them."""

from __future__ import annotations

import pathlib
from collections.abc import Callable

import bittybuzz
import duckdb
import numpy as np
import numpy.typing as npt
import pandas
import polars
import pytest

SCENARIO = "examples/swarm/gradient.toml"


@pytest.fixture(scope="module")
def data(bbz: Callable[..., str], tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The tables of a run."""
    folder = tmp_path_factory.mktemp("tables") / "run"
    bbz("sim", SCENARIO, "--headless", "--data", str(folder))
    return folder


@pytest.fixture(scope="module")
def poses(root: pathlib.Path) -> npt.NDArray[np.float64]:
    """Robot, tick, and x, y and heading in tenths, by robot and then by tick."""
    simulation = bittybuzz.Scenario.load(root / SCENARIO).start()
    samples: list[npt.NDArray[np.float64]] = []
    while True:
        pose = simulation.poses()
        sample = np.zeros((len(pose), 5))
        sample[:, 0] = simulation.ids
        sample[:, 1] = round(simulation.time * 10)
        sample[:, 2:4] = pose[:, :2] * 10
        sample[:, 4] = np.degrees(pose[:, 3]) * 10
        samples.append(sample)
        if not simulation.step(10):
            break
    return np.concatenate(np.stack(samples, axis=1))


COLUMNS = ["robot", "tick", "x_tenths_mm", "y_tenths_mm", "heading_tenths_deg"]


def test_pandas_reads_the_folder(data: pathlib.Path, poses: npt.NDArray[np.float64]) -> None:
    table = pandas.read_parquet(data / "robots")
    assert np.abs(table[COLUMNS].to_numpy() - poses).max() <= 0.5 + 1e-3
    assert (table.dtypes == "int32").all()
    assert list(pandas.read_parquet(data / "events")["action"]) == ["move"]
    [digest] = pandas.read_parquet(data / "runs")["digest"]
    assert digest == whole(SCENARIO)


def whole(scenario: str) -> str:
    """The digest of the whole run."""
    root = pathlib.Path(__file__).parents[2]
    simulation = bittybuzz.Scenario.load(root / scenario).start()
    while simulation.step(1000):
        pass
    return simulation.digest()


def test_polars_reads_the_files(data: pathlib.Path, poses: npt.NDArray[np.float64]) -> None:
    table = polars.read_parquet(data / "robots" / "*.parquet")
    assert np.abs(table.select(COLUMNS).to_numpy() - poses).max() <= 0.5 + 1e-3
    assert polars.read_parquet(data / "logs" / "*.parquet").columns == ["run", "tick", "robot", "text"]


def test_duckdb_reads_the_files(data: pathlib.Path, poses: npt.NDArray[np.float64]) -> None:
    question = f"SELECT {', '.join(COLUMNS)} FROM '{data}/robots/*.parquet' ORDER BY robot, tick"
    relation = duckdb.sql(question)
    assert relation is not None
    table = relation.fetchnumpy()
    found = np.stack([table[name] for name in COLUMNS], axis=1)
    assert np.abs(found - poses).max() <= 0.5 + 1e-3


def test_csv_has_the_same_numbers(data: pathlib.Path, bbz: Callable[..., str], tmp_path: pathlib.Path) -> None:
    bbz("sim", SCENARIO, "--headless", "--data", str(tmp_path / "run.csv"))
    table = pandas.read_csv(tmp_path / "run.csv")
    pandas.testing.assert_frame_equal(table, pandas.read_parquet(data / "robots"), check_dtype=False)


def test_many_runs_have_their_parameters(bbz: Callable[..., str], root: pathlib.Path, tmp_path: pathlib.Path) -> None:
    arguments = ["--runs", "2", "--set", "medium.ir.loss=0,0.3", "--data", str(tmp_path / "runs")]
    bbz("sim", SCENARIO, "--headless", *arguments)
    runs = pandas.read_parquet(tmp_path / "runs" / "runs")
    assert list(runs["run"]) == [0, 1, 2, 3] and list(runs["medium.ir.loss"]) == [0, 0, 0.3, 0.3]
    assert list(runs["seed"]) == ["1", "2", "1", "2"] and runs["error"].isna().all()
    simulation = bittybuzz.Scenario.load(root / SCENARIO, set={"medium.ir.loss": 0.3}).start(seed=2)
    while simulation.step(1000):
        pass
    assert runs["digest"][3] == simulation.digest()
    robots = pandas.read_parquet(tmp_path / "runs" / "robots")
    last = robots[(robots["run"] == 3) & (robots["tick"] == 1200)]
    assert list(last["robot"]) == list(simulation.ids)
    assert np.abs(last["x_tenths_mm"].to_numpy() - simulation.poses()[:, 0] * 10).max() <= 0.501
