"""A page that stays until Ctrl-C: what `view` and `replay` do once it is up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from manipcli.cli import console

if TYPE_CHECKING:
    from manipcli.replay.server import LocalServer


def stay(page: LocalServer, *, open_: bool) -> None:
    """Tells the address, with `open_` shows it in a browser, and returns when the user ends it."""
    try:  # from the moment at which the address is told
        console.result(page.url)
        console.talk("Ctrl-C ends it")
        if open_:
            import webbrowser

            webbrowser.open(page.url)
        page.wait()
    except KeyboardInterrupt:
        console.talk("")
