"""A client of a rosbridge server, for the command line."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Final, Self

from manipcli.core.errors import ExitCode, ManipcliError
from manipcli.live.interfaces.controller_manager import LIST_CONTROLLERS

DEFAULT_URL: Final = "ws://127.0.0.1:9090"
PATIENCE: Final = 10.0
"""[s] Longest wait for a response."""


class RemoteFailed(ManipcliError):
    """The server cannot be reached, or refuses."""

    code = "LIVE130"
    exit_code = ExitCode.FAILED


class Remote:
    """A connection to the server at `url`. A context manager that closes it.

    Raises:
        RemoteFailed: from any method.
    """

    def __init__(self, url: str) -> None:
        try:
            from websockets.exceptions import WebSocketException
            from websockets.sync.client import connect
        except ImportError as error:
            raise RemoteFailed('the library websockets is not installed: pip install "manipcli[live]"') from error
        self._errors = (OSError, ValueError, WebSocketException)
        self._where = url.partition("?")[0]
        try:
            self._socket = connect(url, open_timeout=PATIENCE, max_size=1 << 26)
        except self._errors as error:
            raise RemoteFailed(f"no server answers at {self._where}: {error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._socket.close()

    def call(self, service: str, **request: Any) -> dict[str, Any]:
        """The values of the response of a service."""
        self._send(op="call_service", id="call", service=service, args=request)
        for message in self._messages(PATIENCE):
            if message.get("op") == "service_response":
                if not message.get("result"):
                    raise RemoteFailed(f"{service}: {message.get('values')}")
                values = message.get("values")
                return values if isinstance(values, dict) else {}
            _raise_status(message)
        raise RemoteFailed(f"{service}: no response within {PATIENCE:g} s")

    def topics(self) -> dict[str, str]:
        """All topics and their types."""
        found = self.call("/rosapi/topics")
        return dict(zip(found.get("topics", ()), found.get("types", ()), strict=False))

    def publish(self, topic: str, kind: str, message: object) -> None:
        """Publish one message; the server has taken or refused it when this returns."""
        self._send(op="advertise", topic=topic, type=kind)
        self._send(op="publish", topic=topic, msg=message)
        self.call(LIST_CONTROLLERS)  # answered by the control loop, after the message

    def messages(self, topic: str) -> Iterator[dict[str, Any]]:
        """The messages of a topic, without an end."""
        self._send(op="subscribe", topic=topic)
        for message in self._messages(None):
            _raise_status(message)
            if message.get("op") == "publish":
                yield message["msg"]

    def _send(self, **frame: object) -> None:
        try:
            self._socket.send(json.dumps(frame))
        except self._errors as error:
            raise RemoteFailed(f"{self._where}: {error}") from error

    def _messages(self, patience: float | None) -> Iterator[dict[str, Any]]:
        until = None if patience is None else time.monotonic() + patience
        while until is None or time.monotonic() < until:
            try:
                found = json.loads(self._socket.recv(timeout=None if until is None else until - time.monotonic()))
            except TimeoutError:
                return
            except self._errors as error:
                raise RemoteFailed(f"{self._where}: {error}") from error
            if isinstance(found, dict):
                yield found


def _raise_status(message: dict[str, Any]) -> None:
    if message.get("op") == "status" and message.get("level") == "error":
        raise RemoteFailed(str(message.get("msg")))
