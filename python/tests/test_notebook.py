"""The session behind the page of a notebook, without a browser. `cargo xtask soak notebooks` has one."""

from __future__ import annotations

import json
import pathlib
import threading
from typing import Any

import pytest
import worlds

import bittybuzz
from bittybuzz.notebook import View


class Frame(View):
    """A view whose messages a test sends and receives."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        self.sent: list[tuple[dict[str, Any], list[bytes]]] = []
        self.has_sent = threading.Condition()
        super().__init__(*arguments, **named)

    def send(self, content: Any, buffers: Any = None) -> None:
        """Keeps a message to the frames."""
        with self.has_sent:
            self.sent.append((content, list(buffers or [])))
            self.has_sent.notify_all()

    def receive(self, view: int, text: str) -> None:
        """Sends a message of a frame."""
        self._receive(self, {"view": view, "text": text}, [])

    def take(self, view: int) -> tuple[dict[str, Any], list[bytes]]:
        """Takes the next message."""
        with self.has_sent:
            assert self.has_sent.wait_for(lambda: self.sent, timeout=60)
            content, buffers = self.sent.pop(0)
        assert content["view"] == view
        return content, buffers

    def event(self, view: int, name: str) -> dict[str, Any]:
        """Takes batches until one has an event of that name."""
        while True:
            content, _ = self.take(view)
            self.receive(view, "taken")
            for event in json.loads(content["events"]):
                if event["event"] == name:
                    return dict(event)


@pytest.fixture
def simulation(tmp_path: pathlib.Path) -> bittybuzz.Simulation:
    return worlds.simulation(tmp_path)


def shown(simulation: bittybuzz.Simulation, monkeypatch: pytest.MonkeyPatch) -> Frame:
    """Opens a view whose messages the test exchanges."""
    monkeypatch.setattr("bittybuzz.notebook.View", Frame)
    view = simulation.view(height=300)
    assert isinstance(view, Frame)
    return view


def test_a_page_controls_a_run_of_its_own(
    simulation: bittybuzz.Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulation.step(20)
    view = shown(simulation, monkeypatch)
    assert view.height == 300
    view.receive(1, "begin")
    begin = view.event(1, "begin")
    assert begin["groups"][0]["robot"] == "zooids"
    view.receive(1, json.dumps({"go_to": {"tick": 50}}))
    while view.event(1, "state")["tick"] != 50:
        pass
    # The run of the page is a copy, and so is what one takes from it.
    copy = view.simulation()
    assert (simulation.time, copy.time) == (2.0, 5.0)
    simulation.step(30)
    assert copy.digest() == simulation.digest()
    with pytest.raises(bittybuzz.Error, match="copy of a page's"):
        copy.view()
    view.close()
    with pytest.raises(bittybuzz.Error, match="session has ended"):
        view.simulation()


def test_the_page_is_one_file(simulation: bittybuzz.Simulation, monkeypatch: pytest.MonkeyPatch) -> None:
    import gzip

    view = shown(simulation, monkeypatch)
    view.receive(4, "page")
    content, [page] = view.take(4)
    assert content == {"view": 4, "page": True}
    text = gzip.decompress(page).decode()
    assert text.startswith("<!doctype html>") and 'src="' not in text
    view.receive(4, "close")
    # A frame that never began has no session.
    view.receive(5, "ping")
    assert view.take(5)[0] == {"view": 5, "hasEnded": True}
    view.close()


def test_the_script_of_the_page_is_compiled_on_request(
    simulation: bittybuzz.Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = shown(simulation, monkeypatch)
    view.receive(1, "begin")
    begin = view.event(1, "begin")
    assert begin["scripts"]["names"] == ["counts.bzz"]
    view.close()
