"""The playground, from a web server that only has files and from a file. SITE names its folder, BBZ the program."""

import base64
import contextlib
import functools
import gzip
import hashlib
import http.server
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import threading
import tomllib
import zipfile
import zlib

import pytest
from conftest import note_problems, sampled
from playwright.sync_api import expect
from test_editor import write
from test_lessons import Learner
from test_page import SECONDS_MAX


@contextlib.contextmanager
def served(folder):
    """The address of a server for the files of a folder."""
    files = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    files.log_message = lambda *arguments: None
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), files) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.fixture(scope="module")
def site():
    with served(os.environ["SITE"]) as address:
        yield address


@pytest.fixture
def page(browser, site):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    problems, hosts = [], set()
    note_problems(page, problems)
    page.on("request", lambda request: request.url.startswith("blob:") or hosts.add(request.url.split("/")[2]))
    # A page with changes asks before it is left.
    page.on("dialog", lambda dialog: dialog.accept())
    page.goto(site)
    yield page
    page.close()
    assert problems == []
    assert hosts == {site.split("/")[2]}, "no request to any other host"


def choose(page, path):
    """Opens an example and waits until the page shows it: its clock may read as that of the example before."""
    page.locator("#example").select_option(path)
    expect(page.locator("#script-name option").last).to_have_text(os.path.basename(path))
    painted(page)


def painted(page):
    """Waits for a frame that the page paints after this call."""
    page.evaluate("() => new Promise((shown) => requestAnimationFrame(() => requestAnimationFrame(shown)))")


def digest_of(scenario):
    arguments = [os.environ["BBZ"], "sim", scenario, "--json"]
    return json.loads(subprocess.run(arguments, capture_output=True, check=False, timeout=SECONDS_MAX).stdout)["digest"]


@pytest.mark.sample
def test_a_class_loads_little():
    """The bytes of all files, each compressed as web servers do it."""
    files = [path.read_bytes() for path in pathlib.Path(os.environ["SITE"]).iterdir()]
    assert sum(len(gzip.compress(content, 9)) for content in files) < 950_000


@pytest.mark.sample
def test_an_example_runs_as_on_the_command_line(page):
    expect(page.locator("#example")).to_have_value("examples/swarm/gradient.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    page.locator("#time").fill("1200")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    page.locator("#tab-ground").click()
    page.get_by_role("button", name="Compute").click()
    digest = digest_of("examples/swarm/gradient.toml")
    expect(page.locator("#digest")).to_have_text(f"{digest} at 120.0 s")


def test_a_world_is_built_by_hand(page, tmp_path):
    page.click("#build-mode")
    expect(page.locator("#canvas")).to_be_focused()
    expect(page.locator("#build")).to_be_visible()
    for key in ["n", "ArrowLeft", "r", "3"]:
        page.keyboard.press(key)
    expect(page.locator("#build .fields input").first).to_have_value("-75")
    # Below the robots.
    box = page.locator("#canvas").bounding_box()
    scale = min(box["width"] / 400, box["height"] / 800) * 0.94
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x - 100 * scale, y + 370 * scale)
    page.mouse.down()
    page.mouse.move(x + 100 * scale, y + 370 * scale, steps=4)
    page.mouse.up()
    expect(page.locator("#things option:checked")).to_have_text("Wall 1")
    page.keyboard.press("Control+z")
    expect(page.locator("#things")).not_to_contain_text("Wall 1")
    page.keyboard.press("Control+y")
    expect(page.locator("#things")).to_contain_text("Wall 1")
    page.locator("#time").fill("1200")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    expect(page.locator("#build")).to_be_hidden()
    page.locator("#tab-ground").click()
    page.get_by_role("button", name="Compute").click()
    with page.expect_download() as download:
        page.click("#save")
    saved = tmp_path / "saved.toml"
    download.value.save_as(saved)
    assert "obstacles = [{ from = [-100, -370], to = [100, -370] }]" in saved.read_text()
    expect(page.locator("#digest")).to_have_text(f"{digest_of(saved)} at 120.0 s")


def test_an_example_plays_and_returns_to_its_start(page):
    # So slow that the run is still played when a busy computer looks.
    page.locator("#rate").select_option("0.1")
    page.locator("#play").click()
    expect(page.locator("#play")).to_have_text("Pause")
    page.locator("#rate").select_option("100")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    page.locator("#start").click()
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")


@pytest.mark.parametrize("width", [1600, 1280, 900, 390])
def test_the_end_of_a_run_is_reported_beside_the_buttons(page, width):
    page.set_viewport_size({"width": width, "height": 800})
    choose(page, "examples/lessons/corners.toml")
    page.locator("#rate").select_option("100")
    page.locator("#play").click()
    expect(page.locator("#status")).to_have_text("The run is over.")
    painted(page)
    notice = page.locator("#notice-box").bounding_box()
    for button in page.locator("header button:visible, #view-acts button:visible, nav button:visible").all():
        box = button.bounding_box()
        beside = any(one[at] + one[size] <= other[at] for at, size in [("x", "width"), ("y", "height")] for one, other in [(notice, box), (box, notice)])
        assert beside or button.get_attribute("id") == "close-notice", f"{button.inner_text()}: {box}, {notice}"


def test_a_click_while_the_module_is_loaded_is_carried_out(page):
    held = []
    page.route("**/playground.wasm.xz", lambda route: held.append(route))
    page.reload()
    page.locator("#rate").select_option("0.1")
    page.locator("#play").click()
    expect(page.locator("#play")).to_have_text("Play")
    for route in held:
        route.continue_()
    expect(page.locator("#play")).to_have_text("Pause")


@pytest.mark.parametrize(
    "damaged",
    [lambda module: module[: len(module) // 2], lambda _: b"<html>no such file</html>", lambda _: b""],
    ids=["half", "other", "empty"],
)
def test_a_damaged_module_is_reported(browser, site, damaged):
    page = browser.new_page()
    page.route("**/playground.wasm.xz", lambda route: route.fulfill(body=damaged(route.fetch().body())))
    page.goto(site)
    expect(page.locator("#status")).to_contain_text("its files cannot be loaded")
    page.close()


def test_the_wind_is_shown_where_it_blows(page):
    expect(page.locator("#wind")).to_be_hidden()
    choose(page, "examples/swarm/wind.toml")
    expect(page.locator("#wind")).to_have_text(re.compile("wind 1500 mm/s"))
    # 60 degrees counterclockwise from x.
    expect(page.locator("#wind i")).to_have_attribute("style", "transform: rotate(-60deg);")
    # Once robots have flown, the world can be seen from a side.
    page.locator("#rate").select_option("100")
    page.locator("#play").click()
    expect(page.locator("#clock")).to_have_text("40.0 s of 40.0 s")
    page.check("#tilted")
    expect(page.locator("#wind i")).not_to_have_attribute("style", "transform: rotate(-60deg);")


def test_another_example_is_chosen_by_its_address(page):
    choose(page, "examples/patrol.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 30.0 s")
    assert page.url.endswith("#examples/patrol.toml")
    page.reload()
    expect(page.locator("#example")).to_have_value("examples/patrol.toml")


@pytest.mark.sample
def test_every_example_opens(page):
    options = page.locator("#example option")
    expect(options).not_to_have_count(0)
    for path in [option.get_attribute("value") for option in options.all()]:
        with open(path, "rb") as file:
            duration = tomllib.load(file)["world"]["duration"]
        choose(page, path)
        expect(page.locator("#clock")).to_have_text(f"0.0 s of {duration:.1f} s")
        page.locator("#step").click()
        expect(page.locator("#clock")).to_have_text(f"0.1 s of {duration:.1f} s")


SCRIPT = "# Ünlike the example.\nhops = 0\nn = 0\nfunction step() {\n    n = n + 2\n    hops = n % 5\n    led(n % 7)\n    neighbors.broadcast(\"n\", n)\n}\n"


def digest_of_script(tmp_path):
    """The digest of the first example with another script, by the command line."""
    folder = tmp_path / "swarm"
    shutil.copytree("examples/swarm", folder)
    (folder / "gradient.bzz").write_text(SCRIPT)
    return digest_of(folder / "gradient.toml")


def digest_in(page):
    page.locator("#time").fill("1200")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    page.locator("#tab-ground").click()
    page.get_by_role("button", name="Compute").click()
    expect(page.locator("#digest")).to_contain_text("at 120.0 s")
    return page.locator("#digest").inner_text().split()[0]


def test_a_script_is_edited_and_runs(page):
    write(page, SCRIPT)
    page.click("#load")
    expect(page.locator("#script-status")).to_have_text("The robots run gradient.1.bzz.")
    expect(page.locator("#play")).to_have_text("Pause")


def test_a_script_runs_from_the_beginning_also_at_the_end(page, tmp_path):
    page.locator("#rate").select_option("as fast as it can")
    page.click("#play")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    write(page, SCRIPT)
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    expect(page.locator("#play")).to_have_text("Play")
    assert digest_in(page) == digest_of_script(tmp_path)


def test_an_error_in_an_assignment_leads_to_its_line_and_values(page):
    choose(page, "examples/lessons/hops.toml")
    expect(page.get_by_label("Stop on error")).to_be_checked()
    write(page, "hops = 0\nn = 0\nfunction step() {\n  n = n + 1\n  if(id == 3 and n == 10) led(n / 0)\n}\n")
    page.click("#run")
    expect(page.locator("#fault")).to_contain_text("Robot 3 at 1.0 s: integer division by zero")
    expect(page.locator("#fault .value")).to_have_text("n is 10")
    expect(page.locator("#text .cm-lintRange-error")).to_have_text("n / 0")
    expect(page.locator("#play")).to_have_text("Play")
    page.click("#tab-robot")
    expect(page.locator("#robot .at-fault")).to_contain_text("Memory at the error, at 1.0 s")


def test_a_link_has_the_script(page, tmp_path):
    write(page, SCRIPT)
    page.click("#link")
    expect(page.locator("#script-status")).to_contain_text("The address of this page has the text now")
    assert "gradient.bzz=" in page.url
    page.reload()
    page.click("#tab-script")
    expect(page.locator("#text .cm-content")).to_contain_text("Ünlike the example")
    assert digest_in(page) == digest_of_script(tmp_path)
    page.goto(page.url[:-9])
    expect(page.locator("#status")).to_contain_text("the address has a script that cannot be read")


def test_a_link_of_a_gigabyte_is_refused(page):
    """A megabyte of an address that would become a gigabyte of text."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    piece = b" " * (1 << 20)
    packed = b"".join(packer.compress(piece) for _ in range(1024)) + packer.flush()
    letters = base64.urlsafe_b64encode(packed).decode().rstrip("=")
    example = page.url.split("#")[0] + "#examples/swarm/gradient.toml"
    page.goto(f"{example}&examples/swarm/gradient.bzz={letters}")
    expect(page.locator("#status")).to_contain_text("examples/swarm/gradient.bzz is longer than 1 MiB")


def test_a_saved_session_replays_on_the_command_line(page, tmp_path):
    write(page, SCRIPT)
    page.click("#run")
    expect(page.locator("#play")).to_have_text("Pause")
    page.click("#play")
    digest = digest_in(page)
    with page.expect_download() as download:
        page.click("#save")
    download.value.save_as(tmp_path / "session.toml")
    assert "Ünlike" in (tmp_path / "session.toml").read_text(encoding="utf-8")
    assert digest_of(tmp_path / "session.toml") == digest


def test_a_text_that_was_not_saved_is_offered_after_a_reload(page):
    write(page, SCRIPT)
    page.reload()
    offers = page.locator("#unsaved li")
    expect(offers).to_contain_text("gradient.bzz, typed")
    expect(offers).not_to_contain_text("The file has changed since.")
    page.get_by_role("button", name="Restore").click()
    expect(page.locator("#text .cm-content")).to_contain_text("Ünlike the example")
    expect(offers).to_have_count(0)
    # Other examples have texts of their own.
    choose(page, "examples/patrol.toml")
    expect(offers).to_have_count(0)
    choose(page, "examples/swarm/gradient.toml")
    expect(page.locator("#text .cm-content")).to_contain_text("Ünlike the example")
    page.reload()
    page.get_by_role("button", name="Discard").click()
    page.reload()
    expect(page.locator("#script-name option").last).to_have_text("gradient.toml")
    expect(offers).to_have_count(0)


def test_a_trap_of_the_module_is_shown_and_texts_stay(browser, site):
    page = browser.new_page(viewport={"width": 1280, "height": 800})

    def trap(route):
        text = route.fetch().text()
        call = "exports.request(performance.now())"
        assert call in text
        # Before its own listeners, so that a step is known when the worker passes it on.
        before = """
            addEventListener("message", ({ data }) => { globalThis.isStep = data.request?.step !== undefined; });
            function trap() { throw new WebAssembly.RuntimeError("unreachable"); }
        """
        trapping = f"(globalThis.isStep ? trap() : {call})"
        route.fulfill(body=before + text.replace(call, trapping), content_type="text/javascript")

    page.route("**/worker.js", trap)
    page.goto(site)
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    write(page, "# A draft.\n", "step")
    page.click("#step")
    version = tomllib.load(open("Cargo.toml", "rb"))["workspace"]["package"]["version"]
    status = page.locator("#status")
    expect(status).to_contain_text(f"defect of bbz {version}: Uncaught RuntimeError: unreachable")
    expect(status).to_contain_text("report this line")
    expect(page.locator("#text .cm-content")).to_contain_text("# A draft.")
    page.close()


def test_a_link_with_a_mistake_opens_the_editor(page):
    write(page, "# Wrong.\nfunction step( {\n")
    page.click("#link")
    expect(page.locator("#script-status")).to_contain_text("The address of this page has the text now")
    page.reload()
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    expect(page.locator("#script-status")).to_contain_text("The script of the address does not run here")
    expect(page.locator("#text .cm-content")).to_contain_text("# Wrong.")
    expect(page.locator("#diagnostics li")).not_to_have_count(0)


def test_the_page_is_exported_as_one_file(page, browser, tmp_path):
    write(page, SCRIPT)
    with page.expect_download() as download:
        page.click("#export")
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    exported = browser.new_page(viewport={"width": 1280, "height": 800})
    problems, addresses = [], []
    note_problems(exported, problems)
    exported.on("request", lambda request: addresses.append(request.url.split(":")[0]))
    exported.goto(path.as_uri())
    expect(exported.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    assert digest_in(exported) == digest_of_script(tmp_path)
    # It exports itself.
    with exported.expect_download() as again:
        exported.click("#export")
    assert again.value.path().read_text() == path.read_text()
    exported.close()
    assert problems == []
    assert set(addresses) <= {"file", "data", "blob"}, "no request to any host"


def unpacked(folder):
    """The page of the zip that is made with the site."""
    with zipfile.ZipFile(pathlib.Path(os.environ["SITE"]).with_name("bittybuzz-playground.zip")) as file:
        assert file.testzip() is None
        file.extractall(folder)
    return folder / "bittybuzz-playground/index.html"


def plays_a_lesson_offline(browser, folder):
    """Opens the page of the zip without a network, and solves a lesson."""
    context = browser.new_context(viewport={"width": 1280, "height": 800}, offline=True)
    page = context.new_page()
    page.set_default_timeout(SECONDS_MAX * 1000)
    problems, addresses = [], []
    note_problems(page, problems)
    page.on("request", lambda request: addresses.append(request.url.split(":")[0]))
    page.goto(unpacked(folder).as_uri())
    learner = Learner(page, "rhythm")
    page.locator("#example").select_option("examples/lessons/rhythm.toml")
    expect(page.locator("#clock")).to_have_text(learner.clock(0))
    page.locator("#rate").select_option(learner.text("asFast"))
    learner.answers()
    learner.hands_in()
    assert learner.handed_in["success"] is True
    context.close()
    assert problems == []
    assert set(addresses) <= {"file", "data", "blob"}, "no request to any host"


@pytest.mark.sample
def test_the_zip_needs_no_server_and_no_network(browser, tmp_path):
    plays_a_lesson_offline(browser, tmp_path)


@pytest.mark.parametrize("ending", sampled(["", "/", "/index.html"], ["/index.html"].__contains__))
def test_the_site_is_below_any_path(browser, tmp_path, ending):
    folder = tmp_path / "a/b"
    folder.mkdir(parents=True)
    (folder / "c").symlink_to(os.path.abspath(os.environ["SITE"]), target_is_directory=True)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    problems = []
    note_problems(page, problems)
    with served(tmp_path) as address:
        page.on("request", lambda request: request.url.startswith(("blob:", f"{address}a/b/c")) or problems.append(request.url))
        page.goto(f"{address}a/b/c{ending}")
        expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
        choose(page, "examples/patrol.toml")
        expect(page.locator("#clock")).to_have_text("0.0 s of 30.0 s")
        write(page, "# Mine.\nfunction step() {\n}\n")
        page.click("#link")
        expect(page.locator("#script-status")).to_contain_text("The address of this page has the text now")
        link = page.url
        assert link.startswith(f"{address}a/b/c/#" if ending != "/index.html" else f"{address}a/b/c/index.html#")
        other = browser.new_page(viewport={"width": 1280, "height": 800})
        note_problems(other, problems)
        other.goto(link)
        expect(other.locator("#example")).to_have_value("examples/patrol.toml")
        other.click("#tab-script")
        expect(other.locator("#text .cm-content")).to_contain_text("# Mine.")
        other.close()
        page.on("dialog", lambda dialog: dialog.accept())
        page.close()
    assert problems == []


def test_an_assignment_is_shared_by_its_address(page, browser):
    choose(page, "examples/lessons/hops.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    page.click("#tab-tests")
    expect(page.locator("#assignment h2")).to_have_text("Count the hops")
    # The teacher writes another text.
    page.click("#tab-script")
    page.locator("#script-name").select_option("hops.toml")
    content = page.locator("#text .cm-content")
    expect(content).to_contain_text("[assignment]")
    text = open("examples/lessons/hops.toml", encoding="utf-8").read()
    content.click()
    page.keyboard.press("Control+a")
    page.keyboard.press("Delete")
    page.keyboard.insert_text(text.replace("Count the hops", "Hops of class 3"))
    page.click("#run")
    expect(page.locator("#script-status")).to_have_text("The run has started from the beginning.")
    page.click("#link")
    expect(page.locator("#script-status")).to_contain_text("The address of this page has the text now")
    pupil = browser.new_page(viewport={"width": 1280, "height": 800})
    pupil.goto(page.url)
    pupil.click("#tab-tests")
    expect(pupil.locator("#assignment h2")).to_have_text("Hops of class 3")
    pupil.close()


def test_flying_robots_are_shown_in_3d(page):
    choose(page, "examples/swarm/particle_swarm.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    tilt, canvas, name = page.locator("#tilt"), page.locator("#canvas"), page.locator("#name")
    # It is offered before the robots take off.
    expect(tilt).to_be_visible()
    page.click("#play")
    # They rise for some seconds.
    expect(page.locator("#clock")).to_contain_text("6.")
    page.click("#play")
    expect(page.locator("#play")).to_have_text("Play")
    page.check("#tilted")
    for _ in range(4):
        canvas.press("n")
    expect(page.locator("#robot h2")).to_have_text("Robot 3")
    painted(page)
    before = name.bounding_box()
    canvas.press("Control+ArrowRight")
    painted(page)
    turned = name.bounding_box()
    assert turned["x"] != before["x"]
    page.mouse.move(400, 350)
    page.mouse.down(button="right")
    page.mouse.move(400, 320)
    page.mouse.up(button="right")
    painted(page)
    assert name.bounding_box()["y"] != turned["y"]
    # The name is next to the body.
    pixels = page.locator("#bar").bounding_box()["width"] / int(page.locator("#bar-text").inner_text().split()[0])
    where = page.evaluate("() => { const { left, top } = document.getElementById('name').style; return [left, top].map(parseFloat); }")
    box = canvas.bounding_box()
    # A Crazyflie has a radius of 60 mm in the simulator.
    away = 60 * pixels + 6
    x, y = box["x"] + where[0] - away, box["y"] + where[1] + away
    canvas.press("Escape")
    expect(page.locator("#robot h2")).to_have_count(0)
    page.mouse.click(x, y)
    expect(page.locator("#robot h2")).to_have_text("Robot 3")
    place = page.locator("#robot dl > div", has=page.locator("dt", has_text="Place")).locator("dd")
    expect(page.locator("#robot dl.facts")).to_contain_text(re.compile(r"Battery\s*4\.1\d V"))
    before = place.inner_text()
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y, steps=4)
    page.mouse.up()
    page.click("#step")
    expect(place).not_to_have_text(before)
    # The way on the ground is the one that is seen, and the height stays, but for what it flies in a tick.
    (x, y, z), (to_x, to_y, to_z) = ([float(number) for number in re.findall(r"-?[0-9.]+", text)[:3]] for text in (before, place.inner_text()))
    assert abs(math.hypot(to_x - x, to_y - y) - 40 / pixels) < 60
    assert abs(to_z - z) < 30


def test_results_that_are_dropped_on_the_page_are_graded(page):
    choose(page, "examples/lessons/hops.toml")
    expect(page.locator("#grading")).to_be_hidden()
    page.locator("#tab-tests").click()
    page.get_by_label("Your name").fill("Ben")
    with page.expect_download() as download:
        page.get_by_role("button", name="Hand in").click()
    ben = json.loads(download.value.path().read_text())

    def with_text(by, text):
        script = {**ben["scripts"][0], "text": text, "sha256": hashlib.sha256(text.encode()).hexdigest()}
        return json.dumps({**ben, "by": by, "scripts": [script]})

    solution = pathlib.Path("examples/lessons/solutions/hops.bzz").read_text()
    included = "include \"solutions/hops.bzz\"\n"
    files = {"ada.json": with_text("Ada", solution), "ben.json": json.dumps(ben), "eve.json": with_text("Eve", included)}
    files["fay.json"] = with_text("Fay", f"# My own.\n{solution}")
    dropped = page.evaluate_handle(
        """(files) => {
            const data = new DataTransfer();
            Object.entries(files).forEach(([name, text]) => data.items.add(new File([text], name)));
            return data;
        }""",
        files,
    )
    page.dispatch_event("body", "drop", {"dataTransfer": dropped})
    rows = page.locator("#grading tbody tr")
    expect(rows).to_have_count(4, timeout=60_000)
    marks = [row.locator("td").all_inner_texts() for row in rows.all()]
    assert [mark[:2] for mark in marks[:2]] == [["Ada\nada.json", "6 of 6"], ["Ben\nben.json", "1 of 6"]]
    assert "the same scripts as fay.json" in marks[0][2]
    assert marks[2][:2] == ["eve.json", "does not run"]
    assert marks[3][:2] == ["Fay\nfay.json", "6 of 6"]
