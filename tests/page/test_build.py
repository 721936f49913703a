"""A world that is built by hand: each act of the mouse or of a key is an edit of the scenario's text."""

import difflib
import re
import signal

import pytest
from playwright.sync_api import expect
from test_page import SCENARIO, at, digest, drag, go, page, place, save, session, show, simulated, window
from test_page import end as end_session

__all__ = ["page", "session", "window"]

OBSTACLE, LAMP, ROBOTS = "{ at = [300, 200], radius = 20 }", "[-300, -200]", "[[-30, 0], [40, 0]]"
assert all(part in SCENARIO for part in [f"[{OBSTACLE}]", f"[{LAMP}]", ROBOTS])


def build(page):
    """Begins to build, with the scenario in the editor."""
    page.click("#tab-script")
    page.locator("#script-name").select_option("s.toml")
    expect(page.locator("#text .cm-content")).to_contain_text("[world]")
    page.click("#build-mode")
    expect(page.locator("#build")).to_be_visible()
    expect(page.locator("#canvas")).to_be_focused()


def download(page):
    """The text of the scenario in the editor, byte for byte."""
    with page.expect_download() as saved:
        page.click("#write")
    page.focus("#canvas")
    return saved.value.path().read_bytes().decode()


def becomes(page, text):
    """Waits until the scenario has a text."""
    found = download(page)
    for _ in range(300):
        if found == text:
            return
        page.wait_for_timeout(100)
        found = download(page)
    assert found == text, "".join(difflib.unified_diff(text.splitlines(True), found.splitlines(True)))


def keys(page, *names):
    page.focus("#canvas")
    for name in names:
        page.keyboard.press(name)


def click(page, x, y):
    page.mouse.click(*place(page, x, y))


def fields(page):
    """The names and values of the chosen thing."""
    return {one.get_attribute("aria-label"): one.input_value() for one in page.locator("#build .fields input").all()}


def field(page, name):
    return page.locator("#build").get_by_label(name, exact=True)


def chosen(page, name):
    expect(page.locator("#things option:checked")).to_have_text(name)


def things(page):
    return page.locator("#things option").all_inner_texts()[1:]


def test_robots_are_built_with_the_mouse(page):
    build(page)
    assert things(page) == ["Robot 6", "Robot 7", "Disc 1", "Lamp 1"]
    # A click on the tool, and one on the ground; places are whole centimeters.
    page.get_by_role("button", name="Robot", exact=True).click()
    click(page, 101, -98)
    added = SCENARIO.replace(ROBOTS, "[[-30, 0], [40, 0], [100, -100]]").replace("count = 2", "count = 3")
    becomes(page, added)
    chosen(page, "Robot 8")
    expect(page.locator("#announced")).to_have_text("Robot 8")
    assert things(page)[:3] == ["Robot 6", "Robot 7", "Robot 8"]
    # Dragged, with its handle at 90° and back to the robot.
    page.get_by_role("button", name="Choose", exact=True).click()
    drag(page, (40, 0), (142, 61))
    moved = added.replace("[40, 0]", "[140, 60]")
    becomes(page, moved)
    chosen(page, "Robot 7")
    # Turned by the handle, which is above the robot.
    scale = page.evaluate("Math.min(document.getElementById('canvas').clientWidth / 800, document.getElementById('canvas').clientHeight / 600) * 0.94")
    drag(page, (140, 60 + 16.5 + 22 / scale), (220, 60))
    turned = moved.replace("[140, 60]", "[140, 60, 0]")
    becomes(page, turned)
    page.get_by_role("button", name="Copy", exact=True).click()
    copied = turned.replace("count = 3", "count = 4")
    expect(page.locator("#things option:checked")).to_have_text("Robot 9")
    values = fields(page)
    becomes(page, copied.replace("[100, -100]]", f"[100, -100], [{values['x in mm']}, {values['y in mm']}, 0]]"))
    page.get_by_role("button", name="Delete", exact=True).click()
    becomes(page, turned)


def test_robots_are_built_with_the_keyboard(page):
    build(page)
    # The second thing is robot 7: 10 mm to the right and 1 mm up, 15° to the left.
    keys(page, "n", "n")
    chosen(page, "Robot 7")
    keys(page, "ArrowRight", "Shift+ArrowUp", "r")
    changed = SCENARIO.replace("[40, 0]", "[50, 1, 105]")
    becomes(page, changed)
    assert fields(page) == {"x in mm": "50", "y in mm": "1", "direction in degrees": "105"}
    keys(page, "Shift+R", "Shift+R")
    changed = changed.replace("105", "75")
    becomes(page, changed)
    # A copy stands next to it; a second one next to that.
    keys(page, "Control+c", "Control+v")
    expect(page.locator("#things option:checked")).to_have_text("Robot 8")
    keys(page, "Control+v")
    expect(page.locator("#things option:checked")).to_have_text("Robot 9")
    assert len(things(page)) == 6
    keys(page, "Delete", "p", "p")
    chosen(page, "Robot 6")
    keys(page, "Delete")
    expect(page.locator("#things")).to_have_value("")
    built = download(page)
    assert re.search(r"positions = \[\[50, 1, 75\], \[-?\d+, -?\d+, 75\]\]", built), built
    # The tool adds one in the middle of the picture, where it is free.
    keys(page, "2", "Enter")
    chosen(page, "Robot 8")
    assert "count = 3" in download(page)
    # A field changes it exactly.
    field(page, "x in mm").fill("-123.45")
    page.keyboard.press("Tab")
    expect(field(page, "y in mm")).to_be_focused()
    becomes(page, re.sub(r"(, 75\], )\[(-?\d+), (-?\d+)\]\]", r"\1[-123.45, \3]]", download(page)))
    assert "[-123.45, " in download(page)


def test_walls_lamps_and_paint_are_built_with_the_mouse(page):
    build(page)
    keys(page, "3")
    drag(page, (-200, 100), (-100, 200))
    wall = f"[{OBSTACLE}, {{ from = [-200, 100], to = [-100, 200] }}]"
    walls = SCENARIO.replace(f"[{OBSTACLE}]", wall)
    becomes(page, walls)
    chosen(page, "Wall 2")
    keys(page, "7")
    click(page, 200, -200)
    lamps = walls.replace(f"[{LAMP}]", f"[{LAMP}, {{ at = [200, -200], brightness = 1023 }}]")
    becomes(page, lamps)
    keys(page, "8")
    drag(page, (250, 100), (150, 50))
    paint = "\nground = [{ at = [200, 75], size = [100, 50], brightness = 0 }]\n"
    painted = lamps.replace("brightness = 1023 }]\n", f"brightness = 1023 }}]{paint}")
    becomes(page, painted)
    assert things(page)[2:] == ["Disc 1", "Wall 2", "Lamp 1", "Lamp 2", "Paint 1"]
    # Dragged: the wall as a whole and by an end, the box of paint by its corner, the lamp and the disc.
    keys(page, "1")
    drag(page, (-150, 150), (-160, 170))
    painted = painted.replace("from = [-200, 100], to = [-100, 200]", "from = [-210, 120], to = [-110, 220]")
    becomes(page, painted)
    drag(page, (-110, 220), (-110, 270))
    painted = painted.replace("to = [-110, 220]", "to = [-110, 270]")
    becomes(page, painted)
    click(page, 200, 75)
    chosen(page, "Paint 1")
    drag(page, (250, 100), (262, 108))
    painted = painted.replace("size = [100, 50]", "size = [120, 70]")
    becomes(page, painted)
    drag(page, (-300, -200), (-250, -150))
    painted = painted.replace(LAMP, "[-250, -150]")
    becomes(page, painted)
    drag(page, (300, 200), (320, 220))
    painted = painted.replace("[300, 200]", "[320, 220]")
    becomes(page, painted)
    drag(page, (340, 220), (370, 220))
    painted = painted.replace("radius = 20", "radius = 50")
    becomes(page, painted)
    # Away with all but the robots.
    for place_, name in [((-160, 195), "Wall 2"), ((200, -200), "Lamp 2"), ((200, 75), "Paint 1"), ((320, 220), "Disc 1"), ((-250, -150), "Lamp 1")]:
        click(page, *place_)
        chosen(page, name)
        page.get_by_role("button", name="Delete", exact=True).click()
        expect(page.locator("#things")).to_have_value("")
    assert things(page) == ["Robot 6", "Robot 7"]
    bare = SCENARIO.replace(f"[{OBSTACLE}]", "[]").replace(f"[{LAMP}]", "[]\nground = []")
    becomes(page, bare)


def test_walls_lamps_and_paint_are_built_with_the_keyboard(page):
    build(page)
    # Away from the robots: the picture is moved up before.
    keys(page, *["ArrowUp"] * 2, "3", "Enter")
    chosen(page, "Wall 2")
    values = fields(page)
    y = int(values["first end: y in mm"])
    assert values == {"first end: x in mm": "-100", "first end: y in mm": str(y), "second end: x in mm": "100", "second end: y in mm": str(y)}
    text = SCENARIO.replace(f"[{OBSTACLE}]", f"[{OBSTACLE}, {{ from = [-100, {y}], to = [100, {y}] }}]")
    becomes(page, text)
    keys(page, "ArrowLeft", *["r"] * 6)
    text = text.replace(f"from = [-100, {y}], to = [100, {y}]", f"from = [-10, {y - 100}], to = [-10, {y + 100}]")
    becomes(page, text)
    keys(page, "Control+d")
    chosen(page, "Wall 3")
    keys(page, "Backspace")
    becomes(page, text)
    keys(page, "7", "Enter")
    chosen(page, "Lamp 2")
    field(page, "brightness").fill("500")
    page.keyboard.press("Enter")
    text = text.replace(f"[{LAMP}]", f"[{LAMP}, {{ at = [0, {y}], brightness = 500 }}]")
    becomes(page, text)
    # A lamp has no direction.
    keys(page, "r")
    expect(page.locator("#status")).to_have_text("It has no direction.")
    keys(page, "8", "Enter", "R")
    chosen(page, "Paint 1")
    text = text.replace("brightness = 500 }]", f"brightness = 500 }}]\nground = [{{ at = [0, {y}], size = [100, 100], brightness = 0, heading = 345 }}]")
    becomes(page, text)
    page.locator("#things").select_option("Lamp 1")
    keys(page, "ArrowUp", "Control+c", "Control+v")
    chosen(page, "Lamp 3")
    text = text.replace(f"[{LAMP}, ", "[[-300, -190], ").replace("500 }]", "500 }, [-280, -210]]")
    becomes(page, text)


def test_boxes_discs_and_pucks_are_built_with_the_mouse(page):
    build(page)
    keys(page, "4")
    drag(page, (-200, 200), (-100, 120))
    box = "{ at = [-150, 160], size = [100, 80] }"
    becomes(page, SCENARIO.replace(OBSTACLE, f"{OBSTACLE}, {box}"))
    chosen(page, "Box 2")
    keys(page, "5")
    # A drag leads from the center to the rim, and a click makes the usual size.
    drag(page, (200, -200), (230, -160))
    disc = "{ at = [200, -200], radius = 50 }"
    becomes(page, SCENARIO.replace(OBSTACLE, f"{OBSTACLE}, {box},\n  {disc}"))
    chosen(page, "Disc 3")
    page.get_by_role("button", name="Puck", exact=True).click()
    click(page, 0, -150)
    chosen(page, "Puck 1")
    built = download(page)
    assert re.search(r"\{ at = \[0, -150\], radius = 50, movable = true \}", built), built
    assert things(page)[2:] == ["Disc 1", "Box 2", "Disc 3", "Puck 1", "Lamp 1"]
    # A copy of a puck that was deleted is a puck.
    keys(page, "1", "Control+c", "Delete")
    expect(page.locator("#things")).not_to_contain_text("Puck 1")
    keys(page, "Control+v")
    chosen(page, "Puck 1")
    assert "movable = true" in download(page)


def test_undo_restores_the_text_byte_for_byte(page):
    build(page)
    keys(page, "n", "ArrowRight", "r", "Delete", "n", "Control+d")
    chosen(page, "Robot 7")
    built = download(page)
    steps = [built]
    for _ in range(4):
        keys(page, "Control+z")
        expect(page.locator("#announced")).to_have_text("Undone")
        page.evaluate("document.getElementById('announced').textContent = ''")
        steps.append(download(page))
    assert steps[-1] == SCENARIO and len(set(steps)) == 5
    expect(page.get_by_role("button", name="Undo", exact=True)).to_be_disabled()
    keys(page, "Control+z")
    expect(page.locator("#status")).to_have_text("No change is left to undo.")
    # Redo by both keys and by the button, and undo by its button.
    for key in ["Control+y", "Control+Shift+Z", None, "Control+y"]:
        keys(page, key) if key else page.get_by_role("button", name="Redo", exact=True).click()
        expect(page.locator("#announced")).to_have_text("Done again")
        page.evaluate("document.getElementById('announced').textContent = ''")
    assert download(page) == built
    page.get_by_role("button", name="Undo", exact=True).click()
    becomes(page, steps[1])
    # Another change: nothing is left to be done again.
    keys(page, "n", "ArrowUp")
    expect(page.get_by_role("button", name="Redo", exact=True)).to_be_disabled()


def test_a_refusal_changes_nothing_and_says_why(page):
    build(page)
    drag(page, (40, 0), (300, 200))
    expect(page.locator("#status")).to_contain_text("robot 7 at (300, 200) would stand in an obstacle")
    box = page.locator("#notice-box").bounding_box()
    x, y = place(page, 300, 200)
    assert abs(box["x"] - x) < 500 and abs(box["y"] - y) < 100, "next to the pointer"
    assert download(page) == SCENARIO
    assert fields(page)["x in mm"] == "40"
    # A key says it, too; the next change that is possible takes the message away.
    field(page, "x in mm").fill("-20")
    page.keyboard.press("Enter")
    expect(page.locator("#status")).to_contain_text("overlap")
    field(page, "x in mm").fill("5000")
    page.keyboard.press("Enter")
    expect(page.locator("#status")).to_contain_text("outside the world")
    # A wall in the middle would stand in the robots.
    keys(page, "3", "Enter")
    expect(page.locator("#status")).to_contain_text("would stand in an obstacle")
    assert download(page) == SCENARIO
    keys(page, "1", "ArrowUp")
    becomes(page, SCENARIO.replace("[40, 0]", "[40, 10]"))
    expect(page.locator("#status")).to_have_text("")


def test_the_run_starts_again_and_the_saved_world_has_its_digest(page, tmp_path):
    go(page, 50)
    page.focus("#canvas")
    page.keyboard.press("b")
    at(page, 0)
    expect(page.locator("#status")).to_have_text("The run starts from the beginning.")
    expect(page.locator("#play")).to_have_text("Play")
    page.mouse.move(*place(page, 40, 0))
    drag(page, (40, 0), (100, 50))
    chosen(page, "Robot 7")
    keys(page, "3")
    drag(page, (-200, -100), (200, -100))
    chosen(page, "Wall 2")
    # Played, the world is not built any more.
    page.keyboard.press("Escape")
    page.keyboard.press("Space")
    expect(page.locator("#build")).to_be_hidden()
    page.click("#play")
    go(page, 600)
    shown = digest(page, 600)
    saved = save(page, tmp_path)
    assert "[[-30, 0], [100, 50]]" in saved.read_text() and "from = [-200, -100]" in saved.read_text()
    assert simulated(saved)["digest"] == shown


def test_acts_that_follow_at_once_are_all_carried_out(page):
    build(page)
    drag(page, (40, 0), (100, 50))
    drag(page, (-30, 0), (-100, 50))
    keys(page, "ArrowUp", "7")
    click(page, 200, -200)
    keys(page, "1")
    drag(page, (300, 200), (320, 220))
    moved = SCENARIO.replace(ROBOTS, "[[-100, 60], [100, 50]]").replace("at = [300, 200]", "at = [320, 220]")
    becomes(page, moved.replace(f"[{LAMP}]", f"[{LAMP}, {{ at = [200, -200], brightness = 1023 }}]"))


def test_an_act_that_waits_is_for_the_thing_that_was_chosen(page, session):
    build(page)
    session.send_signal(signal.SIGSTOP)
    drag(page, (-30, 0), (-100, 50))
    keys(page, "ArrowUp")
    page.mouse.move(*place(page, 300, 200))
    page.mouse.down()
    session.send_signal(signal.SIGCONT)
    # The first change and the key are carried out while another thing is held.
    nudged = SCENARIO.replace("[-30, 0]", "[-100, 60]")
    expect(page.locator("#text .cm-content")).to_contain_text("[-100, 60]")
    page.mouse.move(*place(page, 320, 220))
    page.mouse.up()
    becomes(page, nudged.replace("at = [300, 200]", "at = [320, 220]"))


def test_what_was_typed_is_not_lost(page):
    build(page)
    keys(page, "n", "ArrowUp")
    built = SCENARIO.replace("[-30, 0]", "[-30, 10]")
    becomes(page, built)
    page.locator("#text .cm-line", has_text="duration = 60").click()
    page.keyboard.press("End")
    page.keyboard.type(" # typed")
    typed = built.replace("duration = 60", "duration = 60 # typed")
    keys(page, "n", "ArrowUp")
    expect(page.locator("#status")).to_have_text("`s.toml` has not run as it is shown: press Run, then build")
    keys(page, "Control+z")
    expect(page.locator("#status")).to_have_text("The scenario's text was typed in since: undo in the editor.")
    assert download(page) == typed
    # Run plays, which ends building; it goes on from there, and the editor can undo an edit by hand.
    page.click("#run")
    expect(page.locator("#build")).to_be_hidden()
    expect(page.locator("#play")).to_have_text("Pause")
    keys(page, "b")
    expect(page.locator("#build")).to_be_visible()
    keys(page, "n", "n", "ArrowUp")
    becomes(page, typed.replace("[40, 0]", "[40, 10]"))
    page.locator("#text .cm-content").click()
    page.keyboard.press("Control+z")
    assert download(page) == typed


def test_escape_leads_out_step_by_step(page):
    build(page)
    keys(page, "n", "2")
    expect(page.get_by_role("button", name="Robot", exact=True)).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#hint")).to_contain_text("Click where a robot is to stand")
    keys(page, "Escape")
    expect(page.get_by_role("button", name="Choose", exact=True)).to_have_attribute("aria-pressed", "true")
    chosen(page, "Robot 6")
    keys(page, "Escape")
    expect(page.locator("#things")).to_have_value("")
    expect(page.locator("#build")).to_be_visible()
    keys(page, "Escape")
    expect(page.locator("#build")).to_be_hidden()
    expect(page.locator("#build-mode")).to_be_focused()
    expect(page.locator("#hint")).to_contain_text("Click a robot to look into it")
    # Keys have their usual meaning again.
    page.focus("#canvas")
    page.keyboard.press("n")
    expect(page.locator("#name")).to_have_text("6")


def test_the_world_stays_below_the_pointer(page):
    build(page)
    before = page.locator("#canvas").bounding_box()
    for key in ["n", "n", "n", "n", "8", "7", "6", "5", "4", "3", "2", "1"]:
        page.keyboard.press(key)
        assert page.locator("#canvas").bounding_box() == before, key


def test_the_bar_is_reached_with_the_tab_key(page):
    build(page)
    keys(page, "n")
    page.focus("#canvas")
    reached = []
    for _ in range(10):
        page.keyboard.press("Shift+Tab")
        reached.append(page.evaluate("document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent"))
    assert reached[:4] == ["direction in degrees", "y in mm", "x in mm", "things in the world"]
    assert reached[4:] == ["Done", "Delete", "Copy", "⟳", "⟲", "Paint"]


@pytest.fixture
def crowd(tmp_path):
    """Robots at random places, in two groups."""
    (tmp_path / "s.bzz").write_text("function step() { }\n")
    group = "\n[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 20 # many\n"
    text = f"# A crowd.\n[world]\nsize = [800, 600]\nduration = 60\n{group}name = \"a\"\n{group}name = \"b\"\n"
    (tmp_path / "s.toml").write_text(text)
    process = show(tmp_path)
    yield process, text
    end_session(process)


def test_others_stay_when_one_of_a_crowd_is_moved(window, crowd):
    process, text = crowd
    window.problems.clear()
    window.goto(process.url)
    at(window, 0)
    page = window

    def starts():
        """The starts of all robots by their ids."""
        found = {}
        for number in range(40):
            page.locator("#things").select_option(f"robot {number}")
            found[number] = fields(page)
        return found

    build(page)
    before = starts()
    # Not at its place, whatever that is.
    page.locator("#things").select_option("robot 3")
    field(page, "x in mm").fill("380")
    page.keyboard.press("Enter")
    expect(page.locator("#text .cm-content")).to_contain_text("positions = [")
    after = starts()
    near = lambda one, other: all(abs(float(one[key]) - float(other[key])) < 0.2 for key in one)
    assert [number for number in range(40) if not near(before[number], after[number])] == [3]
    built = download(page)
    assert built.startswith("# A crowd.\n[world]\nsize = [800, 600]\nduration = 60\n") and built.count("# many") == 1
    assert all(len(line) <= 100 for line in built.splitlines())
    # Robots are added to the group that is chosen.
    keys(page, "2")
    field(page, "group of new robots").select_option("b")
    keys(page, "Enter")
    chosen(page, "Robot 40")
    # The window has this page until the session ends.
    window.goto("about:blank")
    assert window.problems == []
