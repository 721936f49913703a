"""Exceptions of the module. Their names belong to the package."""

# Checkers of types know this name. The module `typing` takes longer to import than all others here.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from . import Diagnostic


class Error(Exception):
    """The base of all exceptions of this module."""

    __module__ = "bittybuzz"

    #: The mistakes, each with its place and help; empty for exceptions about calls.
    diagnostics: "tuple[Diagnostic, ...]" = ()


class ScenarioError(Error):
    """A scenario, a command or a quantity has mistakes."""

    __module__ = "bittybuzz"


class ScriptError(Error):
    """A script has mistakes, which the compiler has found. `diagnostics` includes warnings."""

    __module__ = "bittybuzz"


class RobotError(Error):
    """No robot has that name, or a robot file has mistakes."""

    __module__ = "bittybuzz"


class RunError(Error):
    """A script that `run` executes has a run-time error."""

    __module__ = "bittybuzz"

    #: The lines that the script logged until then.
    log: str = ""


class Busy(Error):
    """The simulation is in use: by another thread, or by a tick that calls this code."""

    __module__ = "bittybuzz"


class NotReplayable(Error):
    """The run depends on a callback that may return other values each time."""

    __module__ = "bittybuzz"


class Defect(Error):
    """A defect of BittyBuzz. The simulation in which it happened cannot be used any more."""

    __module__ = "bittybuzz"
