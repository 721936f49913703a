"""Paths that the tests use. The variable BBZ names the program `bbz`, of the same profile as the module."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
from collections.abc import Callable
from typing import Any

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def root() -> pathlib.Path:
    """The folder of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def bbz() -> Callable[..., str]:
    """Runs `bbz` from the root of the repository, and returns its output. It may exit with 1, as for a fault."""

    def run(*arguments: str) -> str:
        done = subprocess.run([os.environ["BBZ"], *arguments], cwd=ROOT, capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def simulated(bbz: Callable[..., str]) -> Callable[..., dict[str, Any]]:
    """Simulates a scenario by `bbz`, and returns its summary."""

    def simulate(*arguments: str) -> dict[str, Any]:
        summary: dict[str, Any] = json.loads(bbz("sim", *arguments, "--headless", "--json"))
        return summary

    return simulate
