"""The tool `bbz` in the module."""

from __future__ import annotations

import json
import os
import pathlib
import signal
import subprocess
import sys
from collections.abc import Callable

import pytest

TOOL = [sys.executable, "-m", "bittybuzz"]


def run(root: pathlib.Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs the tool from the root of the repository."""
    return subprocess.run([*TOOL, *arguments], cwd=root, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize(
    "arguments",
    [
        ["sim", "examples/swarm/gradient.toml", "--headless", "--json"],
        ["check", "examples/errors/misspelt_name.bzz"],
        ["run", "examples/blink.bzz", "--steps", "12"],
        ["explain", "E0201"],
        ["robots", "kilobot"],
    ],
    ids=lambda words: words[0],
)
def test_the_module_prints_what_the_program_prints(root: pathlib.Path, arguments: list[str]) -> None:
    program = subprocess.run([os.environ["BBZ"], *arguments], cwd=root, capture_output=True, text=True)
    module = run(root, *arguments)
    assert (module.returncode, module.stdout, module.stderr) == (program.returncode, program.stdout, program.stderr)


def test_the_script_of_the_module_is_the_tool(root: pathlib.Path, bbz: Callable[..., str]) -> None:
    script = pathlib.Path(sys.executable).with_name("bbz")
    done = subprocess.run([script, "--version"], capture_output=True, text=True)
    assert done.stdout == bbz("--version")


def test_messages_repeat_the_command_of_the_module(root: pathlib.Path) -> None:
    refused = run(root, "sim", "examples/swarm/gradient.toml", "--no-such-option")
    assert refused.returncode == 3
    assert f"{pathlib.Path(sys.executable).name} -m bittybuzz sim" in refused.stderr


def test_ctrl_c_ends_the_tool(root: pathlib.Path) -> None:
    arguments = ["sim", "examples/swarm/gradient.toml", "--view", "--no-browser"]
    child = subprocess.Popen([*TOOL, *arguments], cwd=root, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert child.stdout is not None
    while "http://127.0.0.1:" not in (line := child.stdout.readline()):
        assert line, "no address"
    child.send_signal(signal.SIGINT)
    rest = child.communicate(timeout=60)[0]
    assert "Traceback" not in rest and "KeyboardInterrupt" not in rest


def test_json_of_the_module_is_complete(root: pathlib.Path) -> None:
    done = run(root, "sim", "examples/patrol.toml", "--headless", "--json")
    assert json.loads(done.stdout)["digest"]
