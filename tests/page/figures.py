"""Measures the page by the clock of this computer, and prints the figures next to their limits.

Usage: figures.py BBZ, with the folder tests/page in PYTHONPATH and a browser as for the tests.

Nothing else should run. Without a graphics card, the processor computes WebGL in another process of the browser; with the flag
of the tests against that, reading the picture back counts for the page's main thread, so this figure is measured without it.
"""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

from conftest import sync_playwright

# Each figure is the median of so many measurements.
REPEATS = 5

# Limits in milliseconds.
FIRST_PICTURE_MAX, EDIT_MAX, PICTURE_MAX = 2000, 300, 6

# A crowd in columns of 100 that are all in motion.
CROWD = """
[world]
size = [13000, 7000]
duration = 600

[[robots]]
robot = "kilobot"
script = "crowd.bzz"
count = 20000
placement = "grid"
columns = 200
spacing = 60
"""

SCRIPT = """
n = 0
function step() {
  n = n + 1
  led((n / 10 + id) % 8)
  forward()
}
"""

# Seconds of a run in which the time of pictures is measured.
WATCHED = 10


class Run:
    """`bbz sim --view` with a page."""

    def __init__(self, browser, bbz, scenario, state):
        environment = {**os.environ, "XDG_STATE_HOME": state}
        self.start = time.perf_counter()
        self.process = subprocess.Popen([bbz, "sim", scenario, "--view", "--no-browser"], stdout=subprocess.PIPE, text=True, env=environment)
        address = self.process.stdout.readline().strip()
        self.page = browser.new_page(viewport={"width": 1280, "height": 800}, device_scale_factor=1)
        # The number of pictures, and of changes of the time that the page shows.
        self.page.add_init_script("""
            window.pictures = 0;
            const ask = requestAnimationFrame;
            window.requestAnimationFrame = (draw) => ask((now) => { window.pictures += 1; draw(now); });
        """)
        self.page.goto(address)

    def __enter__(self):
        return self.page

    def __exit__(self, *_):
        self.page.close()
        self.process.kill()
        self.process.wait()


def waits_for(page, condition):
    """Waits until a condition holds in a picture, and until the next one."""
    page.wait_for_function(f"() => {condition} && new Promise((shown) => requestAnimationFrame(() => requestAnimationFrame(() => shown(true))))")


def first_picture(browser, bbz, state):
    """Milliseconds from the command to the first picture of a lesson."""
    run = Run(browser, bbz, "examples/lessons/hops.toml", state)
    with run as page:
        waits_for(page, "document.getElementById('clock').textContent !== ''")
        return (time.perf_counter() - run.start) * 1000


def edit(browser, bbz, state):
    """Milliseconds from Ctrl + Enter to a picture of the robots that run the new text."""
    with Run(browser, bbz, "examples/lessons/hops.toml", state) as page:
        waits_for(page, "document.getElementById('clock').textContent !== ''")
        page.click("#tab-script")
        page.locator("#text .cm-content").click()
        page.keyboard.insert_text("# Changed.\n")
        page.evaluate("""() => {
            const began = () => document.getElementById("script-status").textContent !== "";
            addEventListener("keydown", () => {
                const start = performance.now();
                const clock = document.getElementById("clock").textContent;
                const look = () => {
                    if (began() && document.getElementById("clock").textContent !== clock) {
                        window.took = performance.now() - start;
                    } else {
                        requestAnimationFrame(look);
                    }
                };
                look();
            }, { capture: true, once: true });
        }""")
        page.keyboard.press("Control+Enter")
        page.wait_for_function("() => window.took")
        return page.evaluate("window.took")


def crowd(browser, bbz, state):
    """Milliseconds that the main thread of the page is busy for each picture of 20,000 robots."""
    with open(os.path.join(state, "crowd.toml"), "w") as file:
        file.write(CROWD)
    with open(os.path.join(state, "crowd.bzz"), "w") as file:
        file.write(SCRIPT)
    with Run(browser, bbz, os.path.join(state, "crowd.toml"), state) as page:
        waits_for(page, "document.getElementById('clock').textContent !== ''")
        metrics = page.context.new_cdp_session(page)
        metrics.send("Performance.enable")

        def now():
            values = {one["name"]: one["value"] for one in metrics.send("Performance.getMetrics")["metrics"]}
            return values["TaskDuration"], page.evaluate("window.pictures")

        page.click("#play")
        waits_for(page, "!document.getElementById('clock').textContent.startsWith('0.0')")
        busy, pictures = now()
        time.sleep(WATCHED)
        after, more = now()
        return (after - busy) * 1000 / max(1, more - pictures)


def main(bbz):
    figures = [("first picture", first_picture, FIRST_PICTURE_MAX), ("edit to running", edit, EDIT_MAX), ("picture of 20,000 robots", crowd, PICTURE_MAX)]
    print(f"{'':<26}{'median':>10}{'least':>10}{'most':>10}{'limit':>10}")
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as state:
        program = shutil.which(os.environ.get("CHROMIUM", "chromium-headless-shell"))
        flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=program, args=flags)
        for name, measure, limit in figures:
            took = [measure(browser, bbz, state) for _ in range(REPEATS)]
            print(f"{name:<26}{statistics.median(took):>7.1f} ms{min(took):>7.1f} ms{max(took):>7.1f} ms{limit:>7} ms", flush=True)
        browser.close()


main(sys.argv[1])
