"""WebSocket server of a live session, in its own thread: connections, their limits, and what is published to them."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live.access import Access
from manipcli.live.client import Client
from manipcli.live.command import Command
from manipcli.live.connection import Services
from manipcli.live.feed import Feed
from manipcli.live.frames import MAX_FRAME
from manipcli.live.publisher import Publisher, is_sampled
from manipcli.live.rosapi import Rosapi

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

MAX_CLIENTS: Final = 32
UNREAD: Final = 10.0
"""[s] A client that takes nothing for this time is disconnected."""
TOLD: Final = 5.0
"""[s] Between two warnings that messages are dropped."""


class LiveServer:
    """Serves a session. A context manager that closes all connections at its end.

    Args:
        publisher: makes the messages.
        feed: of the session.
        put: hands a command to the control loop; False if too many wait.
        access: who may connect.
        port: to listen on; 0: any free port.

    Attributes:
        port: the port that it listens on.

    Raises:
        InvalidInput: USE131 the port or the address cannot be used; USE132 the library is not installed.
    """

    def __init__(
        self, publisher: Publisher, feed: Feed, put: Callable[[Command], bool], *, access: Access, port: int
    ) -> None:
        _library()
        self._publisher, self._feed, self._access = publisher, feed, access
        self._clients: dict[int, Client] = {}
        self._numbers = 0
        self._loop = asyncio.new_event_loop()
        self._something = asyncio.Event()
        rosapi = Rosapi(publisher.offer, lambda: publisher.clock(feed.tick_now))
        self._services = Services(publisher.offer, publisher.latched, rosapi, put, self._soon, self._subscribed)
        self._thread = threading.Thread(target=self._loop.run_forever, name="live", daemon=True)
        self._thread.start()
        try:
            self._server: Server = asyncio.run_coroutine_threadsafe(self._listen(port), self._loop).result()
        except OSError as error:
            self._stop_thread()
            raise _unusable(access.host, port, error) from error
        self.port: int = next(iter(self._server.sockets)).getsockname()[1]
        feed.listen(lambda: self._soon(self._something.set))
        self._publishing = asyncio.run_coroutine_threadsafe(self._publish(), self._loop)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._feed.listen(lambda: None)
        self._publishing.cancel()
        with contextlib.suppress(TimeoutError):
            asyncio.run_coroutine_threadsafe(self._close(), self._loop).result(timeout=5.0)
        self._stop_thread()

    async def _close(self) -> None:
        self._server.close()
        await self._server.wait_closed()

    def _stop_thread(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=5.0)
        if not self._thread.is_alive():
            self._loop.close()

    def _soon(self, call: Callable[[], object]) -> None:
        """Call in the thread of the network; nothing after its end."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(call)

    async def _listen(self, port: int) -> Server:
        from websockets.asyncio.server import serve

        quiet = logging.getLogger("manipcli.live")
        quiet.propagate = False
        quiet.addHandler(logging.NullHandler())
        return await serve(
            self._serve, self._access.host, port, process_request=self._checked, max_size=MAX_FRAME, max_queue=16,
            compression=None, open_timeout=10.0, close_timeout=1.0, server_header=None, logger=quiet,
        )  # fmt: skip

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
        if len(self._clients) >= MAX_CLIENTS:
            return connection.respond(_status(503), f"more than {MAX_CLIENTS} clients\n")
        connection.commands = decision.commands  # type: ignore[attr-defined]
        return None

    async def _serve(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        if len(self._clients) >= MAX_CLIENTS:
            await connection.close(1013, f"more than {MAX_CLIENTS} clients")
            return
        self._numbers += 1
        number = self._numbers
        may: bool = connection.commands  # type: ignore[attr-defined]
        client = self._clients[number] = Client(number, commands=may, services=self._services)
        sending = asyncio.create_task(self._send(connection, client))
        try:
            async for frame in connection:
                client.receive(frame)
        except ConnectionClosed:
            pass
        finally:
            sending.cancel()
            del self._clients[number]
            self._subscribed()

    async def _send(self, connection: ServerConnection, client: Client) -> None:
        """Send what waits; disconnect a client that does not read."""
        from websockets.exceptions import ConnectionClosed

        told = time.monotonic()
        try:
            while True:
                await client.outbox.ready.wait()
                if client.outbox.full:
                    await connection.close(1008, "answers are not read")
                    return
                for text in client.outbox.take():
                    await asyncio.wait_for(connection.send(text), UNREAD)
                if time.monotonic() - told > TOLD:
                    told = time.monotonic()
                    _warn_of_drops(client)
        except TimeoutError:
            connection.transport.abort()
        except ConnectionClosed:
            pass

    def _subscribed(self) -> None:
        """Sample the state only while somebody subscribes to it."""
        wanted = {topic for client in self._clients.values() for topic in client.outbox.subscriptions}
        self._feed.wanted = any(is_sampled(topic, self._publisher.offer) for topic in wanted)

    async def _publish(self) -> None:
        """Make each message once, for all its subscribers."""
        while True:
            await self._something.wait()
            self._something.clear()
            events, samples = self._feed.take()
            for event in events:
                if event.topic in self._publisher.offer.published:
                    self._offer(event.topic, self._publisher.event(event.topic, event.data))
            for sample in samples:
                for topic, text in self._publisher.sample(sample, self._due()).items():
                    self._offer(topic, text)
                await asyncio.sleep(0)

    def _due(self) -> set[str]:
        """Topics for which a client waits now."""
        now = time.monotonic()
        subscriptions = (one for client in self._clients.values() for one in client.outbox.subscriptions.values())
        return {one.topic for one in subscriptions if now >= one.next}

    def _offer(self, topic: str, text: str) -> None:
        now = time.monotonic()
        for client in self._clients.values():
            client.outbox.publish(topic, text, now)


def _warn_of_drops(client: Client) -> None:
    for one in client.outbox.subscriptions.values():
        if one.dropped:
            client.status("warning", f"{one.topic}: {one.dropped} messages were dropped; read faster or throttle")
            one.dropped = 0


def _status(code: int) -> Any:
    from http import HTTPStatus

    return HTTPStatus(code)


def _library() -> None:
    try:
        import websockets.asyncio.server  # noqa: F401
    except ImportError as error:
        message = "serve needs the library websockets, which is not installed"
        raise InvalidInput([Diagnostic("USE132", message, hint='pip install "manipcli[live]"')]) from error


def _unusable(host: str, port: int, error: OSError) -> InvalidInput:
    reason = "already in use" if error.errno == errno.EADDRINUSE else f"not usable: {error.strerror or error}"
    hint = "use another --port, or --port 0 for any free port"
    return InvalidInput([Diagnostic("USE131", f"port {port} of {host} is {reason}", hint=hint)])
