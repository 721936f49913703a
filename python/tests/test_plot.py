"""`bbz plot` has the quartiles of NumPy, and reads tables that pandas and polars wrote."""

from __future__ import annotations

import pathlib
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pandas
import polars
import pytest

SVG = "{http://www.w3.org/2000/svg}"
TIMES = 40
ROBOTS = 11
RUNS = 3


@pytest.fixture(scope="module")
def robots() -> pandas.DataFrame:
    """Robots at random places, of which some have no value."""
    random = np.random.default_rng(1)
    run, robot, tick = (axis.ravel() for axis in np.mgrid[:RUNS, :ROBOTS, :TIMES])
    table = pandas.DataFrame({"run": run, "tick": tick * 10, "robot": robot})
    table["x_tenths_mm"] = random.integers(-5000, 5000, len(table))
    table["global.share"] = random.normal(size=len(table))
    table.loc[random.random(len(table)) < 0.2, "global.share"] = np.nan
    table["state"] = "running"
    return table


def line(path: str) -> npt.NDArray[np.float64]:
    """The points of a path."""
    return np.array([point.split() for point in re.split("[ML]", path.rstrip("Z"))[1:]], dtype=float)


def quartiles(svg: str) -> npt.NDArray[np.float64]:
    """The lower quartile, median and upper quartile of each time, by the numbers at the axis."""
    root = ET.fromstring(svg)
    ticks = [text for text in root.iter(f"{SVG}text") if text.get("text-anchor") == "end"]
    places = [float(tick.attrib["y"]) - 4 for tick in ticks]
    slope, start = np.polyfit(places, [float(tick.text or "") for tick in ticks], 1)
    [median] = [path.attrib["d"] for path in root.iter(f"{SVG}path") if "stroke-dasharray" in path.attrib]
    [band] = [path.attrib["d"] for path in root.iter(f"{SVG}path") if "fill-opacity" in path.attrib]
    edge = line(band)[:, 1]
    middle = len(edge) // 2
    places_of_points = np.stack([edge[:middle], line(median)[:, 1], edge[middle:][::-1]])
    values: npt.NDArray[np.float64] = places_of_points * slope + start
    return values


def expected(robots: pandas.DataFrame, column: str) -> npt.NDArray[np.float64]:
    """The quartiles of each time by NumPy."""
    values = [group[column].dropna() for _, group in robots.groupby("tick")]
    return np.array([np.quantile(group, [0.25, 0.5, 0.75]) for group in values]).T


@pytest.mark.parametrize("writer", ["pandas", "polars"])
def test_quartiles_are_those_of_numpy(
    robots: pandas.DataFrame, writer: str, bbz: Callable[..., str], tmp_path: pathlib.Path
) -> None:
    folder = tmp_path / "robots"
    folder.mkdir()
    parts = robots["run"] == 0
    for number, part in enumerate([robots[parts], robots[~parts]]):
        path = folder / f"{number:05}.parquet"
        if writer == "pandas":
            part.to_parquet(path)
        else:
            polars.from_pandas(part.reset_index(drop=True)).write_parquet(path, compression="snappy")
    for quantity, column, factor in [("x", "x_tenths_mm", 0.1), ("global.share", "global.share", 1)]:
        found = quartiles(bbz("plot", str(tmp_path), quantity))
        wanted = expected(robots, column) * factor
        assert found.shape == wanted.shape == (3, TIMES)
        # Places in the picture have a decimal, on 250 points of height.
        assert np.abs(found - wanted).max() < np.ptp(wanted) / 1000


def test_another_compression_has_a_remedy(
    robots: pandas.DataFrame, bbz: Callable[..., str], tmp_path: pathlib.Path
) -> None:
    (tmp_path / "robots").mkdir()
    polars.from_pandas(robots).write_parquet(tmp_path / "robots" / "00000.parquet")
    with pytest.raises(AssertionError, match=r'compressed by ZSTD[^"]*compression="snappy"'):
        bbz("plot", str(tmp_path), "x")
