"""What a visitor has who may only read, in his browser alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from manipcli.live.page import texts
from manipcli.live.page.snapshot import Snapshot

if TYPE_CHECKING:
    import viser


class Reader:
    """What a visitor has who may only read.

    Args:
        client: his browser.
        folder: of the controllers, which all visitors see.
        states: of the controllers, as far as they are known.
    """

    def __init__(self, client: viser.ClientHandle, folder: viser.GuiFolderHandle, states: Mapping[str, str]) -> None:
        client.gui.add_html(texts.read_only(), order=0)
        with folder:
            self._states = client.gui.add_html(texts.controllers(states))

    def update(self, snapshot: Snapshot, now: float) -> None:
        """Nothing is his own."""

    def show_controllers(self, states: Mapping[str, str]) -> None:
        """List the controllers."""
        self._states.content = texts.controllers(states)

    def failed(self, name: str, why: str) -> None:
        """He commands nothing."""
