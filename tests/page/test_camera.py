"""The camera: fingers, obstacles in 3-D, and the trails that follow it."""

import base64
import math

from playwright.sync_api import expect
from test_site import choose, page, painted, site  # noqa: F401

# Counts the pixels in which two pictures differ.
DIFFERENCE = """async (pictures) => {
    const [one, other] = await Promise.all(pictures.map(async (picture) => {
        const image = await createImageBitmap(await (await fetch(picture)).blob());
        const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
        context.drawImage(image, 0, 0);
        return context.getImageData(0, 0, image.width, image.height).data;
    }));
    return one.reduce((sum, part, at) => sum + (at % 4 === 0 && Math.abs(part - other[at]) > 8), 0);
}"""


def picture(page):  # noqa: F811
    painted(page)
    taken = page.locator("#canvas").screenshot(animations="disabled")
    return "data:image/png;base64," + base64.b64encode(taken).decode()


def difference(page, one, other):  # noqa: F811
    return page.evaluate(DIFFERENCE, [one, other])


def play_until(page, seconds):  # noqa: F811
    page.click("#play")
    page.wait_for_function("least => parseFloat(document.getElementById('clock').textContent) >= least", arg=seconds)
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Play")


class Fingers:
    """Fingers on the screen: places in pixels of the page."""

    def __init__(self, page):  # noqa: F811
        self.page = page
        self.session = page.context.new_cdp_session(page)

    def send(self, kind, places):
        points = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)]
        self.session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def drag(self, ways):
        """The way of each finger, a list of places; all ways are equally long. Returns once the page is painted.

        The browser cancels touches that a busy page does not answer, as one that still paints the last drag.
        """
        self.send("touchStart", [way[0] for way in ways])
        for places in zip(*ways):
            self.send("touchMove", places)
        self.send("touchEnd", [])
        painted(self.page)


def arc(middle, radius, start, turn, parts=12):
    """A way around a place, with angles in degrees, clockwise on the screen."""
    angles = [math.radians(start + turn * part / parts) for part in range(parts + 1)]
    return [(middle[0] + radius * math.cos(angle), middle[1] + radius * math.sin(angle)) for angle in angles]


def test_two_fingers_zoom_and_turn(page):  # noqa: F811
    choose(page, "examples/swarm/particle_swarm.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    fingers, middle = Fingers(page), (500, 400)
    line = page.locator("#bar").evaluate_handle("bar => bar")
    mm = lambda: int(page.locator("#bar-text").inner_text().split()[0]) / line.bounding_box()["width"]  # noqa: E731
    before = mm()
    fingers.drag([[(500 - 50 - 5 * part, 400) for part in range(11)], [(500 + 50 + 5 * part, 400) for part in range(11)]])
    assert math.isclose(before / mm(), 2, rel_tol=0.05), "twice as far apart, twice as large"
    # Fingers that meet leave a world, which is as large as before once they are as far apart again.
    before = mm()
    fingers.drag([[(500 - away, 400) for away in [60, 0, 60]], [(500 + away, 400) for away in [60, 0, 60]]])
    assert math.isclose(before, mm(), rel_tol=0.05)
    # From above, the world is not turned.
    above = picture(page)
    fingers.drag([arc(middle, 100, 0, 90), arc(middle, 100, 180, 90)])
    assert difference(page, above, picture(page)) < 500
    play_until(page, 4)
    page.check("#tilted")
    tilted = picture(page)
    fingers.drag([arc(middle, 100, 0, 90), arc(middle, 100, 180, 90)])
    assert difference(page, tilted, picture(page)) > 5000
    # Three quarters of a turn more, and all is as before; also if the page hears of a few places only.
    for parts in [12, 1, 2]:
        fingers.drag([arc(middle, 100, 0, 90, parts), arc(middle, 100, 180, 90, parts)])
    assert difference(page, tilted, picture(page)) < 1500


def test_a_wheel_turned_without_end_leaves_a_world(page):  # noqa: F811
    choose(page, "examples/swarm/particle_swarm.toml")
    text = page.locator("#bar-text")
    whole = text.inner_text()
    page.mouse.move(500, 400)
    for ways in [(1e6, -1e6), (-1e6, 1e6)]:
        for way in ways:
            page.mouse.wheel(0, way)
            expect(text).not_to_have_text(whole)
            painted(page)
            assert text.inner_text().split()[0].replace(".", "").isdigit(), text.inner_text()
        page.mouse.dblclick(500, 400)
        expect(text).to_have_text(whole)


def picture_with_focus(page):  # noqa: F811
    """A picture of the canvas, which has a frame while it has the focus."""
    page.mouse.move(2, 2)
    page.focus("#canvas")
    page.keyboard.press("Escape")
    return picture(page)


def test_trails_follow_the_camera(page):  # noqa: F811
    choose(page, "examples/swarm/flocking.toml")
    expect(page.locator("#clock")).to_contain_text("0.0 s")
    # Without curves the canvas has the height that the numbers of points below are about.
    closes = page.get_by_role("button", name="Close the curve")
    expect(closes).not_to_have_count(0)
    while closes.count() > 0:
        closes.first.click()
    page.check("#trails")
    play_until(page, 9)
    page.focus("#canvas")
    for _ in range(8):
        page.keyboard.press("+")
    with_trails = picture_with_focus(page)
    page.keyboard.press("ArrowRight")
    assert difference(page, with_trails, picture(page)) > 1000
    page.keyboard.press("ArrowLeft")
    assert difference(page, with_trails, picture(page)) < 50, "painted again as they were"
    page.uncheck("#trails")
    without = picture_with_focus(page)
    assert difference(page, with_trails, without) > 1000
    page.check("#trails")
    # The check mark has some 250 pixels.
    assert difference(page, without, picture_with_focus(page)) < 500, "trails begin where they are asked for"
