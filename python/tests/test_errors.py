"""Mistakes of callers, scripts and scenarios: each gets an exception with a clear sentence."""

from __future__ import annotations

import pathlib
from typing import Any

import bittybuzz
import pytest

import worlds


def test_messages_of_the_compiler_are_objects() -> None:
    text = "x = 1\nfunction step() { led(nmae) }\nfunction init() { 1 + }\n"
    found = bittybuzz.check(text, robot="kilobot")
    errors = [one for one in found if one.severity == "error"]
    assert errors and errors[0].line == 3 and errors[0].file == "<text>"
    assert errors[0].code is not None and errors[0].code.startswith("E")
    with pytest.raises(bittybuzz.ScriptError) as caught:
        bittybuzz.compile(text, robot="kilobot")
    assert list(caught.value.diagnostics) == found
    assert f"<text>:3:{errors[0].column}: error[{errors[0].code}]: " in str(caught.value)
    assert isinstance(caught.value, bittybuzz.Error)
    assert str(errors[0]) in str(caught.value)


def test_a_script_of_a_scenario_has_mistakes(tmp_path: pathlib.Path) -> None:
    worlds.folder(tmp_path, "function step() { 1 + }")
    with pytest.raises(bittybuzz.ScriptError) as caught:
        bittybuzz.Scenario.parse(worlds.WORLD, tmp_path)
    [mistake] = caught.value.diagnostics
    assert mistake.file == str(tmp_path / "counts.bzz") and mistake.line == 1


def test_a_scenario_has_mistakes(tmp_path: pathlib.Path) -> None:
    with pytest.raises(bittybuzz.ScenarioError) as caught:
        bittybuzz.Scenario.parse(worlds.WORLD.replace("duration", "duratoin"), worlds.folder(tmp_path))
    assert "<text>:3:1: error: " in str(caught.value)
    assert any("`duration`" in (one.help or "") for one in caught.value.diagnostics)
    with pytest.raises(bittybuzz.ScenarioError, match="no/such.toml"):
        bittybuzz.Scenario.load("no/such.toml")
    for text in ("", "\0", "[world", "é" * 1000, "[[robots]]\n" * 1000):
        with pytest.raises(bittybuzz.ScenarioError):
            bittybuzz.Scenario.parse(text, tmp_path)
    with pytest.raises(bittybuzz.ScenarioError, match="firmware"):
        bittybuzz.Scenario.parse(worlds.WORLD, tmp_path, set={"robots.0.backend": "firmware"})


def test_commands_have_mistakes(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    for text, words in [
        ("", "fail"),
        ("fail = 99", "99"),
        ("fial = 1", "did you mean `fail`"),
        ("fail = ", ":1:"),
        ('set = 0\nglobal = "n"\nnumbers = [1, 2]', "one number for each robot"),
        ('load = 0\nscript = "absent.bzz"', "absent.bzz"),
    ]:
        with pytest.raises(bittybuzz.ScenarioError, match=words):
            simulation.command(text)
    assert simulation.commands == ""
    simulation.step(1000)
    assert simulation.is_over and simulation.step() == 0
    with pytest.raises(bittybuzz.ScenarioError, match="over"):
        simulation.command("fail = 1")


def test_a_command_loads_a_script(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    assert simulation.read("global.n")[0] != 77
    (tmp_path / "other.bzz").write_text("n = 77 other = 5\n")
    simulation.command('load = 0\nscript = "other.bzz"')
    simulation.step(3)
    # A quantity that was read before knows the new script.
    assert simulation.read("global.n")[0] == 77 and simulation.read("global.other")[0] == 5
    (tmp_path / "wrong.bzz").write_text("n = \n")
    with pytest.raises(bittybuzz.ScenarioError, match="wrong.bzz"):
        simulation.command('load = 0\nscript = "wrong.bzz"')


def test_quantities_have_mistakes(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    for quantity in ("", "y ", "global.", "global.1", "distance(1)", "colour", "\0"):
        with pytest.raises(ValueError, match="is no quantity\n  help: one of x, y, z"):
            simulation.read(quantity)
    with pytest.raises(bittybuzz.ScenarioError, match="no script has a global `haff`\n  help: did you mean `half`"):
        simulation.read("global.haff")


def test_robots_have_mistakes(tmp_path: pathlib.Path) -> None:
    with pytest.raises(bittybuzz.RobotError, match="help: did you mean `kilobot`"):
        bittybuzz.compile("", robot="kilobto")
    path = tmp_path / "robot.toml"
    path.write_text("name = 5\n")
    with pytest.raises(bittybuzz.RobotError, match="robot.toml:1:") as caught:
        bittybuzz.run("", robot=path)
    assert caught.value.diagnostics[0].line == 1


def test_a_run_time_error_has_the_log_until_then() -> None:
    with pytest.raises(bittybuzz.RunError) as caught:
        bittybuzz.run('log("before")\nx = nil\ny = x + 1\nlog("after")')
    assert caught.value.log == "before\n"
    [mistake] = caught.value.diagnostics
    assert (mistake.file, mistake.line) == ("<text>", 3)
    assert mistake.code is not None and str(caught.value).startswith("<text>:3:")


def test_scripts_that_do_not_end_are_stopped() -> None:
    with pytest.raises(bittybuzz.RunError, match="the global code did not end within 100 million"):
        bittybuzz.run("while(1) { }")
    with pytest.raises(bittybuzz.RunError, match="more than 64 MiB"):
        bittybuzz.run(f'text = "{"x" * 2000}"\nwhile(1) {{ log(text, text, text, text) }}')
    # A script without `step` has nothing to do.
    assert bittybuzz.run("", steps=2**62) == ""


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (lambda at: at.step(-1), ValueError, "`n` must be an integer from 0 to .*, not -1"),
        (lambda at: at.step(2**80), ValueError, "`n` must be an integer"),
        (lambda at: at.step(1.5), TypeError, "`n` must be an integer from .*, not a float"),
        (lambda at: at.step("1"), TypeError, "not a str"),
        (lambda at: at.stigmergy(-1), ValueError, "`robot` must be an integer from 0 to 65535, not -1"),
        (lambda at: at.command(5), TypeError, "str"),
        (lambda at: at.read(None), TypeError, "str"),
        (lambda at: at.restore(None), TypeError, "Snapshot"),
        (lambda at: at.record(5), TypeError, "`path` must be a string or a path, not a int"),
    ],
)
def test_wrong_arguments(tmp_path: pathlib.Path, call: Any, kind: type[Exception], text: str) -> None:
    with pytest.raises(kind, match=text):
        call(worlds.simulation(tmp_path))


def test_wrong_arguments_of_scenarios(tmp_path: pathlib.Path) -> None:
    load: Any = lambda set: bittybuzz.Scenario.parse(worlds.WORLD, worlds.folder(tmp_path), set=set)
    endless: list[Any] = []
    endless.append(endless)
    for set, kind, text in [
        ({"world.seed": None}, TypeError, "the value of `world.seed` must be a number, .* not a NoneType"),
        ({1: 2}, TypeError, "the keys of `set` must be strings"),
        ({"": 2}, ValueError, "is no key of a scenario"),
        ({"a=b": 2}, ValueError, "is no key of a scenario"),
        ({"world.size": endless}, ValueError, "more than 8 lists"),
        ({"world.sede": 2}, bittybuzz.ScenarioError, "did you mean `seed`"),
        ({"world.seed": -1}, bittybuzz.ScenarioError, "--set world.seed:1:1"),
        ({"world.seed": 'x" \n\\'}, bittybuzz.ScenarioError, "must be"),
    ]:
        with pytest.raises(kind, match=text):
            load(set)
    scenario = load({"world.duration": 5})
    assert (scenario.duration, scenario.robot_count, scenario.seed) == (5.0, 4, 1)
    start: Any = scenario.start
    wrong: list[tuple[dict[str, Any], type[Exception], str]] = [
        ({"seed": -1}, ValueError, "`seed` must be an integer from 0 to 4294967295, not -1"),
        ({"seed": 2**32}, ValueError, "`seed` must be"),
        ({"seed": 1.0}, TypeError, "not a float"),
        ({"threads": 10**6}, ValueError, "`threads` must be an integer from 0 to 1024"),
    ]
    for arguments, kind, text in wrong:
        with pytest.raises(kind, match=text):
            start(**arguments)


def test_sources_of_scripts(tmp_path: pathlib.Path) -> None:
    with pytest.raises(bittybuzz.ScriptError, match="cannot read `no/such.bzz`"):
        bittybuzz.compile("no/such.bzz")
    wrong: Any = 5
    with pytest.raises(TypeError, match="`source` must be a string or a path, not a int"):
        bittybuzz.compile(wrong)
    (tmp_path / "not_utf8.bzz").write_bytes(b"x = 1 \xff")
    with pytest.raises(bittybuzz.ScriptError, match="is not UTF-8 text"):
        bittybuzz.compile(tmp_path / "not_utf8.bzz")
    with pytest.raises(bittybuzz.ScriptError, match="larger than"):
        bittybuzz.compile("#" * (2 << 20))
    (tmp_path / "part.bzz").write_text("function two() { return 2 }\n")
    assert bittybuzz.run('include "part.bzz"\nlog(two())', include=[tmp_path]) == "2\n"


def test_recordings_have_mistakes(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    with pytest.raises(FileNotFoundError):
        simulation.record(tmp_path / "absent/run.bbr")
    with pytest.raises(OSError, match="cannot write"):
        simulation.record(tmp_path)
    snapshot = simulation.snapshot()
    recording = simulation.record(tmp_path / "run.bbr")
    with pytest.raises(bittybuzz.Error, match="being recorded\n  help: close"):
        simulation.record(tmp_path / "other.bbr")
    with pytest.raises(bittybuzz.Error, match="close the recording first"):
        simulation.restore(snapshot)
    recording.close()
    size = (tmp_path / "run.bbr").stat().st_size
    with simulation.record(tmp_path / "other.bbr"):
        # This one is closed already, and the other one is not its own.
        recording.close()
        simulation.step(10)
    recording.close()
    assert (tmp_path / "run.bbr").stat().st_size == size
    assert (tmp_path / "other.bbr").stat().st_size > size
    # A recording that is not closed leaves no file.
    simulation.record(tmp_path / "left.bbr")
    del simulation, recording
    names = {file.name for file in tmp_path.iterdir()}
    assert "left.bbr" not in names


def test_texts_of_objects(tmp_path: pathlib.Path) -> None:
    simulation = worlds.simulation(tmp_path)
    assert repr(simulation) == "<Simulation of 4 robots at 0 s>"
    assert repr(worlds.scenario(tmp_path)) == "<Scenario of 4 robots, 20 s>"
    assert repr(simulation.snapshot()) == "<Snapshot at 0 s>"
    assert repr(bittybuzz.Busy("x")) == "Busy('x')" and bittybuzz.Busy.__module__ == "bittybuzz"
