"""The tool `bbz` as `python -m bittybuzz`."""

import os
import shutil
import signal
import sys

from ._bittybuzz import main


def bbz() -> int:
    """Runs the tool with the arguments of this process. Returns its exit status."""
    return _run([_word(os.path.abspath(sys.argv[0]))])


def _word(path: str) -> str:
    """The word that starts a program from any folder: its name, if the shell finds it by that."""
    name = os.path.basename(path)
    return name if shutil.which(name) == path else path


def _run(program: list[str]) -> int:
    # The tool finishes its files after Ctrl-C, or ends at once where there is nothing to finish.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return main(program, sys.argv[1:])


if __name__ == "__main__":
    sys.exit(_run([_word(sys.executable), "-m", "bittybuzz"]))
