"""Runs notebooks of the book and compares their figures with those that they have.

Usage: run.py [--write] NOTEBOOK...

A figure is a line that a cell prints; pictures depend on the version of the library that draws them.
`--write` stores the new outputs instead, pictures included.
"""

from __future__ import annotations

import difflib
import pathlib
import sys
import tempfile

import nbclient
import nbformat


def printed(notebook: nbformat.NotebookNode) -> list[str]:
    """Returns the lines that the cells print."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    texts = [output.text for output in outputs if output.output_type == "stream" and output.name == "stdout"]
    return "".join(texts).splitlines()


def carry_out(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Returns the notebook with the outputs of a run in an empty folder."""
    new = nbformat.from_dict(notebook)
    with tempfile.TemporaryDirectory() as folder:
        client = nbclient.NotebookClient(
            new, timeout=1800, kernel_name="python3", resources={"metadata": {"path": folder}}
        )
        client.execute()
    for cell in new.cells:
        # Times of the run, and colors of the terminal.
        cell.metadata.clear()
        for output in cell.get("outputs", []):
            if output.output_type == "stream" and output.name == "stderr":
                raise SystemExit(f"a cell warns:\n{cell.source}\n{output.text}")
    return new


def main(arguments: list[str]) -> int:
    """Returns 1 if a notebook prints something else than it has stored."""
    names = [name for name in arguments if name != "--write"]
    has_failed = False
    for name in names:
        path = pathlib.Path(name)
        old = nbformat.read(path, as_version=4)
        new = carry_out(old)
        if "--write" in arguments:
            path.write_text(nbformat.writes(new) + "\n")
            continue
        difference = list(difflib.unified_diff(printed(old), printed(new), "stored", "printed", lineterm=""))
        if difference or not printed(old):
            has_failed = True
            print(f"{name}: other figures", *difference, sep="\n")
        else:
            print(f"{name}: {len(printed(old))} lines as stored")
    return int(has_failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
