"""Opens the page of a simulation in JupyterLab, plays the run there, and reads it back in the kernel.

Usage: page.py [FOLDER]

FOLDER gets a picture of the notebook.
"""

from __future__ import annotations

import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

import nbformat
from playwright.sync_api import Page, expect, sync_playwright

SCENARIO = """
import bittybuzz

scenario = bittybuzz.Scenario.parse('''
[world]
size = [600, 400]
duration = 600
[[robots]]
robot = "kilobot"
script = "s.bzz"
count = 12
[[file]]
path = "s.bzz"
text = \"\"\"
function step() { forward() led(id % 8) }
\"\"\"
''')
view = scenario.view(height=520)
view
"""

START = "print('the kernel', 'runs')"

READ = "print('simulated', view.simulation().time > 2, view.simulation().poses().shape)"

TOKEN = "test"

# Seconds for a start of JupyterLab or a kernel.
WAIT = 120


def notebook() -> nbformat.NotebookNode:
    """Returns a notebook with the page, and a cell that reads its run."""
    cells = [nbformat.v4.new_code_cell(text.strip()) for text in (START, SCENARIO, READ)]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})


def free_port() -> int:
    """Returns a port that no program uses."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def wait_for(url: str) -> None:
    """Waits until a server answers."""
    deadline = time.monotonic() + WAIT
    while True:
        try:
            urllib.request.urlopen(url, timeout=5).close()
            return
        except (urllib.error.URLError, TimeoutError):
            if time.monotonic() > deadline:
                raise
            time.sleep(0.2)


def listening(pid: int) -> set[int]:
    """Returns the TCP ports at which a process listens."""
    sockets = set()
    for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        try:
            sockets.add(os.readlink(link))
        except FileNotFoundError:
            continue
    ports = set()
    for line in pathlib.Path(f"/proc/{pid}/net/tcp").read_text().splitlines()[1:]:
        fields = line.split()
        if fields[3] == "0A" and f"socket:[{fields[9]}]" in sockets:
            ports.add(int(fields[1].split(":")[1], 16))
    return ports


class Cells:
    """The cells of the notebook."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.inputs = page.locator(".jp-CodeCell .jp-InputArea-editor")
        expect(self.inputs).to_have_count(3, timeout=WAIT * 1000)
        # JupyterLab runs no cell before its kernel is there.
        expect(page.get_by_text("| Idle")).to_be_visible(timeout=WAIT * 1000)

    def run(self, number: int) -> None:
        """Runs a cell."""
        self.inputs.nth(number).click()
        self.page.keyboard.press("Shift+Enter")

    def expect(self, text: str) -> None:
        """Waits until a cell has printed a text."""
        expect(self.page.get_by_text(text)).to_be_visible(timeout=WAIT * 1000)


def play(page: Page, picture: pathlib.Path | None) -> None:
    """Plays a run in its page."""
    frame = page.frame_locator("iframe[title=BittyBuzz]")
    expect(frame.locator("#play")).to_be_visible(timeout=WAIT * 1000)
    frame.locator("#play").click()
    expect(frame.locator("#clock")).to_contain_text(re.compile(r"[3-9]\.\d"), timeout=WAIT * 1000)
    if picture is not None:
        page.screenshot(path=picture / "notebook.png")


def main(picture: pathlib.Path | None) -> None:
    """Starts JupyterLab with a notebook and plays it."""
    with tempfile.TemporaryDirectory() as folder:
        nbformat.write(notebook(), pathlib.Path(folder) / "page.ipynb")
        port = free_port()
        options = [f"--port={port}", "--no-browser", "--allow-root", f"--IdentityProvider.token={TOKEN}"]
        lab = subprocess.Popen([sys.executable, "-m", "jupyterlab", *options], cwd=folder, stderr=subprocess.DEVNULL)
        try:
            url = f"http://localhost:{port}"
            wait_for(f"{url}/api?token={TOKEN}")
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(
                    executable_path=shutil.which("chromium-headless-shell"),
                    args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
                )
                page = browser.new_page(viewport={"width": 1280, "height": 900})
                page.goto(f"{url}/lab/tree/page.ipynb?token={TOKEN}")
                cells = Cells(page)
                cells.run(0)
                cells.expect("the kernel runs")
                [kernel] = kernels(lab.pid)
                before = listening(kernel)
                cells.run(1)
                play(page, picture)
                cells.run(2)
                cells.expect("simulated True (12, 4)")
                after = listening(kernel)
                browser.close()
            assert after == before, f"the kernel also listens at {sorted(after - before)}"
            print("the page plays in JupyterLab without a port of its own")
        finally:
            lab.terminate()
            lab.wait()


def kernels(pid: int) -> list[int]:
    """Returns the processes of kernels that a process has started."""
    children = pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in children if b"ipykernel" in pathlib.Path(f"/proc/{child}/cmdline").read_bytes()]


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None)
