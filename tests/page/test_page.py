"""The page of `bbz sim --view` in a browser: Debian's Chromium, through Playwright.

BBZ names the program.
"""

import base64
import functools
import json
import math
import os
import re
import select
import signal
import subprocess
import urllib.error
import urllib.request
import xml.etree.ElementTree

import pytest
from conftest import note_problems
from playwright.sync_api import expect

pytestmark = pytest.mark.sample

# In its first step robot 7 receives nothing yet, later messages of robot 6. Its step 20 divides by zero.
SCRIPT = """\
n = 0
t = {.a = 1, .deep = {.b = 2}}
function init() {
  s = swarm.create(3)
  s.join()
  v = stigmergy.create(2)
}
function step() {
  n = n + 1
  if(id == 7 and n == 5) { log("n is ", n) v.put(1, 40) }
  if(id == 7 and n == 20) led(n / 0)
  neighbors.broadcast("n", n)
  led(n % 8)
}
"""

SCENARIO = """\
[world]
size = [800, 600]
duration = 60
obstacles = [{ at = [300, 200], radius = 20 }]
lights = [[-300, -200]]

[[robots]]
robot = "kilobot"
script = "s.bzz"
count = 2
first_id = 6
positions = [[-30, 0], [40, 0]]
heading = 90
clock_skew = 0

[[event]]
at = 30
light = [[0, -100]]

[output]
plot = ["global.n", "neighbors"]

[[expect]]
at = 2
robots = 6
value = "global.n"
equals = 19

[[expect]]
always = [0, 60]
value = "faults"
between = [0, 9]
"""


# Seconds that a program may take on a busy computer.
SECONDS_MAX = 120


def bbz(*arguments):
    return [os.environ["BBZ"], *arguments]


def address(process):
    """The address of the page, which a program prints first."""
    printed, _, _ = select.select([process.stdout], [], [], SECONDS_MAX)
    assert printed, f"no address after {SECONDS_MAX} s"
    return process.stdout.readline().strip()


def show(folder, *options):
    """Starts a run with its page."""
    command = bbz("sim", "s.toml", "--view", "--no-browser", *options)
    # Texts that are not saved are kept in the folder.
    environment = {**os.environ, "XDG_STATE_HOME": str(folder / "state")}
    # A process that nohup started ignores the signal, and so would its children.
    hang_up = functools.partial(signal.signal, signal.SIGHUP, signal.SIG_DFL)
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True, env=environment, preexec_fn=hang_up)
    process.url = address(process)
    process.folder = folder
    return process


def end(process):
    process.kill()
    process.wait(timeout=SECONDS_MAX)


@pytest.fixture
def session(tmp_path, request):
    """A run with its page; a test may give it more options."""
    (tmp_path / "s.bzz").write_text(SCRIPT)
    (tmp_path / "s.toml").write_text(SCENARIO)
    process = show(tmp_path, *getattr(request, "param", []))
    yield process
    end(process)


@pytest.fixture(scope="session")
def window(browser):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.problems, page.hosts = [], set()
    # A page with changes asks before it is left.
    page.on("dialog", lambda dialog: dialog.accept())
    note_problems(page, page.problems)
    page.on("request", lambda request: page.hosts.add(request.url.split("/")[2]))
    return page


@pytest.fixture
def page(window, session):
    window.problems.clear()
    window.hosts.clear()
    window.goto(session.url)
    at(window, 0)
    yield window
    # The answer to the last request has come when the socket is closed.
    window.goto("about:blank")
    assert window.problems == []
    assert window.hosts == {session.url.split("/")[2]}, "no request to any other host"


def at(page, tick):
    """Waits until the page shows a tick."""
    expect(page.locator("#clock")).to_have_text(f"{tick / 10:.1f} s of 60.0 s")


def go(page, tick):
    page.locator("#time").fill(str(tick))
    at(page, tick)


def place(page, x, y):
    """The place on the screen of a place in the world, in mm: the view shows all of it."""
    box = page.locator("#canvas").bounding_box()
    scale = min(box["width"] / 800, box["height"] / 600) * 0.94
    return box["x"] + box["width"] / 2 + x * scale, box["y"] + box["height"] / 2 - y * scale


def drag(page, start, end):
    page.mouse.move(*place(page, *start))
    page.mouse.down()
    page.mouse.move(*place(page, *end), steps=4)
    page.mouse.up()


def robot(page, number):
    expect(page.locator("#robot h2")).to_have_text(f"Robot {number}")
    return page.locator("#robot")


def value(panel, section, name):
    """The value with a name in a section of a robot's panel."""
    inside = panel.locator("section", has=panel.page.locator("h3", has_text=re.compile(f"^{section}$")))
    line = inside.locator("dl > div", has=panel.page.locator("dt", has_text=re.compile(f"^{re.escape(name)}$")))
    return line.locator("dd").first


def digest(page, tick):
    page.click("#tab-ground")
    page.click("#ask-digest")
    shown = page.locator("#digest")
    expect(shown).to_contain_text(f"at {tick / 10:.1f} s")
    return shown.inner_text().split()[0]


def save(page, folder):
    """Saves the session in a folder that has nothing else."""
    with page.expect_download() as download:
        page.click("#save")
    path = folder / "elsewhere" / download.value.suggested_filename
    download.value.save_as(path)
    assert [one.name for one in path.parent.iterdir()] == ["session.toml"]
    return path


def saved_file(name, text):
    """A script as a saved session has it."""
    return f"\n[[file]]\npath = \"{name}\"\ntext = '''\n{text}'''\n"


def simulated(path):
    """The result of a scenario without the page."""
    result = subprocess.run(bbz("sim", path, "--json"), capture_output=True, text=True, timeout=SECONDS_MAX)
    return json.loads(result.stdout)


def test_only_the_address_with_the_secret_opens(session):
    def status(url):
        try:
            return urllib.request.urlopen(url).status
        except urllib.error.HTTPError as error:
            return error.code

    base, secret = re.fullmatch(r"(http://127\.0\.0\.1:\d+/)([0-9a-f]{32})/", session.url).groups()
    wrong = secret[:-1] + ("0" if secret[-1] != "0" else "1")
    assert status(session.url) == 200
    for path in ["", "main.js", f"{wrong}/", f"{wrong}/main.js", f"{secret}/../s.toml", f"{secret}/s.toml"]:
        assert status(base + path) == 404, path


def test_a_run_plays_and_pauses(page):
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Pause")
    expect(page.locator("#clock")).to_have_text(re.compile(r"^(0\.[5-9]|[1-9])"))
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Play")
    # The answer to the digest comes after the pause, and the run has stayed there.
    page.click("#tab-ground")
    page.click("#ask-digest")
    stopped = re.compile(r"at (\d+\.\d) s")
    expect(page.locator("#digest")).to_have_text(stopped)
    tick = round(10 * float(stopped.search(page.locator("#digest").inner_text())[1]))
    page.click("#step")
    at(page, tick + 1)


def test_a_run_is_played_as_fast_as_it_can_to_its_end(page):
    page.locator("#rate").select_option("as fast as it can")
    page.click("#play")
    at(page, 600)
    expect(page.locator("#status")).to_have_text("The run is over.")
    expect(page.locator("#play")).to_have_text("Play")


def test_the_speed_is_changed_while_it_plays(page):
    page.locator("#rate").select_option("0.1")
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Pause")
    page.locator("#rate").select_option("1000")
    at(page, 600)


def test_the_run_steps_tick_by_tick_and_back(page):
    for tick in (1, 2, 3):
        page.click("#step")
        at(page, tick)
    page.click("#back")
    at(page, 2)
    go(page, 450)
    page.click("#start")
    at(page, 0)


def test_a_step_back_and_forward_gives_the_same_digest(page):
    go(page, 150)
    first = digest(page, 150)
    go(page, 300)
    assert digest(page, 300) != first
    go(page, 150)
    assert digest(page, 150) == first
    go(page, 40)
    go(page, 150)
    assert digest(page, 150) == first


def test_a_click_inspects_a_robot(page):
    go(page, 15)
    page.mouse.click(*place(page, 40, 0))
    panel = robot(page, 7)
    expect(panel).to_contain_text("s.bzz")
    # The first tick is for init.
    expect(value(panel, "Globals", "n")).to_have_text("14")
    expect(value(panel, "Globals", "t").locator("dt", has_text=".deep")).to_have_count(1)
    expect(value(panel, "Neighbors", "Robot 6")).to_contain_text("mm")
    expect(value(panel, "Swarms", "3")).to_have_text("a member")
    expect(value(panel, "Stigmergy 2", "1")).to_have_text("40 by robot 7, clock 1")
    expect(value(panel, "Messages", "to be sent")).to_contain_text("broadcast of 7")
    # Unfolded parts stay unfolded while the run continues.
    deep = panel.locator("details details > summary")
    deep.click()
    expect(panel.locator("dt", has_text=".b")).to_be_visible()
    page.click("#step")
    expect(value(panel, "Globals", "n")).to_have_text("15")
    expect(panel.locator("dt", has_text=".b")).to_be_visible()
    # A click on the ground chooses no robot.
    page.mouse.click(*place(page, 0, 200))
    expect(panel).to_contain_text("No robot is chosen. Click one")


def test_the_last_fault_is_shown_with_its_line(page):
    go(page, 30)
    page.mouse.click(*place(page, 40, 0))
    fault = robot(page, 7).locator(".fault")
    expect(fault).to_contain_text("Error R0005 at 2.0 s: integer division by zero")
    expect(fault.get_by_role("button", name="s.bzz:11, in step")).to_be_visible()
    expect(fault.locator(".value")).to_have_text("n is 20")
    page.mouse.click(*place(page, -30, 0))
    expect(robot(page, 6).locator(".fault")).to_be_hidden()


def test_a_dragged_robot_moves_by_a_command(page):
    drag(page, (-30, 0), (0, 200))
    page.click("#step")
    at(page, 1)
    page.mouse.click(*place(page, 0, 200))
    shown = robot(page, 6).locator(".facts dd", has_text="mm,").inner_text()
    x, y = (float(number) for number in re.match(r"\((.*), (.*)\) mm", shown).groups())
    assert abs(x) < 3 and abs(y - 200) < 3, shown
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_contain_text("move = 6")
    expect(page.locator("#marks .command")).to_have_count(1)


def test_robots_fail_and_are_restarted(page):
    page.click("#step")
    page.mouse.click(*place(page, -30, 0))
    state = robot(page, 6).locator(".state")
    for action, becomes in [("Fail", "failed"), ("Restart", "running"), ("Stop", "stopped"), ("Resume", "running")]:
        page.locator("#robot").get_by_role("button", name=action, exact=True).click()
        page.click("#step")
        expect(state).to_have_text(becomes)
    page.click("#tab-ground")
    texts = page.locator("#ground code").all_inner_texts()
    assert texts == ["fail = 6", "restart = 6", "stop = 6", "resume = 6"]


def test_lamps_and_loss_are_changed(page):
    drag(page, (-300, -200), (-100, -150))
    page.click("#tab-ground")
    expect(page.locator("#ground code")).to_contain_text("light = ")
    page.click("#step")
    lamp = page.get_by_label("lamp 1: x in mm")
    expect(lamp).to_have_value(re.compile("^-(9[89]|10[012])$"))
    # Without a mouse.
    page.get_by_label("lamp 1: brightness, 0 to 1023").fill("500")
    page.get_by_label("lamp 1: brightness, 0 to 1023").press("Enter")
    expect(page.locator("#ground code").nth(1)).to_contain_text("brightness = 500")
    loss = page.get_by_label("share of the messages by ir that get lost")
    loss.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    expect(page.locator("#ground code").last).to_contain_text('loss = 0.03, medium = "ir"')
    # The event of the scenario at 30 s, and its way back.
    go(page, 310)
    page.click("#tab-log")
    page.click("#tab-ground")
    expect(lamp).to_have_value("0")
    go(page, 10)
    expect(lamp).not_to_have_value("0")


def test_a_saved_session_has_the_same_digest(page, tmp_path):
    original = simulated(tmp_path / "s.toml")["digest"]
    go(page, 20)
    page.mouse.click(*place(page, 40, 0))
    robot(page, 7)
    page.get_by_role("button", name="Stop", exact=True).click()
    page.click("#step")
    drag(page, (-30, 0), (-200, 100))
    page.click("#tab-ground")
    page.get_by_label("share of the messages by ir that get lost").fill("40")
    expect(page.locator("#ground code")).to_have_count(3)
    go(page, 600)
    shown = digest(page, 600)
    saved = save(page, tmp_path)
    text = saved.read_text()
    assert text.startswith(SCENARIO + "\n[[event]]\nat = 2\nstop = 7\n\n[[event]]\nat = 2.1\nmove = 6\nto = [")
    assert text.endswith('\n[[event]]\nat = 2.1\nloss = 0.4\nmedium = "ir"\n' + saved_file("s.bzz", SCRIPT))
    assert simulated(saved)["digest"] == shown
    assert shown != original


@pytest.mark.parametrize("session", [["--seed", "5", "--set", "medium.ir.loss=0.5"]], indirect=True)
def test_values_of_the_command_line_are_saved(page, tmp_path):
    go(page, 600)
    shown = digest(page, 600)
    saved = save(page, tmp_path)
    assert saved.read_text() == SCENARIO.replace("[[-300, -200]]\n", "[[-300, -200]]\nseed = 5\n") + "\n[medium.ir]\nloss = 0.5\n" + saved_file("s.bzz", SCRIPT)
    assert simulated(saved)["digest"] == shown
    assert shown != simulated(tmp_path / "s.toml")["digest"]


def test_log_lines_faults_and_expectations_are_listed(page):
    page.locator("#rate").select_option("100")
    page.click("#play")
    page.click("#tab-log")
    log = page.locator("#log")
    # The script starts again after its fault, and logs the line once more.
    line = log.locator("p", has_text="n is 5").first
    expect(line).to_contain_text("0.5")
    expect(log.locator(".fault").first).to_contain_text("integer division by zero s.bzz:11, in step")
    log.locator(".fault").first.get_by_role("button", name="Explain").click()
    expect(page.locator("#explanation h2")).to_contain_text("R0005")
    page.locator("#explanation").get_by_role("button").click()
    expect(page.locator("#marks .fault").first).to_be_attached()
    page.click("#tab-tests")
    expect(page.locator("#tests .held").first).to_contain_text("global.n equals 19")
    at(page, 600)
    expect(page.locator("#marks .event")).to_have_count(1)
    # The way back forgets lines, which come again.
    go(page, 0)
    page.click("#tab-log")
    expect(log).to_contain_text("Nothing was logged so far.")
    page.click("#play")
    line.locator("button").click()
    robot(page, 7)


def test_the_keyboard_is_enough(page):
    controls = ["start", "back", "play", "step", "rate", "save", "keys"]
    display = ["color", "add-curve", "messages", "trails", "show-labels", "stop-on-error", "follow", "build-mode", "canvas", "fit-robots", "picture", "drawing"]
    parts = [page.locator(f"#{part}") for part in [*controls, *display, "tab-about", "about"]]
    # Each curve has a scale, a table, and an end.
    curves = page.locator(".curve :is(select, button)")
    expect(curves).to_have_count(6)
    for part in [*parts, *curves.all(), page.locator("#marks > .event"), page.locator("#time")]:
        page.keyboard.press("Tab")
        expect(part).to_be_focused()
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid", part
    page.focus("#canvas")
    page.keyboard.press("n")
    robot(page, 6)
    page.keyboard.press("n")
    robot(page, 7)
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press(".")
    at(page, 1)
    expect(page.locator("#robot .facts")).to_contain_text(", 10.0) mm")
    page.keyboard.press(",")
    at(page, 0)
    page.keyboard.press("Space")
    expect(page.locator("#play")).to_have_text("Pause")
    page.keyboard.press("Space")
    expect(page.locator("#play")).to_have_text("Play")
    page.keyboard.press("Home")
    at(page, 0)
    page.focus("#tab-robot")
    page.keyboard.press("ArrowRight")
    expect(page.locator("#tab-table")).to_be_focused()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#tab-script")).to_be_focused()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#tab-log")).to_be_focused()
    expect(page.locator("#log")).to_be_visible()
    page.keyboard.press("?")
    expect(page.locator("#help")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#help")).to_be_hidden()


def test_robots_are_drawn_where_they_are(page):
    def pictures():
        # Without the name next to a chosen robot.
        for x, y in [(40, 0), (200, 100), (200, -100)]:
            left, top = place(page, x, y)
            yield page.screenshot(clip={"x": left - 4, "y": top - 4, "width": 8, "height": 8})

    page.click("#step")
    at(page, 1)
    before = list(pictures())
    drag(page, (40, 0), (200, 100))
    page.click("#step")
    at(page, 2)
    changed = [old != new for old, new in zip(before, pictures())]
    assert changed == [True, True, False]


def test_messages_and_quantities_are_drawn(page):
    def link():
        left, top = place(page, 5, 0)
        return page.screenshot(clip={"x": left - 4, "y": top - 4, "width": 8, "height": 8})

    def body():
        left, top = place(page, 40, 0)
        return page.screenshot(clip={"x": left - 4, "y": top - 4, "width": 8, "height": 8})

    go(page, 10)
    nothing = link()
    page.get_by_label("Messages", exact=True).check()
    # A message takes a while: some tick of a second brings one from robot to robot.
    for tick in range(11, 21):
        page.click("#step")
        at(page, tick)
        if link() != nothing:
            break
    assert link() != nothing
    page.get_by_label("Messages", exact=True).uncheck()
    page.click("#start")
    go(page, 10)
    assert link() == nothing
    go(page, 80)
    by_state = body()
    page.get_by_label("Color by").select_option("global.n")
    # Robot 7 has restarted in between.
    expect(page.locator("#most")).to_have_text("79")
    assert body() != by_state
    page.get_by_label("Color by").select_option("state")
    expect(page.locator("#legend")).to_be_hidden()


def test_a_jump_shows_the_lines_and_faults_before_it(page):
    page.click("#tab-log")
    log = page.locator("#log")
    expect(log).to_contain_text("Nothing was logged so far")
    go(page, 25)
    expect(log).to_contain_text("n is 5")
    expect(log.locator(".fault")).to_have_count(1)
    expect(page.locator("#marks .fault")).to_have_count(1)
    go(page, 3)
    expect(log).to_contain_text("Nothing was logged so far")
    go(page, 10)
    expect(log).to_contain_text("n is 5")
    expect(log.locator(".fault")).to_have_count(0)
    # A page that is opened again has them, too.
    page.reload()
    at(page, 10)
    page.click("#tab-log")
    expect(log.locator("p", has_text="n is 5")).to_have_count(1)


def test_links_are_cut_off_and_reconnected(page, tmp_path):
    commands = page.locator("#ground code")
    page.mouse.click(*place(page, 40, 0))
    robot(page, 7)
    page.get_by_role("button", name="Cut off").click()
    page.get_by_role("button", name="Reconnect").click()
    page.click("#tab-ground")
    expect(commands).to_have_text(['block = [7, "all"]', 'restore = [7, "all"]'])
    # Robot 6 is on the left of a line that goes up between both.
    page.get_by_role("button", name="Draw a line").click()
    drag(page, (5, -200), (5, 200))
    expect(commands.last).to_have_text("partition = [[6]]")
    page.get_by_role("button", name="Heal").click()
    expect(commands.last).to_have_text("heal = true")
    # Without a mouse.
    page.get_by_label("robots that hear only each other").fill("3..6, 7")
    page.keyboard.press("Enter")
    expect(page.locator("#status")).to_contain_text("3..6")
    page.get_by_label("robots that hear only each other").fill("6..7")
    page.keyboard.press("Enter")
    expect(commands.last).to_have_text('partition = [["6..7"]]')
    go(page, 600)
    shown = digest(page, 600)
    assert simulated(save(page, tmp_path))["digest"] == shown


def test_a_drawing_is_saved(page, tmp_path):
    go(page, 10)
    with page.expect_download() as download:
        page.get_by_role("button", name="Drawing").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    name = "{http://www.w3.org/2000/svg}"
    root = xml.etree.ElementTree.parse(path).getroot()
    assert root.tag == f"{name}svg"
    bodies = [group for group in root.iter(f"{name}g") if group.find(f"{name}title") is not None]
    assert [one.find(f"{name}title").text for one in bodies] == ["6", "7"]
    # The place is that of the scenario, because no robot has moved.
    middle = bodies[0].find(f"{name}circle")
    assert (float(middle.get("cx")), float(middle.get("cy"))) == (-30, 0)
    assert root.find(f"{name}text").text == "200 mm"


PAINTED = [
    "--set", "world.lights=[]",
    "--set", "world.ground=[{ at = [-200, 0], radius = 50 }, { at = [400, -300], size = [200, 100], brightness = 0.5 }]",
    "--set", "world.obstacles=[{ at = [200, 0], size = [90, 40], heading = 30 }]",
]

# Counts the pixels of a picture that have one of the colors.
COUNT = """async ([picture, colors]) => {
    const image = await createImageBitmap(await (await fetch(picture)).blob());
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const has = (at, color) => color.every((part, index) => Math.abs(data[at + index] - part) < 2);
    return colors.map((color) => {
        let count = 0;
        for (let at = 0; at < data.length; at += 4) {
            count += has(at, color);
        }
        return count;
    });
}"""


@pytest.mark.parametrize("session", [PAINTED], indirect=True)
def test_paint_and_turned_boxes_are_drawn(page, browser, tmp_path):
    # Without curves the world has more pixels to count.
    for name in ["global.n", "neighbors"]:
        page.get_by_role("button", name=f"Close the curve of {name}").click()
    go(page, 1)
    taken = base64.b64encode(page.locator("#canvas").screenshot(animations="disabled")).decode()
    # Colors of the style sheet: --black, the middle between it and white, and --obstacle.
    colors = [[0x39, 0x42, 0x4C], [0x9C, 0xA0, 0xA6], [0x8A, 0x94, 0xA0]]
    # The page loads nothing, not even a picture; another one may.
    blank = browser.new_page()
    black, gray, box = blank.evaluate(COUNT, ["data:image/png;base64," + taken, colors])
    blank.close()
    # Areas in mm^2. A quarter of the gray patch is inside the world.
    scale = box / (90 * 40)
    assert black / scale == pytest.approx(math.pi * 50**2, rel=0.05)
    assert gray / scale == pytest.approx(100 * 50, rel=0.05)
    with page.expect_download() as download:
        page.get_by_role("button", name="Drawing").click()
    download.value.save_as(tmp_path / "drawing.svg")
    name = "{http://www.w3.org/2000/svg}"
    root = xml.etree.ElementTree.parse(tmp_path / "drawing.svg").getroot()
    turned = [rect for rect in root.iter(f"{name}rect") if rect.get("transform")]
    assert [rect.get("transform") for rect in turned] == ["rotate(30 200 0)"]
    fills = [circle.get("fill") for circle in root.iter(f"{name}circle") if circle.get("r") == "50"]
    assert fills == ["rgb(57,66,76)"]


def test_a_picture_is_saved(page, tmp_path):
    with page.expect_download() as download:
        page.get_by_role("button", name="Picture").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    assert path.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert path.stat().st_size > 5000


def test_the_last_page_has_the_session(page, browser, session):
    page.click("#step")
    at(page, 1)
    other = browser.new_page()
    other.goto(session.url)
    at(other, 1)
    expect(page.locator("#elsewhere")).to_contain_text("Another page shows this session now. What you do here has no effect.")
    other.click("#step")
    at(other, 2)
    at(page, 1)
    page.get_by_role("button", name="Continue here").click()
    at(page, 2)
    expect(page.locator("#take-over")).to_be_hidden()
    expect(other.locator("#elsewhere")).to_contain_text("Another page shows this session now")
    page.click("#step")
    at(page, 3)
    # The page that waits gets the session when the other one has gone.
    third = browser.new_page()
    third.goto(session.url)
    at(third, 3)
    other.close()
    expect(page.locator("#take-over")).to_be_visible()
    third.close()
    expect(page.locator("#take-over")).to_be_hidden()
    page.click("#step")
    at(page, 4)


def test_a_session_that_does_not_answer_is_shown(page, session):
    session.send_signal(signal.SIGSTOP)
    expect(page.locator("#status")).to_contain_text("The session has not answered for")
    session.send_signal(signal.SIGCONT)
    expect(page.locator("#status")).to_have_text("")
    page.click("#step")
    at(page, 1)


def page_with_events(browser, session):
    """A page of the session, and a function that sends it an event."""
    page = browser.new_page()
    sockets = []

    def join(socket):
        server = socket.connect_to_server()
        server.on_message(socket.send)
        socket.on_message(server.send)
        sockets.append(socket)

    page.route_web_socket(re.compile("/socket$"), join)
    page.goto(session.url)
    at(page, 0)
    return page, lambda *events: sockets[0].send(json.dumps({"events": events, "has_sample": False}))


def test_an_event_that_the_page_does_not_know_is_an_error(browser, session):
    page, send = page_with_events(browser, session)
    send({"event": "comet", "tick": 0})
    expect(page.locator("#status")).to_contain_text("does not know the event \"comet\"")
    # It stays in sight, and the page goes on.
    page.click("#step")
    at(page, 1)
    expect(page.locator("#status")).to_contain_text("does not know the event \"comet\"")
    page.close()


def test_lines_that_come_too_fast_are_counted_and_the_last_ones_shown(browser, session):
    page, send = page_with_events(browser, session)
    page.click("#tab-log")
    for batch in range(40):
        lines = [{"tick": batch, "robot": 1, "text": f"line {batch} {line}"} for line in range(500)]
        send({"event": "logs", "lost": 12000, "lines": []}, {"event": "logs", "lost": 0, "lines": lines})
    log = page.locator("#log p")
    expect(log.last).to_contain_text("line 39 499")
    expect(log).to_have_count(500)
    expect(log.first).to_contain_text("line 39 0")
    # The number of lines that are left out stands before those that follow.
    send({"event": "logs", "lost": 12345, "lines": []})
    expect(log.last).to_have_text("12,345 earlier lines came faster than they can be shown.")


def test_a_way_to_a_tick_says_how_long_it_takes_and_may_be_left(browser, session):
    page, send = page_with_events(browser, session)
    send({"event": "seeking", "tick": 300, "left": 12.34})
    expect(page.locator("#status")).to_have_text("On the way to 30.0 s: about 12 s left.")
    expect(page.locator("#play")).to_have_text("Pause")
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Play")
    expect(page.locator("#status")).to_have_text("")


def test_a_pause_shows_at_once_also_within_a_tick(browser, session):
    page, send = page_with_events(browser, session)
    send({"event": "state", "tick": 0, "plays": True, "rate": None, "over": False})
    expect(page.locator("#play")).to_have_text("Pause")
    # The session does not run, so it cannot answer, like one that simulates a long tick.
    os.kill(session.pid, signal.SIGSTOP)
    try:
        play = "document.querySelector('#play')"
        assert page.evaluate(f"() => {{ {play}.click(); return {play}.textContent; }}") == "Play"
        expect(page.locator("#status")).to_have_text("The simulator finishes this step of the world.")
    finally:
        os.kill(session.pid, signal.SIGCONT)
    expect(page.locator("#status")).to_have_text("")


def test_a_defect_of_the_session_is_shown_and_texts_stay(browser, session):
    page, send = page_with_events(browser, session)
    page.click("#tab-script")
    expect(page.locator("#text .cm-content")).to_contain_text("n = n + 1")
    page.locator("#text .cm-content").click()
    page.keyboard.insert_text("# A draft.")
    send({"event": "defect", "text": "defect of bbz 9.9.9 at live.rs:7: no robot", "help": "report it"})
    session.kill()
    expect(page.locator("body")).to_have_class(re.compile("ended"))
    # The end of the connection does not replace the message.
    expect(page.locator("#status")).to_have_text("defect of bbz 9.9.9 at live.rs:7: no robot (report it)")
    expect(page.locator("#text .cm-content")).to_contain_text("# A draft.")
    page.close()


def test_the_program_ends_with_its_page(browser, session):
    page = browser.new_page()
    page.goto(session.url)
    at(page, 0)
    page.click("#step")
    at(page, 1)
    page.reload()
    at(page, 1)
    page.close()
    assert session.wait(timeout=60) == 0


@pytest.mark.parametrize("cause", [signal.SIGHUP, signal.SIGINT])
def test_the_program_ends_with_its_terminal(browser, session, cause):
    page = browser.new_page()
    page.goto(session.url)
    at(page, 0)
    session.send_signal(cause)
    session.wait(timeout=60)
    expect(page.locator("#status")).to_contain_text("The session has ended")
    page.close()
