"""Curves of quantities: panels with a past, their scales, and tables of them."""

import csv
import re

import pytest
from playwright.sync_api import expect
from test_page import SCENARIO, at, go, page, page_with_events, place, robot, session, window

__all__ = ["page", "session", "window"]

# Pixels left and right of the plane (bbz/page/web/curve.js).
LEFT, RIGHT = 48, 18


def panel(page, name):
    return page.get_by_role("region", name=f"{name} over time", exact=True)


def words(page, name):
    return panel(page, name).locator(".words")


def point(page, name, tick):
    """The place on the screen of a tick of a curve."""
    box = panel(page, name).locator(".plot").bounding_box()
    return box["x"] + LEFT + (box["width"] - LEFT - RIGHT) * tick / 600, box["y"] + 40


def table(page, name):
    """The rows of a curve that is saved."""
    with page.expect_download() as download:
        panel(page, name).get_by_role("button", name="CSV").click()
    return download.value.suggested_filename, list(csv.DictReader(download.value.path().read_text().splitlines()))


def known(page, name, tick):
    """Waits until a curve is known at a tick, which the pointer shows."""
    page.mouse.move(*point(page, name, tick))
    expect(words(page, name)).to_contain_text(f"at {tick / 10:.1f} s: ")
    expect(words(page, name)).not_to_contain_text("not known")


def colors(page, name):
    """The number of pixels of a curve's picture that are rather red, and rather green, and the sum of all."""
    return panel(page, name).locator("canvas").evaluate("""async (canvas) => {
        // One curve is drawn with each picture.
        for (let count = 0; count < 12; count++) {
            await new Promise((done) => requestAnimationFrame(done));
        }
        const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
        copy.drawImage(canvas, 0, 0);
        const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
        let [red, green, sum] = [0, 0, 0];
        for (let at = 0; at < data.length; at += 4) {
            sum += at * (data[at] + data[at + 1] + data[at + 2] + data[at + 3]);
            if (data[at + 3] > 40) {
                red += data[at] > data[at + 1] + 40 && data[at] > data[at + 2] + 40;
                green += data[at + 1] > data[at] + 40 && data[at + 1] > data[at + 2] + 20;
            }
        }
        return [red, green, sum];
    }""")


def test_plots_of_the_scenario_open_as_panels(page):
    panels = page.locator(".curve")
    expect(panels).to_have_count(2)
    expect(words(page, "global.n")).to_have_text(re.compile("^at 0.0 s: "))
    panel(page, "neighbors").get_by_role("button", name="Close the curve of neighbors").click()
    expect(panels).to_have_count(1)
    expect(page.locator("#add-curve")).to_be_focused()
    # A panel that is open is not offered, and one that was closed is.
    offered = page.locator("#add-curve option")
    assert "neighbors" in offered.all_inner_texts() and "global.n" not in offered.all_inner_texts()
    for name in ["neighbors", "x", "swarm.spread"]:
        page.locator("#add-curve").select_option(name)
    expect(panels).to_have_count(4)
    expect(panel(page, "x").locator("b")).to_have_text("x in mm")
    for name in ["global.n", "neighbors", "x", "swarm.spread"]:
        panel(page, name).get_by_role("button", name="Close").click()
    expect(page.locator("#curves")).to_be_hidden()


def test_a_curve_that_is_added_late_has_its_past(page):
    go(page, 400)
    page.locator("#add-curve").select_option("y")
    known(page, "y", 30)
    # The pointer is at one time in all panels.
    expect(words(page, "global.n")).to_contain_text("at 3.0 s: median 29")
    page.mouse.move(0, 0)
    expect(words(page, "global.n")).to_contain_text("at 40.0 s: ")
    name, rows = table(page, "y")
    assert (name, len(rows), rows[-1]["time in s"]) == ("y.csv", 401, "40")
    # A click goes there, and the curve stays.
    page.mouse.click(*point(page, "y", 30))
    at(page, 30)
    assert len(table(page, "y")[1]) == 401


def test_a_table_has_the_values_of_robots(page):
    go(page, 40)
    page.mouse.click(*place(page, -30, 0))
    robot(page, 6)
    expect(words(page, "global.n").locator(".mark")).to_have_text("robot 6: 39")
    name, rows = table(page, "global.n")
    # What the scenario expects of robot 6 after 2 s.
    assert (name, rows[20]["time in s"], rows[20]["Robot 6"]) == ("global.n.csv", "2", "19")
    # Robot 7 begins anew after an error in its step 20.
    last = rows[40]
    assert last["max"] == "39" and float(last["min"]) < 39
    page.locator("#add-curve").select_option("swarm.spread")
    known(page, "swarm.spread", 40)
    rows = table(page, "swarm.spread")[1]
    assert list(rows[0]) == ["time in s", "value"] and len(rows) == 41


def test_nothing_that_is_only_shown_otherwise_erases_a_curve(page):
    go(page, 300)
    go(page, 10)
    assert len(table(page, "global.n")[1]) == 301
    page.get_by_label("Messages", exact=True).check()
    page.get_by_label("Color by").select_option("led")
    known(page, "led", 200)
    page.get_by_label("Color by").select_option("steps")
    known(page, "steps", 200)
    # The panel of "Color by" is one.
    expect(panel(page, "led")).to_have_count(0)
    page.get_by_label("Color by").select_option("global.n")
    page.get_by_label("Color by").select_option("state")
    expect(page.locator(".curve")).to_have_count(2)
    assert len(table(page, "global.n")[1]) == 301
    # A run with the same texts goes the same way.
    page.click("#tab-script")
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    known(page, "global.n", 300)
    assert len(table(page, "global.n")[1]) == 301


def test_a_change_erases_what_comes_after_it(page):
    go(page, 300)
    go(page, 80)
    page.mouse.click(*place(page, -30, 0))
    robot(page, 6).get_by_role("button", name="Stop", exact=True).click()
    page.mouse.move(*point(page, "global.n", 200))
    expect(words(page, "global.n")).to_have_text("at 20.0 s: not known")
    assert len(table(page, "global.n")[1]) == 81


def test_curves_of_robots_are_compared(page):
    go(page, 15)
    shown = words(page, "global.n").locator("span")
    page.keyboard.down("Shift")
    for number, x in [(6, -30), (7, 40)]:
        page.mouse.click(*place(page, x, 0))
        expect(shown.last).to_contain_text(f"robot {number}: ")
    page.keyboard.up("Shift")
    # This chooses none of them, and each has a color of its own.
    expect(page.locator("#robot")).to_contain_text("No robot is chosen")
    expect(shown).to_have_count(2)
    assert shown.evaluate_all("all => new Set(all.map((one) => getComputedStyle(one).color)).size") == 2
    # By the panel and by a key, too.
    page.mouse.click(*place(page, -30, 0))
    robot(page, 6)
    button = page.get_by_role("button", name="Compare")
    expect(button).to_have_attribute("aria-pressed", "true")
    button.click()
    expect(button).to_have_attribute("aria-pressed", "false")
    one = words(page, "global.n").locator("span.one")
    expect(one).to_have_count(0)
    page.locator("#canvas").press("c")
    expect(one).to_contain_text("robot 6: ")


def test_scales_show_other_ranges(page):
    go(page, 300)
    known(page, "global.n", 300)
    linear = colors(page, "global.n")
    panel(page, "global.n").locator("select").select_option("logarithmic")
    assert colors(page, "global.n") != linear
    panel(page, "global.n").locator("select").select_option("all values")
    assert colors(page, "global.n") == linear
    panel(page, "global.n").locator("select").select_option("logarithmic")
    # The choice outlives a run from the beginning.
    page.click("#tab-script")
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    expect(panel(page, "global.n").locator("select")).to_have_value("log")


@pytest.mark.parametrize(
    ("kind", "fives", "limits", "low", "high", "ticks"),
    [
        ("all", [[0, 1, 2, 3, 9]], [], 0, 9, [0, 2, 4, 6, 8]),
        ("all", [[0, 1, 2, 3, 9]], [12, 80], 0, 12, [0, 2, 4, 6, 8, 10, 12]),
        ("all", [[4, 4, 4, 4, 4]], [], 3, 5, [3, 3.5, 4, 4.5, 5]),
        # One robot that does not know its distance does not flatten the others.
        ("clipped", [[0, 2, 4, 6, 500]] * 19 + [[500, 500, 500, 500, 500]], [], 0, 8, [0, 2, 4, 6, 8]),
        ("log", [[0, 0, 1, 30, 2000]], [], 1, 2000, [1, 10, 100, 1000]),
        ("log", [[-5, -4, -3, -2, 0]], [], None, None, None),
    ],
)
def test_a_scale_has_round_numbers(page, kind, fives, limits, low, high, ticks):
    found = page.evaluate(
        """async ([kind, fives, limits]) => {
            const { Scale } = await import("./scale.js");
            const scale = new Scale(kind, fives, limits);
            return scale.isKnown ? [scale.low, scale.high, scale.ticks(5)] : [null, null, null];
        }""",
        [kind, fives, limits],
    )
    assert found[:1] == [low] and found[2] == ticks
    assert found[1] == pytest.approx(high) if high else found[1] is None


def test_expectations_are_bands(page):
    page.locator("#add-curve").select_option("faults")
    go(page, 10)
    assert colors(page, "faults")[:2] == [0, 0]
    # "always" is decided at the end.
    go(page, 600)
    expect(page.locator("#marks .held")).to_have_count(2)
    assert colors(page, "faults")[1] > 1000


def test_the_computation_of_the_past_is_shown_and_stopped(browser, session):
    page, send = page_with_events(browser, session)
    bar = page.locator("#curve-bar")
    # The session has sent all that it knows.
    expect(words(page, "global.n")).to_have_text("at 0.0 s: none")
    expect(bar).to_be_hidden()
    send({"event": "series_progress", "percent": 34, "problem": None})
    expect(bar).to_contain_text("The past of the curves is computed: 34 %.")
    bar.get_by_role("button", name="Stop").click()
    expect(bar).to_contain_text("is known to 34 %.")
    bar.get_by_role("button", name="Go on").click()
    # The session knows all of it.
    expect(bar).to_be_hidden()
    send({"event": "series_progress", "percent": 10, "problem": "the session began at tick 20"})
    expect(bar).to_have_text(re.compile("The past of the curves is not known: the session began at tick 20."))
    expect(bar.get_by_role("button")).to_have_count(0)
    page.close()
