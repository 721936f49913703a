"""Pictures, movies and the past of a run."""

from __future__ import annotations

import base64
import pathlib
import re
import xml.etree.ElementTree as xml

import numpy as np
import pytest
import worlds

import bittybuzz

SVG = "{http://www.w3.org/2000/svg}"


def robots(picture: bittybuzz.Picture) -> list[xml.Element]:
    """Returns the elements of robots, which stand at their places."""
    groups = xml.fromstring(picture.svg).iter(f"{SVG}g")
    return [group for group in groups if group.get("transform", "").startswith("translate")]


def test_a_picture_shows_where_robots_are(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.step(10)
    drawn = robots(simulation.picture())
    # The late robot has not joined. 600 mm are 900 wide, and the rim 10, with y down.
    assert len(drawn) == 3
    for element, (x, y, *_) in zip(drawn, simulation.poses()):
        place = re.fullmatch(r"translate\(([\d.]+) ([\d.]+)\)", element.get("transform", ""))
        assert place is not None
        shown = [float(number) for number in place.groups()]
        assert shown == pytest.approx([10 + (x + 300) * 1.5, 10 + (300 - y) * 1.5], abs=0.06)


def test_a_notebook_shows_and_a_file_has_the_same_picture(tmp_path: pathlib.Path) -> None:
    picture = worlds.simulation(tmp_path).picture()
    shown = re.search(r'src="data:image/svg\+xml;base64,([^"]+)"', picture._repr_html_())
    assert shown is not None
    assert base64.b64decode(shown[1]).decode() == picture.svg
    picture.save(tmp_path / "swarm.svg")
    assert (tmp_path / "swarm.svg").read_text() == picture.svg
    with pytest.raises(ValueError, match=r"swarm\.png` does not end in \.svg"):
        picture.save(tmp_path / "swarm.png")
    with pytest.raises(OSError, match="swarm.svg"):
        picture.save(tmp_path / "nowhere" / "swarm.svg")


def test_a_movie_advances_the_run(tmp_path: pathlib.Path) -> None:
    simulation, other = worlds.simulation(tmp_path), worlds.simulation(tmp_path)
    simulation.command('move = 0\nto = [-200, -200]\n')
    other.command('move = 0\nto = [-200, -200]\n')
    movie = simulation.movie(3.0, every=1.0, speed=2.0)
    other.step(30)
    assert simulation.time == 3.0 and simulation.digest() == other.digest()
    [moved] = [element for element in robots(movie) if element.find(f"{SVG}animateTransform") is not None]
    animation = moved.find(f"{SVG}animateTransform")
    assert animation is not None
    values = animation.get("values", "").split(";")
    # At 0, 1, 2 and 3 s; three seconds take half of that.
    assert len(values) == 4 and values[1:] == ["160.0 760.0"] * 3 and values[0] != values[1]
    assert animation.get("dur") == "1.500s"
    # At the end of the run it stops.
    assert simulation.movie(1e6, every=5.0).svg and simulation.is_over
    assert len(robots(simulation.movie(1.0))) == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seconds": -1.0}, "`seconds` must be a time"),
        ({"seconds": float("nan")}, "`seconds` must be a time"),
        ({"seconds": 1.0, "every": 0.0}, "`every` must be at least 0.1 s"),
        ({"seconds": 1.0, "every": float("inf")}, "`every` must be a time"),
        ({"seconds": 1.0, "speed": 0.0}, "`speed` must be above 0"),
        ({"seconds": 1.0, "speed": float("nan")}, "`speed` must be above 0"),
    ],
)
def test_a_wrong_movie_is_refused(tmp_path: pathlib.Path, arguments: dict[str, float], message: str) -> None:
    simulation = worlds.simulation(tmp_path)
    with pytest.raises(ValueError, match=message):
        simulation.movie(**arguments)
    assert simulation.time == 0.0


def test_the_history_is_what_was_read(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.write("global.n", 40)
    counts, spreads = [simulation.read("global.n")], [simulation.read("swarm.spread")]
    for tick in range(60):
        if tick == 25:
            simulation.write("global.n", [1000, float("nan"), -5, float("nan")])
        simulation.step()
        counts.append(simulation.read("global.n"))
        spreads.append(simulation.read("swarm.spread"))
    history = simulation.history("global.n", "swarm.spread", every=0.1)
    assert list(history) == ["time", "global.n", "swarm.spread"]
    np.testing.assert_allclose(history["time"], np.arange(61) / 10)
    np.testing.assert_array_equal(history["global.n"], np.array(counts))
    np.testing.assert_array_equal(history["swarm.spread"], np.array(spreads))
    assert history["global.n"].shape == (61, 4) and history["swarm.spread"].shape == (61, 1)
    # By default at the interval of the scenario, which is one second.
    assert list(simulation.history()["time"]) == [0, 1, 2, 3, 4, 5, 6]


def test_a_restored_run_has_the_history_of_its_snapshot(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    simulation.step(10)
    snapshot = simulation.snapshot()
    simulation.write("global.n", 500)
    simulation.step(10)
    simulation.restore(snapshot)
    simulation.step(10)
    last = simulation.history("global.n", every=1.0)["global.n"][-1]
    np.testing.assert_array_equal(last, simulation.read("global.n"))
    assert last[0] < 500


def test_a_history_needs_a_run_that_repeats(tmp_path: pathlib.Path) -> None:
    scenario = worlds.scenario(tmp_path)
    simulation = scenario.start(ground=lambda places: np.zeros(len(places)))
    simulation.step(3)
    with pytest.raises(bittybuzz.NotReplayable):
        simulation.history("x")
    with pytest.raises(bittybuzz.Error, match="no script has a global `nothing`"):
        worlds.simulation(tmp_path).history("global.nothing")
    with pytest.raises(ValueError, match="`every` must be at least"):
        worlds.simulation(tmp_path).history("x", every=0.01)


def test_a_plot_has_the_curve_of_each_robot(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path, worlds.WORLD + '\n[output]\nplot = ["global.n"]\n')
    simulation.step(50)
    picture = simulation.plot()
    assert picture.svg == simulation.plot("global.n").svg
    root = xml.fromstring(picture.svg)
    assert "global.n" in [text.text for text in root.iter(f"{SVG}text")]
    curves = [path for path in root.iter(f"{SVG}path") if path.get("stroke-width") == "1.2"]
    assert len(curves) == 3
    with pytest.raises(ValueError, match=r"no `\[output\] plot`"):
        worlds.simulation(tmp_path).plot()
