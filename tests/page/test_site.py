"""The playground, from a web server that only has files. SITE names its folder, BBZ the program."""

import functools
import http.server
import json
import os
import subprocess
import threading
import tomllib

import pytest
from playwright.sync_api import expect


@pytest.fixture(scope="module")
def site():
    files = functools.partial(http.server.SimpleHTTPRequestHandler, directory=os.environ["SITE"])
    files.log_message = lambda *arguments: None
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), files) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.fixture
def page(browser, site):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    problems, hosts = [], set()
    page.on("console", lambda message: problems.append(message.text))
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("request", lambda request: hosts.add(request.url.split("/")[2]))
    page.goto(site)
    yield page
    page.close()
    assert problems == []
    assert hosts == {site.split("/")[2]}, "no request to any other host"


def digest_of(scenario):
    arguments = [os.environ["BBZ"], "sim", scenario, "--json"]
    return json.loads(subprocess.run(arguments, capture_output=True, check=False).stdout)["digest"]


def test_an_example_runs_as_on_the_command_line(page):
    expect(page.locator("#example")).to_have_value("examples/swarm/gradient.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")
    page.locator("#time").fill("1200")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    page.locator("#tab-ground").click()
    page.get_by_role("button", name="Compute").click()
    digest = digest_of("examples/swarm/gradient.toml")
    expect(page.locator("#digest")).to_have_text(f"{digest} at 120.0 s")


def test_it_plays_and_goes_back(page):
    page.locator("#rate").select_option("100")
    page.locator("#play").click()
    expect(page.locator("#play")).to_have_text("Pause")
    expect(page.locator("#clock")).to_have_text("120.0 s of 120.0 s")
    page.locator("#start").click()
    expect(page.locator("#clock")).to_have_text("0.0 s of 120.0 s")


def test_another_example_is_chosen_by_its_address(page):
    page.locator("#example").select_option("examples/patrol.toml")
    expect(page.locator("#clock")).to_have_text("0.0 s of 30.0 s")
    assert page.url.endswith("#examples/patrol.toml")
    page.reload()
    expect(page.locator("#example")).to_have_value("examples/patrol.toml")


def test_every_example_opens(page):
    options = page.locator("#example option")
    expect(options).not_to_have_count(0)
    for path in [option.get_attribute("value") for option in options.all()]:
        with open(path, "rb") as file:
            duration = tomllib.load(file)["world"]["duration"]
        page.locator("#example").select_option(path)
        expect(page.locator("#clock")).to_have_text(f"0.0 s of {duration:.1f} s")
        page.locator("#step").click()
        expect(page.locator("#clock")).to_have_text(f"0.1 s of {duration:.1f} s")
