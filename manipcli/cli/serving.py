"""Waiting for Ctrl-C while a page is served, for `view` and `replay`."""

from __future__ import annotations

import threading
from collections.abc import Callable

from manipcli.cli import console


def stay(url: str, *, open_: bool, meanwhile: Callable[[], object] | None = None) -> None:
    """Prints the address, with `open_` opens it in a browser, and returns on Ctrl-C.

    `meanwhile` is called in the waiting; by default nothing is done.
    """
    try:  # Ctrl-C may come as soon as the address is printed
        console.result(url)
        console.talk("Press Ctrl-C to stop.")
        if open_:
            import webbrowser

            webbrowser.open(url)
        (meanwhile or threading.Event().wait)()
    except KeyboardInterrupt:
        console.talk("")
