"""Connections whose handshake is not over: limited in number, for they count as no client yet."""

from __future__ import annotations

import asyncio
from typing import Final

from websockets.asyncio.server import ServerConnection
from websockets.protocol import State

MAX_OPENING: Final = 64
"""Handshakes at once; the oldest is given up for a new one, since an honest one ends at once."""


class Opening(ServerConnection):
    """A connection that makes room for itself."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        opening = [each for each in self.server.handlers if each.state is State.CONNECTING]
        if len(opening) > MAX_OPENING:
            opening[0].transport.abort()
