"""The types of the page's scripts, which the events of the session have to match."""

import pathlib
import shutil
import subprocess

import pytest

pytestmark = pytest.mark.sample

ROOT = pathlib.Path(__file__).parents[2]
PAGE, PLAYGROUND, EDITOR = ROOT / "bbz/page/web", ROOT / "playground/web", ROOT / "bbz/page/editor"


def assemble(folder, scripts):
    """Copies scripts into one folder, as a server has them, with their types."""
    for script in scripts:
        for path in script.glob("*.js"):
            shutil.copy(path, folder)
    # Minified code has no types: those of its packages stand for it.
    (folder / "vendor.js").unlink()
    for path in [*EDITOR.glob("*.ts"), *EDITOR.glob("tsconfig*.json")]:
        shutil.copy(path, folder)
    (folder / "node_modules").symlink_to(EDITOR / "node_modules")


def errors(folder, project="tsconfig.json"):
    tsc = [EDITOR / "node_modules/.bin/tsc", "--project", project]
    return subprocess.run(tsc, cwd=folder, capture_output=True, text=True, check=False, timeout=120).stdout


@pytest.mark.parametrize("scripts", [[PAGE], [PAGE, PLAYGROUND]], ids=["page", "playground"])
def test_scripts_match_their_types(tmp_path, scripts):
    assemble(tmp_path, scripts)
    assert errors(tmp_path) == ""


def test_the_worker_matches_its_types(tmp_path):
    assemble(tmp_path, [PAGE, PLAYGROUND])
    assert errors(tmp_path, "tsconfig.worker.json") == ""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("event.message}", "event.massage}"), "Property 'massage' does not exist"),
        (("    written(event) {", "    writen(event) {"), "'writen' does not exist"),
        (("ask(\"scenario\")", "ask(\"senario\")"), "\"senario\"' is not assignable"),
    ],
    ids=["field", "event", "request"],
)
def test_a_wrong_name_is_an_error(tmp_path, change, message):
    assemble(tmp_path, [PAGE])
    main = tmp_path / "main.js"
    text = main.read_text()
    assert change[0] in text
    main.write_text(text.replace(*change))
    assert message in errors(tmp_path)


def test_a_new_event_needs_a_handler(tmp_path):
    assemble(tmp_path, [PAGE])
    events = tmp_path / "events.d.ts"
    text = events.read_text()
    assert "export type PageEvent = " in text
    events.write_text(text.replace("export type PageEvent = ", "export type PageEvent = { \"event\": \"new\" } | "))
    assert "Property 'new' is missing" in errors(tmp_path)
