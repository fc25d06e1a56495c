"""Who may see the page, and who may command: the rules of `live/access.py` on the requests of a browser.

The address `/?token=...` leads on to the page that opens its WebSocket with the token: viser's page takes the address
of its WebSocket from its query. A connection that came without the token is read-only.
"""

from __future__ import annotations

from contextvars import ContextVar
from http import HTTPStatus
from typing import TYPE_CHECKING, Final
from urllib.parse import quote, urlsplit

from manipcli.live.access import Access, query
from manipcli.replay.view.viser_server import Answer

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

MAY_COMMAND: Final[ContextVar[bool]] = ContextVar("may_command", default=False)
"""Whether the connection whose coroutine asks came with the token."""


def door(access: Access) -> Answer:
    """The check of requests by these rules."""

    def check(connection: ServerConnection, request: Request) -> Response | None:
        headers = request.headers
        host = headers.get("Host")
        decision = access.decide(
            request.path,
            port=connection.local_address[1],
            host=host,
            origin=headers.get("Origin"),
            authorization=headers.get("Authorization"),
        )
        if decision.refused is not None:
            code, why = decision.refused
            return connection.respond(HTTPStatus(code), f"{why}\n")
        if headers.get("Upgrade") is not None:
            MAY_COMMAND.set(decision.commands)
        elif decision.commands and access.token is not None and urlsplit(request.path).path == "/":
            return _leads_on(connection, f"ws://{host}{query(access.token)}")
        return None

    return check


def _leads_on(connection: ServerConnection, socket: str) -> Response:
    found = connection.respond(HTTPStatus.SEE_OTHER, "")
    found.headers["Location"] = f"/?websocket={quote(socket, safe='')}"
    found.headers["Cache-Control"] = "no-store"
    return found
