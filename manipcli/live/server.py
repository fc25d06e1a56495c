"""WebSocket server of a live session: connections, their limits, and what is published to them."""

from __future__ import annotations

import asyncio
import errno
import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live.access import Access
from manipcli.live.budget import Share
from manipcli.live.client import Client
from manipcli.live.connection import Services
from manipcli.live.frames import MAX_FRAME
from manipcli.record.channels import ROSOUT

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

MAX_CLIENTS: Final = 32
MAX_READERS: Final = 24
"""Those of them without the token."""
UNREAD: Final = 10.0
"""[s] A client that takes nothing for this time is disconnected."""
READ: Final = 4096
"""[byte] Read from one client at once: small frames and pings of more would keep the others waiting."""
MAX_REASON: Final = 120
"""Longest reason of a close [byte]; 123 in the protocol."""
REPORT_PERIOD: Final = 5.0
"""[s] Between two warnings that messages are dropped."""


class LiveServer:
    """Serves clients.

    Args:
        services: what clients share.
        access: who may connect.
        unread: [s] a client that takes nothing for this time is disconnected.
    """

    def __init__(self, services: Services, access: Access, *, unread: float = UNREAD) -> None:
        self._services, self._access, self._unread = services, access, unread
        self._clients: dict[int, Client] = {}
        self._readers: set[int] = set()
        self._numbers = 0
        self._turn, self._share = asyncio.Lock(), Share()

    @asynccontextmanager
    async def listening(self, port: int) -> AsyncIterator[int]:
        """Listen on a port, 0: any free port; gives the port. All connections are closed at the end.

        Raises:
            InvalidInput: USE131 the port or the address cannot be used; USE132 the library is not installed.
        """
        try:
            from websockets.asyncio.server import serve

            from manipcli.live.opening import Opening
        except ImportError as error:
            message = "serve needs the library websockets, which is not installed"
            raise InvalidInput([Diagnostic("USE132", message, hint='pip install "manipcli[live]"')]) from error

        quiet = logging.getLogger("manipcli.live")
        quiet.propagate = False
        quiet.addHandler(logging.NullHandler())
        try:
            server = await serve(
                self._serve, self._access.host, port, process_request=self._checked, max_size=MAX_FRAME, max_queue=16,
                compression=None, open_timeout=10.0, close_timeout=1.0, server_header=None, logger=quiet,
                ping_timeout=None,  # the answer of a client that has to wait comes late; see `unread`
                create_connection=Opening,
            )  # fmt: skip
        except OSError as error:
            raise _unusable(self._access.host, port, error) from error
        async with server:
            yield next(iter(server.sockets)).getsockname()[1]

    def _checked(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse a request before it becomes a connection."""
        headers = request.headers
        try:
            host, origin = headers.get("Host"), headers.get("Origin")
            authorization = headers.get("Authorization")
        except LookupError:  # a header that is given twice
            return connection.respond(_status(400), "duplicate header\n")
        decision = self._access.decide(
            request.path, port=connection.local_address[1], host=host, origin=origin, authorization=authorization
        )
        if decision.refused is not None:
            code, why = decision.refused
            return connection.respond(_status(code), f"{why}\n")
        if full := self._full(may=decision.commands):
            return connection.respond(_status(503), f"{full}\n")
        connection.commands = decision.commands  # type: ignore[attr-defined]
        return None

    def _full(self, *, may: bool) -> str:
        """Why one more client is refused; "" if it is not. Readers cannot keep out those who command."""
        if not may and len(self._readers) >= MAX_READERS:
            return f"more than {MAX_READERS} clients without the token"
        return f"more than {MAX_CLIENTS} clients" if len(self._clients) >= MAX_CLIENTS else ""

    async def _serve(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        may: bool = connection.commands  # type: ignore[attr-defined]
        if full := self._full(may=may):
            await connection.close(1013, full)
            return
        self._numbers += 1
        number = self._numbers
        if not may:
            self._readers.add(number)
        client = self._clients[number] = Client(number, commands=may, services=self._services)
        sending = asyncio.create_task(self._send(connection, client))
        connection.transport.max_size = READ  # type: ignore[attr-defined]  # of asyncio's transports of sockets
        try:
            async for frame in connection:
                used = await self._receive(client, frame)
                if client.offence:
                    await connection.close(1008, client.offence.encode()[:MAX_REASON].decode(errors="ignore"))
                elif used:
                    with suppress(TimeoutError):
                        async with asyncio.timeout(self._share.wait(time.monotonic(), used)):
                            await connection.wait_closed()
        except ConnectionClosed:
            pass
        finally:
            sending.cancel()
            del self._clients[number]
            self._readers.discard(number)
            self._services.subscribed()

    async def _receive(self, client: Client, frame: str | bytes) -> float:
        """One frame of one client in a turn of the event loop, so that samples are sent before the next frame.

        Returns:
            Processor time [s] for which the client has to wait; 0: it has not.
        """
        async with self._turn:
            began = time.thread_time()
            waits = not client.receive(frame)
            used = time.thread_time() - began
            await asyncio.sleep(0)
        return used if waits else 0.0

    async def _send(self, connection: ServerConnection, client: Client) -> None:
        """Send what waits; disconnect a client that does not read."""
        from websockets.exceptions import ConnectionClosed

        reported = time.monotonic()
        try:
            while True:
                await client.outbox.ready.wait()
                if client.outbox.full:
                    await connection.close(1008, "answers are not read")
                    return
                for text in client.outbox.take():
                    async with asyncio.timeout(self._unread):
                        await connection.send(text)
                if time.monotonic() - reported > REPORT_PERIOD:
                    reported = time.monotonic()
                    for line in client.report_drops():
                        self.publish(ROSOUT, line)
        except TimeoutError:
            connection.transport.abort()
        except ConnectionClosed:
            pass

    def wanted(self) -> set[str]:
        """The topics that somebody subscribes to."""
        return {topic for client in self._clients.values() for topic in client.outbox.subscriptions}

    def due(self) -> set[str]:
        """Those for which a client waits now."""
        now = time.monotonic()
        subscriptions = (one for client in self._clients.values() for one in client.outbox.subscriptions.values())
        return {one.topic for one in subscriptions if now >= one.next}

    def publish(self, topic: str, text: str) -> int:
        """Queue a message for all its subscribers; returns how many take it."""
        now = time.monotonic()
        return sum(client.outbox.publish(topic, text, now) for client in self._clients.values())


def _status(code: int) -> Any:
    from http import HTTPStatus

    return HTTPStatus(code)


def _unusable(host: str, port: int, error: OSError) -> InvalidInput:
    reason = "already in use" if error.errno == errno.EADDRINUSE else f"not usable: {error.strerror or error}"
    hint = "use another --port, or --port 0 for any free port"
    return InvalidInput([Diagnostic("USE131", f"port {port} of {host} is {reason}", hint=hint)])
