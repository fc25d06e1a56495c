"""Server for Foxglove: the topics of a live session with the schemas of the log, its meshes and its clock, read-only.

foxglove-sdk speaks the protocol (`foxglove.sdk.v1`) in its own threads. It has no token and no check of the origin, so
it listens on 127.0.0.1 only, and offers nothing that commands: clients cannot publish, call services or set parameters.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live.assets import AssetRefused, Assets
from manipcli.live.interface import Offer
from manipcli.live.rosapi import NODE
from manipcli.record import schemas
from manipcli.replay.page_server import HOST

if TYPE_CHECKING:
    import foxglove

DEFAULT_PORT: Final = 8765
"""Foxglove's."""
LEAST: Final = 1.0 / 60.0
"""[s] Least wall time between two samples."""
CLOCK_PERIOD: Final = 1.0 / 30.0
"""[s] Wall time between two broadcasts of the simulated time."""
BACKLOG: Final = 256
"""Messages that wait for a client; then its oldest are dropped."""


class FoxgloveServer:
    """Serves a session to Foxglove. A context manager that closes all connections at its end; a `Tap`.

    Args:
        offer: topics and services.
        definitions: ros2msg texts of the types that `record/schemas.py` does not have, by topic.
        assets: files that clients may fetch.
        now: returns the simulated time [ns].
        port: to listen on; 0: any free port.

    Attributes:
        port: the port that it listens on.

    Raises:
        InvalidInput: USE148 the port cannot be used; USE149 the library is not installed.
    """

    def __init__(
        self,
        offer: Offer,
        definitions: Mapping[str, str],
        *,
        assets: Assets,
        now: Callable[[], int],
        port: int = DEFAULT_PORT,
    ) -> None:
        library = _library()
        from foxglove.websocket import Capability

        self._latched, self._now = offer.latched, now
        self._last: dict[str, tuple[bytes, int]] = {}
        self._next = 0.0
        self._subscribers: set[tuple[int, str]] = set()
        self._wanted: frozenset[str] = frozenset()
        self._lock = threading.Lock()
        self._changed: Callable[[], object] = lambda: None
        self._context = context = library.Context()  # its channels live as long as it does
        self._channels = {
            topic: library.Channel(
                topic, schema=_schema(kind, definitions.get(topic, "")), message_encoding="cdr", context=context
            )
            for topic, kind in offer.published.items()
        }
        try:
            self._server = library.start_server(
                name="manipcli",
                host=HOST,
                port=port,
                capabilities=[Capability.ConnectionGraph, Capability.Time],
                server_listener=_Listener(self._subscribe, self._unsubscribe),
                asset_handler=lambda uri: _asset(assets, uri),
                context=context,
                message_backlog_size=BACKLOG,
            )
        except RuntimeError as error:
            raise _unusable(port, str(error)) from None
        self.port: int = self._server.port
        self._server.publish_connection_graph(_graph(offer))
        self._over = threading.Event()
        self._clock = threading.Thread(target=self._broadcast_time, name="foxglove-clock", daemon=True)
        self._clock.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._over.set()
        self._clock.join()
        self._server.stop()

    @property
    def url(self) -> str:
        """The address for Foxglove."""
        return f"ws://{HOST}:{self.port}"

    @property
    def wanted(self) -> frozenset[str]:
        return self._wanted

    def listen(self, changed: Callable[[], object]) -> None:
        self._changed = changed

    def publish(self, topic: str, ns: int, data: bytes) -> None:
        channel = self._channels.get(topic)
        if channel is None:
            return
        if topic in self._latched:
            self._last[topic] = data, ns
        channel.log(data, log_time=ns)

    def sample(self, ns: int, found: Mapping[str, bytes]) -> None:
        now, wanted = time.monotonic(), self._wanted
        if now < self._next or not wanted:
            return
        self._next = now + LEAST
        for topic in wanted & found.keys():
            self._channels[topic].log(found[topic], log_time=ns)

    def _subscribe(self, client: int, topic: str) -> None:
        """The last message of a latched topic goes to all its subscribers: the library cannot send to one of them."""
        last = self._last.get(topic)
        if last is not None:
            data, ns = last
            self._channels[topic].log(data, log_time=ns)
        with self._lock:
            self._subscribers.add((client, topic))
            self._wanted = frozenset(topic for _, topic in self._subscribers)
        self._changed()

    def _unsubscribe(self, client: int, topic: str) -> None:
        with self._lock:
            self._subscribers.discard((client, topic))
            self._wanted = frozenset(topic for _, topic in self._subscribers)
        self._changed()

    def _broadcast_time(self) -> None:
        """Simulated time that goes back is that of another log: clients then forget what they have."""
        last = 0
        while not self._over.wait(CLOCK_PERIOD):
            now = self._now()
            if now < last:
                self._server.clear_session()
                for topic, (data, ns) in [*self._last.items()]:
                    self._channels[topic].log(data, log_time=ns)
            self._server.broadcast_time(now)
            last = now


class _Listener:
    """Callbacks of the library; it calls those that it knows, in its own threads."""

    def __init__(self, subscribe: Callable[[int, str], None], unsubscribe: Callable[[int, str], None]) -> None:
        self._subscribe, self._unsubscribe = subscribe, unsubscribe

    def on_subscribe(self, client: Any, channel: Any) -> None:
        self._subscribe(client.id, channel.topic)

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        self._unsubscribe(client.id, channel.topic)

    def on_connection_graph_subscribe(self) -> None: ...

    def on_connection_graph_unsubscribe(self) -> None: ...


def _asset(assets: Assets, uri: str) -> bytes | None:
    try:
        return assets.read(uri)
    except AssetRefused:
        return None  # the library answers "not found"


def _schema(kind: str, definition: str) -> foxglove.Schema:
    """The schema of a topic, as the log has it."""
    import foxglove

    text = definition or schemas.schema_text(kind)
    return foxglove.Schema(name=kind, encoding="ros2msg", data=text.encode())


def _graph(offer: Offer) -> foxglove.ConnectionGraph:
    """Who publishes, subscribes and serves: the first word of a name (`/arm_controller`), or this program."""
    import foxglove

    graph = foxglove.ConnectionGraph()
    for topic in offer.published:
        graph.set_published_topic(topic, [_node(topic)])
    for topic in offer.received:
        graph.set_subscribed_topic(topic, [_node(topic)])
    for service in offer.services:
        graph.set_advertised_service(service, [_node(service)])
    return graph


def _node(name: str) -> str:
    first, _, rest = name[1:].partition("/")
    return f"/{first}" if rest else NODE


def _library() -> Any:
    try:
        import foxglove
        import foxglove.websocket
    except ImportError as error:
        message = "Foxglove needs the library foxglove-sdk, which is not installed"
        hint = 'pip install "manipcli[live]", or --no-foxglove'
        raise InvalidInput([Diagnostic("USE149", message, hint=hint)]) from error
    quiet = logging.getLogger("foxglove")  # what clients send is not the user's concern
    quiet.propagate = False
    quiet.addHandler(logging.NullHandler())
    return foxglove


def _unusable(port: int, reason: str) -> InvalidInput:
    used = "in use" in reason
    message = f"port {port} for Foxglove is {'already in use' if used else f'not usable: {reason}'}"
    hint = "use another --foxglove-port, 0 for any free port, or --no-foxglove"
    return InvalidInput([Diagnostic("USE148", message, hint=hint)])
