"""The world is free of tools, and shows what is so now."""

import base64

import pytest
from playwright.sync_api import expect
from test_editor import write
from test_page import COUNT, SCENARIO, SCRIPT, at, go, page, place, robot, save, session, window

__all__ = ["page", "session", "window"]


def overlaps(one, other):
    return (one["x"] < other["x"] + other["width"] and other["x"] < one["x"] + one["width"]
            and one["y"] < other["y"] + other["height"] and other["y"] < one["y"] + one["height"])


def shot(page, x, y, size=8):
    # The picture is drawn before the next frame.
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    left, top = place(page, x, y)
    return page.screenshot(clip={"x": left - size / 2, "y": top - size / 2, "width": size, "height": size})


@pytest.mark.parametrize("width", [1280, 800, 390])
def test_tools_lie_next_to_the_world(page, width):
    write(page, "# slider: PACE 0..9 step 1\nPACE = 3\n" + SCRIPT)
    page.keyboard.press("Control+Enter")
    expect(page.locator("#controls-of-scripts")).to_be_visible()
    page.click("#tab-robot")
    page.set_viewport_size({"width": width, "height": 800})
    try:
        page.get_by_label("Color by").select_option("global.n")
        go(page, 10)
        world = page.locator("#canvas").bounding_box()
        for part in ["display", "controls-of-scripts", "legend", "bar"]:
            assert not overlaps(page.locator(f"#{part}").bounding_box(), world), part
        assert world["width"] > 300 and world["height"] > 150, world
    finally:
        page.set_viewport_size({"width": 1280, "height": 800})


def test_a_failed_robot_has_no_color_of_a_value_and_no_neighbors(page, browser):
    go(page, 15)
    free = shot(page, 5, 0)
    page.mouse.click(*place(page, 40, 0))
    panel = robot(page, 7)
    expect(panel).to_contain_text("Robot 6")
    assert shot(page, 5, 0) != free
    panel.get_by_role("button", name="Fail", exact=True).click()
    page.click("#step")
    at(page, 16)
    expect(panel.locator(".state")).to_have_text("failed")
    chosen = shot(page, 5, 0)
    page.mouse.click(*place(page, 0, 200))
    expect(panel).to_contain_text("No robot is chosen")
    assert shot(page, 5, 0) == chosen
    page.get_by_label("Color by").select_option("global.n")
    go(page, 20)
    expect(page.locator("#most")).to_be_visible()
    pictures = [base64.b64encode(shot(page, x, -5, 2)).decode() for x in (40, -30)]
    # The page loads nothing, not even a picture; another one may.
    blank = browser.new_page()
    failed, running = (blank.evaluate(COUNT, ["data:image/png;base64," + one, [[0x4A, 0x54, 0x5F]]])[0] for one in pictures)
    blank.close()
    assert (failed, running) == (4, 0)


def test_trials_show_first_what_the_scenario_is_about(page):
    page.click("#tab-tests")
    shown = page.locator("[name=measure]")
    expect(shown).to_have_value("end global.n")
    names = shown.locator("option").all_text_contents()
    assert len(names) == len(set(names)), names


def test_names_of_columns_stay_whole(page):
    page.click("#tab-tests")
    page.fill("[name=values]", "")
    page.locator(".trials").get_by_role("button", name="Start").click()
    heads = page.locator("#trials th")
    expect(heads).to_have_text(["Value", "Trials", "Succeeded", "Median", "Half of them"])
    expect(page.locator("#trials tbody td").nth(1)).to_have_text("5")
    # Each name of one word is in one line.
    lines = heads.evaluate_all("""all => all.map((one) => {
        const range = document.createRange();
        range.selectNodeContents(one);
        return range.getClientRects().length;
    })""")
    assert lines[:4] == [1, 1, 1, 1], lines


@pytest.mark.parametrize("is_open", [False, True], ids=["the editor has only the script", "the editor has the scenario"])
def test_the_seed_is_changed_in_the_world(page, tmp_path, is_open):
    if is_open:
        page.click("#tab-script")
        page.locator("#script-name").select_option("s.toml")
        expect(page.locator("#text .cm-content")).to_contain_text("[world]")
    go(page, 20)
    page.click("#tab-ground")
    seed = page.get_by_label("Seed", exact=True)
    for number in (77, 78):
        expect(seed).not_to_have_value(str(number))
        seed.fill(str(number))
        page.locator("#ground").get_by_role("button", name="Run", exact=True).click()
        # The run has begun, and plays; its beginning is in sight for a moment only.
        expect(page.locator("#play")).to_have_text("Pause")
        page.click("#tab-tests")
        expect(page.locator("#older")).to_be_hidden()
        page.click("#tab-ground")
        expect(seed).to_have_value(str(number))
        go(page, 20)
    # The text has it, once.
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    expect(page.locator("#text .cm-line").nth(1)).to_have_text("seed = 78")
    assert save(page, tmp_path).read_text().startswith(SCENARIO.replace("[world]\n", "[world]\nseed = 78\n"))


def test_a_histogram_shows_how_many_robots_have_which_value(page):
    page.get_by_label("Color by").select_option("x")
    expect(page.locator("#least")).to_have_text("-30")
    bars = page.locator("#histogram b")
    expect(bars).to_have_count(16)
    titles = bars.evaluate_all("(bars) => bars.map((bar) => bar.title)")
    assert [titles[0], titles[1], titles[15]] == ["-30 to -25.63: 1 robot", "-25.63 to -21.25: 0 robots", "35.63 to 40: 1 robot"]
    heights = bars.evaluate_all("(bars) => bars.map((bar) => Math.round(bar.getBoundingClientRect().height))")
    assert heights[0] == heights[15] > 15 and set(heights[1:15]) == {0}
    expect(page.get_by_role("img", name="robots from the least value to the greatest, in 16 equal parts: 1, 0,")).to_be_visible()
    # Equal values have no distribution.
    page.get_by_label("Color by").select_option("y")
    expect(page.locator("#most")).to_have_text("0")
    expect(page.locator("#histogram")).to_be_hidden()
