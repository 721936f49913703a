"""Windows of any size, and a zoom of 200 %, which is a window of half the size."""

import pytest
from conftest import sampled
from playwright.sync_api import expect
from test_editor import text
from test_page import at, go, page, robot, session, window

__all__ = ["page", "session", "window"]

TABS = ["about", "robot", "table", "script", "log", "tests", "ground"]
# Width and height; the last two are a zoom of 200 % of 1280 × 800 and of 1280 × 560.
SIZES = [(1920, 1080), (1280, 560), (390, 844), (390, 560), (640, 400), (640, 280)]


@pytest.fixture
def sized(page, request):
    width, height = request.param
    page.set_viewport_size({"width": width, "height": height})
    yield page
    page.set_viewport_size({"width": 1280, "height": 800})


def height(page, selector):
    box = page.locator(selector).bounding_box()
    return box["height"] if box else 0


@pytest.mark.parametrize("sized", sampled(SIZES, [(1920, 1080), (390, 560), (640, 280)].__contains__), indirect=True, ids=lambda size: f"{size[0]}x{size[1]}")
def test_each_part_has_room_and_can_be_reached(sized):
    page = sized
    page.get_by_label("Color by").select_option("global.n")
    go(page, 40)
    page.focus("#canvas")
    page.keyboard.press("n")
    robot(page, 6)
    least = min(160, page.viewport_size["height"] / 2)
    assert height(page, "#canvas") >= least
    # Nothing is wider than the window.
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
    # The tabs are in one row.
    assert len({page.locator(f"#tab-{tab}").bounding_box()["y"] for tab in TABS}) == 1
    for tab in TABS:
        page.click(f"#tab-{tab}")
        assert height(page, f"#{tab}") >= least, tab
        page.locator(f"#{tab}").scroll_into_view_if_needed()
        assert height(page, "#canvas") >= 60, tab
    page.click("#tab-script")
    assert height(page, "#text") >= 90
    page.locator("#text .cm-line", has_text="n = n + 1").click()
    page.keyboard.type("# typed")
    assert "# typed" in text(page)
    # The time is in sight, and the controls can be pressed.
    expect(page.locator("#time")).to_be_in_viewport()
    page.click("#step")
    at(page, 41)
    page.click("#tab-robot")
    fail = page.get_by_role("button", name="Fail", exact=True)
    fail.click()
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_have_text("fail = 6")
    page.click("#build-mode")
    page.locator("#things").select_option("Robot 6")
    assert height(page, "#canvas") >= 60
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
    page.get_by_label("x in mm", exact=True).fill("-40")
    page.keyboard.press("Enter")
    expect(page.locator("#build").get_by_role("button", name="Undo", exact=True)).to_be_enabled()
    page.click("#build-done")
    expect(page.locator("#build")).to_be_hidden()
