"""Server for Foxglove: the topics of a live session with the schemas of the log, its meshes and its clock, read-only.

foxglove-sdk speaks the protocol (`foxglove.sdk.v1`) in its own threads. It has no token and no check of the origin, so
it listens on 127.0.0.1 only, and offers nothing that commands: clients cannot publish, call services or set parameters.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live.offer import CLOCK, Offer
from manipcli.live.outlet import Network, Outlet
from manipcli.live.publisher import Publisher
from manipcli.live.rosapi import NODE
from manipcli.record import schemas
from manipcli.record.channels import channel_table
from manipcli.replay.page_server import HOST
from manipcli.shapes.primitives import mesh_files

if TYPE_CHECKING:
    import foxglove

DEFAULT_PORT: Final = 8765
"""Foxglove's."""
MAX_ASSET: Final = 64 << 20
"""Largest file that is sent [byte]."""
BACKLOG: Final = 256
"""Messages that wait for a client; then its oldest are dropped."""
PICTURE_BACKLOG: Final = 64
"""The same with cameras, whose messages have up to 8 MiB."""


@dataclass(frozen=True, slots=True)
class FoxgloveOptions:
    """How a session is served to Foxglove.

    Attributes:
        port: always of 127.0.0.1; 0: any free port.
        needed: whether the session must not begin without it; otherwise a notice says why it is not served.
    """

    port: int = DEFAULT_PORT
    needed: bool = False

    def open(self, network: Network) -> Outlet:
        """
        Raises:
            InvalidInput: it is needed, and the port cannot be used or the library is not installed.
        """
        try:
            return FoxgloveServer(network.publisher, network.changed, port=self.port)
        except InvalidInput as error:
            if self.needed:
                raise
            return Outlet("; ".join(f"{each.message}; {each.hint}" for each in error.findings))


class FoxgloveServer(Outlet):
    """Serves a session to Foxglove: an outlet.

    Args:
        publisher: of the session.
        changed: called, in any thread, when `wanted` has changed.
        port: to listen on; 0: any free port.

    Attributes:
        port: the port that it listens on.

    Raises:
        InvalidInput: USE148 the port cannot be used; USE149 the library is not installed.
    """

    def __init__(self, publisher: Publisher, changed: Callable[[], None], *, port: int = DEFAULT_PORT) -> None:
        library = _library()
        from foxglove.websocket import Capability

        offer = publisher.offer
        self._changed = changed
        self._latched = {topic: (data, 0) for topic, data in publisher.latched.items()}
        self._time = 0
        self._subscribers: set[tuple[int, str]] = set()
        self._wanted: frozenset[str] = frozenset()
        self._lock = threading.Lock()
        self._context = context = library.Context()  # its channels live as long as it does
        own = {channel.topic: channel.definition for channel in channel_table(publisher.recorded)}
        self._channels = {
            topic: library.Channel(
                topic, schema=_schema(kind, own.get(topic, "")), message_encoding="cdr", context=context
            )
            for topic, kind in offer.published.items()
        }
        assets = _assets(publisher)
        try:
            self._server = library.start_server(
                name="manipcli",
                host=HOST,
                port=port,
                capabilities=[Capability.ConnectionGraph, Capability.Time],
                server_listener=_Listener(self._subscribe, self._unsubscribe),
                asset_handler=lambda uri: asset(assets, uri),
                context=context,
                message_backlog_size=PICTURE_BACKLOG if offer.pictures else BACKLOG,
            )
        except RuntimeError as error:
            raise _unusable(port, str(error)) from None
        self.port: int = self._server.port
        super().__init__(f"Foxglove: ws://{HOST}:{self.port} (read-only)")
        self._server.publish_connection_graph(_graph(offer))

    def wanted(self) -> Collection[str]:
        return self._wanted

    def message(self, topic: str, ns: int, data: bytes) -> None:
        if topic == CLOCK:
            self._broadcast_time(ns)
        if topic in self._latched:
            self._latched[topic] = data, ns
        self._channels[topic].log(data, log_time=ns)

    def close(self) -> None:
        self._server.stop()

    def _subscribe(self, client: int, topic: str) -> None:
        """The last message of a latched topic goes to all its subscribers: the library cannot send to one of them."""
        self._repeat(topic)
        self._subscribed(self._subscribers.add, client, topic)

    def _unsubscribe(self, client: int, topic: str) -> None:
        self._subscribed(self._subscribers.discard, client, topic)

    def _subscribed(self, change: Callable[[tuple[int, str]], None], client: int, topic: str) -> None:
        """Whoever subscribes to anything gets the time, too."""
        with self._lock:
            change((client, topic))
            topics = {topic for _, topic in self._subscribers}
            self._wanted = frozenset(topics | {CLOCK} if topics else ())
        self._changed()

    def _repeat(self, topic: str) -> None:
        if topic in self._latched:
            data, ns = self._latched[topic]
            self._channels[topic].log(data, log_time=ns)

    def _broadcast_time(self, ns: int) -> None:
        """Time that goes back is that of the next log: clients then forget what they have."""
        if ns < self._time:
            self._server.clear_session()
            for topic in self._latched:
                self._repeat(topic)
        self._time = ns
        self._server.broadcast_time(ns)


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


def _assets(publisher: Publisher) -> dict[str, Path]:
    """The mesh files of robot and scene by URI, as in the URDF and the markers; read when they are fetched."""
    geometries = [g for link in publisher.robot.links for g in (*link.visuals, *link.collisions)]
    return mesh_files([*geometries, *(g for body in publisher.scene.bodies for g in body.geometries)])


def asset(files: Mapping[str, Path], uri: str) -> bytes | None:
    """The content of a file that clients may fetch.

    None if no mesh has this URI, or the file is missing or larger than `MAX_ASSET`.
    """
    path = files.get(uri)
    if path is None:
        return None
    try:
        with path.open("rb") as file:
            found = file.read(MAX_ASSET + 1)
    except OSError:
        return None
    return found if len(found) <= MAX_ASSET else None


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
