"""Client of a rosbridge server, for the command line: services, messages of a topic, publishing."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from types import TracebackType
from typing import Any, Final, Self
from urllib.parse import urlsplit

from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, ManipcliError

PATIENCE: Final = 10.0
"""[s] Longest wait for a connection or a response."""
MAX_MESSAGE: Final = 1 << 26
"""Largest message of a server [byte]."""
_REFUSED: Final = {
    401: "use the URL with the token, as `manipcli serve` prints it",
    403: "connect under the address that `manipcli serve` prints",
    503: "end other clients",
}
"""What to do about a status of HTTP."""


class RemoteFailed(ManipcliError):
    """The server cannot be reached, refuses, or does not answer.

    Attributes:
        code: LIVE130 no server, LIVE190 refused the connection, LIVE191 refused an operation, LIVE192 unknown name,
            LIVE193 no answer in time, LIVE194 the connection ended, LIVE195 another type.
        about: id of the operation that the server refused; "" if unknown.
    """

    exit_code = ExitCode.FAILED

    def __init__(self, code: str, message: str, *, hint: str | None = None, about: object = "") -> None:
        super().__init__(message)
        self._finding = Diagnostic(code, message, hint=hint)
        self.about = about

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return (self._finding,)


class Remote:
    """A connection to a server. A context manager that closes it.

    Args:
        url: `ws://HOST:PORT/?token=...`, or `wss://`.
        warn: called with each warning of the server.

    Raises:
        InvalidInput: USE157 the URL is not one of a WebSocket.
        RemoteFailed: from any method.
    """

    def __init__(self, url: str, *, warn: Callable[[str], None] = lambda text: None) -> None:
        self._where = _address(url)
        self._warn = warn
        self._number = 0
        try:
            from websockets.exceptions import WebSocketException
            from websockets.sync.client import connect
        except ImportError as error:
            hint = 'pip install "manipcli[live]"'
            raise RemoteFailed("LIVE130", "the library websockets is not installed", hint=hint) from error
        self._errors = (OSError, ValueError, WebSocketException)
        try:
            self._socket = connect(url, open_timeout=PATIENCE, max_size=MAX_MESSAGE)
        except self._errors as error:
            raise self._no_connection(error) from error
        self.send(op="set_level", id="set_level", level="warning")

    def _no_connection(self, error: Exception) -> RemoteFailed:
        status = getattr(getattr(error, "response", None), "status_code", None)
        if status is None:
            hint = "start one with `manipcli serve TASK`, or name another with --url"
            reason = getattr(error, "strerror", None) or str(error) or "no answer"
            return RemoteFailed("LIVE130", f"no server answers at {self._where}: {reason}", hint=hint)
        body = getattr(getattr(error, "response", None), "body", None) or b""
        reason = body.decode("utf-8", "replace").strip()[:200] or "no reason given"
        message = f"the server at {self._where} refuses the connection: {reason} (HTTP {status})"
        return RemoteFailed("LIVE190", message, hint=_REFUSED.get(status))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._socket.close()

    def id_for(self, op: str) -> str:
        """A new id of an operation."""
        self._number += 1
        return f"{op}:{self._number}"

    def call(self, service: str, request: object = None, *, patience: float = PATIENCE) -> dict[str, Any]:
        """The values of the response of a service.

        Args:
            service: its name.
            request: its fields; None: all at their defaults.
            patience: [s] longest wait.
        """
        id_ = self.id_for("call_service")
        self.send(op="call_service", id=id_, service=service, args={} if request is None else request)
        for message in self.received(patience):
            if message.get("op") == "service_response" and message.get("id") == id_:
                values = message.get("values")
                if message.get("result") is False:
                    raise RemoteFailed("LIVE191", f"{service}: {_text(values)}", about=id_)
                return values if isinstance(values, dict) else {}
        raise RemoteFailed("LIVE193", f"{service}: no response within {patience:g} s", hint="wait longer: --timeout")

    def publish(self, topic: str, message: object) -> None:
        """Publish one message; what the server refuses is raised by a later call."""
        self.send(op="publish", id=self.id_for("publish"), topic=topic, msg=message)

    def settle(self) -> None:
        """Wait until the server has taken or refused what was sent."""
        try:
            # In a live session the control loop answers it, after the messages. Other servers answer that they do not
            # have it, which does as well.
            self.call("/controller_manager/list_controllers")
        except RemoteFailed as failure:
            if failure.about != f"call_service:{self._number}":
                raise

    def subscribe(self, topic: str, kind: str = "") -> None:
        """Subscribe; `kind`: its type, or "" where the server knows it."""
        asked = {"op": "subscribe", "id": self.id_for("subscribe"), "topic": topic, "queue_length": 100}
        self.send(**asked, **({"type": kind} if kind else {}))

    def messages(self, topic: str, kind: str = "", *, patience: float | None = None) -> Iterator[dict[str, Any]]:
        """The messages of a topic, without an end.

        Args:
            topic, kind: as in `subscribe`.
            patience: [s] longest wait for each; None: no limit.
        """
        self.subscribe(topic, kind)
        while True:
            found = next((each for each in self.received(patience) if is_message(each, topic)), None)
            if found is None:
                raise RemoteFailed("LIVE193", f"{topic}: no message within {patience:g} s")
            values = found.get("msg")
            yield values if isinstance(values, dict) else {}

    def send(self, **frame: object) -> None:
        """Send an operation."""
        try:
            self._socket.send(json.dumps(frame))
        except self._errors as error:
            raise self._ended(error) from error

    def received(self, patience: float | None) -> Iterator[dict[str, Any]]:
        """What the server sends, for `patience` [s], or without an end.

        Raises:
            RemoteFailed: a status of level error; the connection ended.
        """
        until = None if patience is None else time.monotonic() + patience
        while until is None or time.monotonic() < until:
            try:
                found = json.loads(self._socket.recv(timeout=None if until is None else until - time.monotonic()))
            except TimeoutError:
                return
            except self._errors as error:
                raise self._ended(error) from error
            if not isinstance(found, dict):
                continue
            if found.get("op") == "status":
                self._status(found)
            yield found

    def _status(self, message: Mapping[str, Any]) -> None:
        if message.get("id") == "set_level":  # a server that does not know it
            return
        if message.get("level") == "error":
            raise RemoteFailed("LIVE191", _text(message.get("msg")), about=message.get("id", ""))
        if message.get("level") == "warning":
            self._warn(_text(message.get("msg")))

    def _ended(self, error: Exception) -> RemoteFailed:
        received = getattr(error, "rcvd", None)
        reason = f"{received.reason or 'closed'} ({received.code})" if received is not None else str(error)
        return RemoteFailed("LIVE194", f"the connection to {self._where} ended: {reason}")


def _address(url: str) -> str:
    """The URL without the token, for messages."""
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme not in ("ws", "wss") or not parts.hostname:
        message = f"'{url.partition('?')[0]}' is not the URL of a WebSocket"
        raise InvalidInput([Diagnostic("USE157", message, hint="write ws://127.0.0.1:9090/?token=...")])
    return f"{parts.scheme}://{parts.hostname}" + (f":{port}" if port is not None else "")


def is_message(frame: Mapping[str, Any], topic: str) -> bool:
    """Whether this is a message of a topic."""
    return frame.get("op") == "publish" and frame.get("topic") == topic


def _text(value: object) -> str:
    """The text of an error; a server of another program can send anything."""
    return value if isinstance(value, str) else json.dumps(value)
