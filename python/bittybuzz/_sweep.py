"""Sweeps: the chunks of `bbz sweep`, on any executor."""

from __future__ import annotations

import os
import sys

from ._errors import Error

# A checker of types takes this name for true. Python would load the modules each time it imports the package, for 20 ms.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path
    from typing import Any, Protocol, type_check_only

    @type_check_only
    class Executor(Protocol):
        """Calls functions elsewhere: an executor of `concurrent.futures`, or anything with its method `submit`."""

        def submit(self, fn: Any, /, *args: Any) -> Any:
            """Calls `fn` and returns a future with the method `result`."""


# A run that could not go on is a row with an error, and no failure of a command.
_ENDED = (0, 1)


def sweep(
    scenario: str | os.PathLike[str],
    *,
    folder: str | os.PathLike[str] | None = None,
    runs: int | None = None,
    set: Iterable[str] = (),
    seed: int | None = None,
    chunk: int | None = None,
    chunk_seconds: float | None = None,
    executor: Executor | None = None,
) -> Path:
    """Carries out the runs of a scenario that are not finished yet. Returns the path of their table, a CSV file.

    The options are those of `bbz sweep plan`. Finished runs wait in `folder`, next to the scenario with the ending
    `.sweep` unless another is named, and are kept when `runs`, points or chunks become more. An executor is given a
    chunk at a time; its workers need this module and the folder. Without one, this computer simulates on all cores.
    """
    from pathlib import Path

    scenario = Path(scenario)
    place = scenario.with_suffix(".sweep") if folder is None else Path(folder)
    place = place.absolute()
    options = {"runs": runs, "seed": seed, "chunk": chunk, "chunk-seconds": chunk_seconds}
    words = [f"--{name}={value}" for name, value in options.items() if value is not None]
    words += [f"--set={one}" for one in set]
    _bbz("plan", os.fspath(scenario), f"--folder={place}", *words, ended=(0,))
    if executor is None:
        _bbz("run", os.fspath(place), "--headless")
    else:
        missing = _bbz("status", os.fspath(place), "--missing").split()
        futures = [executor.submit(_run_chunk, os.fspath(place), int(number)) for number in missing]
        try:
            for future in futures:
                future.result()
        finally:
            # After an error or Ctrl-C, the others need not begin.
            for future in futures:
                getattr(future, "cancel", lambda: None)()
    table = place.with_suffix(".csv")
    _bbz("merge", os.fspath(place), "-o", os.fspath(table))
    return table


def _run_chunk(folder: str, chunk: int) -> None:
    _bbz("run", folder, f"--chunk={chunk}", "--threads=1", "--headless")


def _bbz(*words: str, ended: tuple[int, ...] = _ENDED) -> str:
    import subprocess

    # The tool runs once in a process.
    command = [sys.executable, "-m", "bittybuzz", "sweep", *words]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    if done.returncode not in ended:
        raise Error(done.stderr.strip() or f"`{' '.join(command)}` ended with status {done.returncode}")
    return done.stdout
