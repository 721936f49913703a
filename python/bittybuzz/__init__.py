"""Swarms of robots that run Buzz scripts: the compiler and the simulator of BittyBuzz.

One tick of the simulator is 0.1 s. Arrays have a row for each robot, in the order of the scenario.
"""

from ._bittybuzz import (
    Diagnostic,
    Expectation,
    LogLine,
    Picture,
    Recording,
    Scenario,
    Script,
    Simulation,
    Snapshot,
    check,
    compile,
    run,
)
from ._errors import (
    Busy,
    Defect,
    Error,
    NotReplayable,
    RobotError,
    RunError,
    ScenarioError,
    ScriptError,
)
from ._sweep import sweep

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
