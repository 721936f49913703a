"""Swarms of robots that run Buzz scripts: the compiler and the simulator of BittyBuzz."""

from collections.abc import Callable, Sequence
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
import numpy.typing as npt

from ._sweep import sweep

if TYPE_CHECKING:
    from .notebook import View

__all__ = [
    "Busy",
    "Defect",
    "Diagnostic",
    "Error",
    "Expectation",
    "LogLine",
    "NotReplayable",
    "Picture",
    "Recording",
    "RobotError",
    "RunError",
    "Scenario",
    "ScenarioError",
    "Script",
    "ScriptError",
    "Simulation",
    "Snapshot",
    "check",
    "compile",
    "run",
    "sweep",
]

_Path = str | PathLike[str]

class Error(Exception):
    """The base of all exceptions of this module."""

    diagnostics: tuple[Diagnostic, ...]

class ScenarioError(Error):
    """A scenario, a command or a quantity has mistakes."""

class ScriptError(Error):
    """A script has mistakes, which the compiler has found. `diagnostics` includes warnings."""

class RobotError(Error):
    """No robot has that name, or a robot file has mistakes."""

class RunError(Error):
    """A script that `run` executes has a run-time error."""

    log: str

class Busy(Error):
    """The simulation is in use: by another thread, or by a tick that calls this code."""

class NotReplayable(Error):
    """The run depends on a callback that may return other values each time."""

class Defect(Error):
    """A defect of BittyBuzz. The simulation in which it happened cannot be used any more."""

@final
class Diagnostic:
    """A message about a script, a scenario or a command.

    Lines and columns count from 1; the end is exclusive. The code is one of the compiler, such as
    "E0201", or of a run-time error, such as "R0001". A message about a call has no place.
    """

    @property
    def severity(self) -> Literal["error", "warning"]: ...
    @property
    def code(self) -> str | None: ...
    @property
    def message(self) -> str: ...
    @property
    def label(self) -> str | None: ...
    @property
    def help(self) -> str | None: ...
    @property
    def file(self) -> str | None: ...
    @property
    def line(self) -> int | None: ...
    @property
    def column(self) -> int | None: ...
    @property
    def end_line(self) -> int | None: ...
    @property
    def end_column(self) -> int | None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class LogLine:
    """A line that a script logged: time in seconds, id of the robot, text."""

    @property
    def time(self) -> float: ...
    @property
    def robot(self) -> int: ...
    @property
    def text(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Expectation:
    """An expectation of the scenario and its current outcome. Times are in seconds.

    `first` is the first time at which the condition was true, `since` the time since which it has
    been true without a break, and `against` the first robot that did not pass (id, value).
    """

    @property
    def text(self) -> str: ...
    @property
    def name(self) -> str | None: ...
    @property
    def line(self) -> int: ...
    @property
    def verdict(self) -> Literal["open", "held", "failed"]: ...
    @property
    def first(self) -> float | None: ...
    @property
    def since(self) -> float | None: ...
    @property
    def held_at(self) -> float | None: ...
    @property
    def failed_at(self) -> float | None: ...
    @property
    def against(self) -> tuple[int, float] | None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Script:
    """A compiled script."""

    @property
    def image(self) -> bytes:
        """The image (`.bbi`), which robots run."""

    @property
    def symbols(self) -> dict[str, object]:
        """The content of the symbols (`.sym`): names of globals, strings, places of the code."""

    @property
    def diagnostics(self) -> list[Diagnostic]:
        """The warnings of the compiler."""

    @property
    def profile(self) -> str:
        """The number profile: "tiny" (16 bits) or "full" (32 bits)."""

    @property
    def hash(self) -> int:
        """The hash of the script, which its messages carry."""

def compile(
    source: _Path, *, robot: _Path | None = None, include: Sequence[_Path] = ...
) -> Script:
    """Compiles a script: a text, or the path of a file that ends in `.bzz`.

    `robot` is the name of a robot or the path of a robot file; without one, the script may call
    the functions of all shipped robots, in the profile "full". Included files are searched next to
    the including file, in the folders `include`, and in the library. Raises `ScriptError`.
    """

def check(
    source: _Path, *, robot: _Path | None = None, include: Sequence[_Path] = ...
) -> list[Diagnostic]:
    """Returns the errors and warnings of the compiler about a script."""

def run(
    source: _Path,
    *,
    robot: _Path | None = None,
    steps: int | None = None,
    destroy: bool = False,
    id: int | None = None,
    seed: int | None = None,
    include: Sequence[_Path] = ...,
) -> str:
    """Runs a script on this computer: the global code, `init()`, and `steps` steps (default 0).

    Returns its log, with a line for each call of a robot function, such as `led(3)`. `destroy`
    calls `destroy()` after the last step. `id` is that of the robot (default 1), and `seed` that of
    its random numbers (default 0). A run-time error raises `RunError`, which has the log until then.
    """

@final
class Scenario:
    """A scenario with its compiled scripts, from which any number of simulations start."""

    @staticmethod
    def load(path: _Path, set: dict[str, Any] | None = None) -> Scenario:
        """Opens a scenario file and compiles its scripts.

        `set` overrides values of the file, as in `{"medium.ir.loss": 0.1}`. Raises `ScenarioError`,
        or `ScriptError` if a script has mistakes.
        """

    @staticmethod
    def parse(
        text: str, folder: _Path | None = None, set: dict[str, Any] | None = None
    ) -> Scenario:
        """Parses the text of a scenario and compiles its scripts, which are relative to `folder`."""

    def start(
        self,
        seed: int | None = None,
        threads: int | None = None,
        *,
        ground: Callable[[npt.NDArray[np.float32]], npt.ArrayLike] | None = None,
        pure: bool = False,
    ) -> Simulation:
        """Starts a simulation: the world before its first tick.

        `seed` is that of the scenario by default. The result does not depend on `threads` (default
        1); 0 uses one per core.

        `ground` is called once per tick with the places of all ground sensors, shape (M, 2),
        float32, in mm, and returns their brightness, shape (M,), 0 (black) to 1 (white). A run with
        it has no commands to replay and no snapshots, unless `pure` declares that the values depend
        on the places alone.
        """

    def view(self, seed: int | None = None, height: int = 640) -> View:
        """Opens the page of `bbz sim --view` in a notebook, with a run of its own.

        It needs anywidget: `pip install "bittybuzz[notebook]"`. `height` is in pixels.
        """

    @property
    def seed(self) -> int:
        """The seed of the scenario."""

    @property
    def duration(self) -> float:
        """The duration of a run in seconds."""

    @property
    def robot_count(self) -> int:
        """The number of robots N, absent ones included."""

@final
class Simulation:
    """A run of a scenario, which advances in ticks of 0.1 s.

    Arrays have a row for each of the N robots, in the order of `ids`. One thread at a time uses a
    simulation; another one gets `Busy`.
    """

    def step(
        self, n: int | None = None, each: Callable[[Simulation], object] | None = None
    ) -> int:
        """Simulates `n` ticks of 0.1 s (default 1), at most to the end of the run.

        Returns the number of ticks. `each` is called with the simulation after each tick, and its
        exceptions end the call. Ctrl-C ends it between two ticks.
        """

    @property
    def time(self) -> float:
        """Seconds since the run began."""

    @property
    def is_over(self) -> bool:
        """True if the duration of the scenario is over."""

    @property
    def seed(self) -> int:
        """The seed of the run."""

    @property
    def ids(self) -> list[int]:
        """The ids of the robots, in the order of the rows of arrays."""

    def poses(self) -> npt.NDArray[np.float32]:
        """Returns the poses of all robots: shape (N, 4); x, y and z in mm, heading in rad.

        A robot that has not joined has NaN.
        """

    def leds(self) -> npt.NDArray[np.uint8]:
        """Returns the colors of the LEDs: shape (N,); 0 (off) to 7 (white).

        The bits are red (1), green (2) and blue (4). A robot that has not joined has 0.
        """

    def read(self, quantity: str) -> npt.NDArray[np.float64]:
        """Returns a quantity of all robots: shape (N,), or shape (1,) for one of the swarm.

        The quantities and their units are those of `plot` in scenarios, such as "global.hops". NaN
        stands for a value that is no number, and for a robot that has not joined.
        """

    def write(self, quantity: str, values: npt.ArrayLike) -> None:
        """Sets a global, such as "global.hops", in the scripts of all robots before the next tick.

        `values` is one number, or an array of shape (N,). Integers stay integers, and floats stay
        floats, as scripts distinguish them. NaN leaves the value of a robot as it is. The change is
        a command of the run.
        """

    def command(self, text: str) -> None:
        """Gives a command, which acts before the next tick: an `[[event]]` without `at`."""

    @property
    def commands(self) -> str:
        """All commands as `[[event]]`s. A scenario that ends with this text replays the run."""

    def stigmergy(self, robot: int) -> dict[int, dict[int | float | str, int | float | str]]:
        """Returns the stigmergies that the robot with an id knows, by their numbers.

        A table or function in them is described by a text, such as "[table]".
        """

    def snapshot(self) -> Snapshot:
        """Returns a copy of the state, to which `restore` returns."""

    def restore(self, snapshot: Snapshot) -> None:
        """Returns to a snapshot of this simulation, or of another one of the same scenario."""

    def digest(self) -> str:
        """Returns the digest of the run, 16 hexadecimal digits: that of `bbz sim --json`.

        Runs that went the same way have the same digest.
        """

    def record(self, path: _Path) -> Recording:
        """Begins a recording of this run, which `bbz sim --view` shows.

        It has samples at the interval of the scenario, and gets its name when it is closed: use it
        in a `with` statement.
        """

    def history(
        self, *quantities: str, every: float | None = None
    ) -> dict[str, npt.NDArray[np.float64]]:
        """Returns quantities from the beginning of the run to now, sampled every `every` seconds.

        The dictionary has the times in s as "time", shape (T,), and each quantity by its name,
        shape (T, N), or (T, 1) for one of the swarm. The run is repeated for this, so quantities
        need not be chosen before. `every` is the interval of the scenario by default.
        """

    def plot(self, quantity: str | None = None, every: float | None = None) -> Picture:
        """Draws a quantity from the beginning of the run to now, sampled every `every` seconds.

        Without a quantity it is the first one of `[output] plot` in the scenario. More than 50
        robots are shown by their median, quartiles and extremes.
        """

    def picture(self) -> Picture:
        """Draws the world and its robots, filled with the color of their LEDs, from above."""

    def movie(self, seconds: float, every: float = 0.5, speed: float = 1.0) -> Picture:
        """Simulates `seconds`, at most to the end, and draws the world every `every` seconds.

        Returns a picture that moves, `speed` times as fast as the robots.
        """

    def view(self, height: int = 640) -> View:
        """Opens the page of `bbz sim --view` in a notebook, with a run of its own from now on.

        It needs anywidget: `pip install "bittybuzz[notebook]"`. `height` is in pixels.
        """

    def logs(self) -> list[LogLine]:
        """Returns the lines that scripts logged since the last call, at most the last 100,000."""

    def measures(self) -> dict[str, float | None]:
        """Returns each `[[measure]]` of the scenario by its name, as it is now.

        `None` stands for a time that was not reached yet, and for a number that does not exist.
        """
    def expectations(self) -> list[Expectation]:
        """Returns the expectations of the scenario with their current outcomes."""

@final
class Snapshot:
    """A state of a simulation, to which it can return any number of times."""

    @property
    def time(self) -> float:
        """Seconds since the run began."""

@final
class Picture:
    """A drawing as SVG, which notebooks display. That of a movie moves."""

    @property
    def svg(self) -> str:
        """The drawing as a document in SVG."""

    def save(self, path: _Path) -> None:
        """Writes the drawing to a file, whose name ends in `.svg`."""

    def _repr_html_(self) -> str: ...

@final
class Recording:
    """A recording in progress. It is a context manager, which closes itself."""

    def close(self) -> None:
        """Completes the file. A recording that was closed stays as it is."""

    def __enter__(self) -> Recording: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
        /,
    ) -> None: ...
