"""Waiting for Ctrl-C while a page is served, for `view` and `replay`."""

from __future__ import annotations

import threading

from manipcli.cli import console


def stay(url: str, *, open_: bool) -> None:
    """Prints the address, with `open_` opens it in a browser, and returns on Ctrl-C."""
    try:  # Ctrl-C may come as soon as the address is printed
        console.result(url)
        console.talk("Press Ctrl-C to stop.")
        if open_:
            import webbrowser

            webbrowser.open(url)
        threading.Event().wait()
    except KeyboardInterrupt:
        console.talk("")
