"""The compiled part of the module. `LiveSession` and `single_page` serve `bittybuzz.notebook`,
`main` serves `python -m bittybuzz`."""

from typing import final

from bittybuzz import (
    Diagnostic as Diagnostic,
    Expectation as Expectation,
    LogLine as LogLine,
    Picture as Picture,
    Recording as Recording,
    Scenario as Scenario,
    Script as Script,
    Simulation as Simulation,
    Snapshot as Snapshot,
    check as check,
    compile as compile,
    run as run,
)

__all__ = [
    "Diagnostic",
    "Expectation",
    "LiveSession",
    "LogLine",
    "Picture",
    "Recording",
    "Scenario",
    "Script",
    "Simulation",
    "Snapshot",
    "check",
    "compile",
    "main",
    "run",
    "single_page",
]

@final
class LiveSession:
    """A run that pages in frames of a notebook show and control."""

    def receive(self, view: int, text: str) -> None:
        """Takes a message of the frame with that number."""

    def close(self, view: int) -> None:
        """Removes a frame."""

    def next(self) -> tuple[int, dict[str, object], bytes | None] | None:
        """Waits for the next message for a frame: its number, the message, and a sample.

        Returns None once the session was ended.
        """

    def end(self) -> None:
        """Ends the session."""

    def simulation(self) -> Simulation:
        """Returns a copy of the run."""

def main(program: list[str], arguments: list[str]) -> int:
    """Runs the tool `bbz`, once per process. Returns its exit status."""

def single_page() -> str:
    """Returns the page for a frame as HTML."""
