"""The live page of a simulation in a notebook.

It needs anywidget, which `pip install "bittybuzz[notebook]"` brings along. The page and the kernel
exchange messages over the channel of the widget, so no port is opened.
"""

from __future__ import annotations

import gzip
import pathlib
import threading
import weakref
from typing import Any

import anywidget
import traitlets

from ._bittybuzz import LiveSession, Simulation, single_page

__all__ = ["View"]

# Messages of a frame that are not for the session.
_PAGE = "page"
_CLOSE = "close"


class View(anywidget.AnyWidget):
    """A page with a run of its own, as a notebook displays it.

    `height` is that of the page in pixels. Requests of the page are carried out while the kernel is
    idle; a run that plays goes on while a cell is being computed.
    """

    _esm = pathlib.Path(__file__).parent / "view.js"
    height = traitlets.Int(640, min=100).tag(sync=True)

    def __init__(self, session: LiveSession, height: int = 640) -> None:
        super().__init__(height=height)
        self._session = session
        self.on_msg(self._receive)
        weakref.finalize(self, session.end)
        threading.Thread(
            target=_pass_on, args=(session, weakref.ref(self)), name="bittybuzz view", daemon=True
        ).start()

    def simulation(self) -> Simulation:
        """Returns a copy of the run as the page shows it, which the page no longer changes."""
        return self._session.simulation()

    def close(self) -> None:
        """Ends the session and removes the page."""
        self._session.end()
        super().close()

    def _receive(self, _: Any, message: Any, __: Any) -> None:
        view, text = message["view"], message["text"]
        if text == _PAGE:
            page = gzip.compress(single_page().encode())
            self.send({"view": view, "page": True}, [page])
        elif text == _CLOSE:
            self._session.close(view)
        else:
            self._session.receive(view, text)


def _pass_on(session: LiveSession, widget: weakref.ref[View]) -> None:
    """Passes the messages of a session to its frames until the session ends."""
    while (message := session.next()) is not None:
        view, content, sample = message
        target = widget()
        if target is None:
            return
        target.send({"view": view, **content}, [] if sample is None else [sample])
        # The widget may be dropped while this thread waits.
        del target
