"""Asynchronous client of a live session: services, goals that can be cancelled, and the last message of a topic."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

PATIENCE: Final = 30.0
"""[s] Longest wait for a response; goals have none."""
MAX_MESSAGE: Final = 1 << 24
"""Largest message of the server [byte]."""


class CallFailed(Exception):
    """The session refuses a request, does not answer it, or has ended."""


class Caller:
    """A connection, for one request at a time. An asynchronous context manager.

    Args:
        url: of the session, with its token.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._number = 0
        self._lock = asyncio.Lock()
        self._socket: ClientConnection | None = None
        self._cancelling: asyncio.Future[str] | None = None

    async def __aenter__(self) -> Self:
        from websockets.asyncio.client import connect

        self._socket = await connect(self._url, max_size=MAX_MESSAGE)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._socket is not None:
            await self._socket.close()

    async def call(self, service: str, request: Mapping[str, object]) -> dict[str, Any]:
        """The response of a service.

        Raises:
            CallFailed: it refuses, or does not answer.
        """
        async with self._lock:
            id_ = await self._send(op="call_service", service=service, args=request)
            return _values(service, await self._within(id_, "service_response"))

    async def goal(self, action: str, kind: str, goal: Mapping[str, object]) -> dict[str, Any]:
        """The result of a goal, however long it takes; a cancelled caller cancels it.

        Raises:
            CallFailed: it is refused, or the session ends.
        """
        await self._lock.acquire()
        self._number += 1
        id_ = f"goal:{self._number}"
        # A task of its own: it takes the result of a cancelled goal, too, before the next request.
        asking = asyncio.ensure_future(self._goal(id_, action=action, action_type=kind, args=goal))
        asking.add_done_callback(self._asked)
        try:
            return await asyncio.shield(asking)
        except asyncio.CancelledError:
            self._cancelling = asyncio.ensure_future(self._send(op="cancel_action_goal", action=action, id=id_))
            raise

    async def _goal(self, id_: str, **goal: object) -> dict[str, Any]:
        await self._send(op="send_action_goal", id=id_, **goal)
        return _values(str(goal["action"]), await self._answer(id_, "action_result"))

    def _asked(self, asking: asyncio.Future[dict[str, Any]]) -> None:
        self._lock.release()
        if not asking.cancelled():
            asking.exception()  # it is retrieved, also where nobody waits any more

    async def latest(self, topic: str) -> dict[str, Any]:
        """The next message of a topic.

        Raises:
            CallFailed: there is none.
        """
        async with self._lock:
            id_ = await self._send(op="subscribe", topic=topic, queue_length=1)
            try:
                found: dict[str, Any] = (await self._within(id_, "publish", topic))["msg"]
            finally:
                await self._send(op="unsubscribe", topic=topic)
            return found

    async def _send(self, **frame: object) -> str:
        """Send an operation; returns its id."""
        from websockets.exceptions import ConnectionClosed

        assert self._socket is not None
        self._number += 1
        id_ = str(frame.setdefault("id", f"call:{self._number}"))
        try:
            await self._socket.send(json.dumps(frame))
        except ConnectionClosed:
            raise CallFailed("the session has ended") from None
        return id_

    async def _within(self, id_: str, op: str, topic: str = "") -> dict[str, Any]:
        try:
            async with asyncio.timeout(PATIENCE):
                return await self._answer(id_, op, topic)
        except TimeoutError:
            raise CallFailed(f"no answer within {PATIENCE:g} s") from None

    async def _answer(self, id_: str, op: str, topic: str = "") -> dict[str, Any]:
        """The next message with this op and id, or of this topic."""
        from websockets.exceptions import ConnectionClosed

        assert self._socket is not None
        while True:
            try:
                found: dict[str, Any] = json.loads(await self._socket.recv())
            except ConnectionClosed:
                raise CallFailed("the session has ended") from None
            if found.get("op") == "status" and found.get("id") == id_ and found.get("level") == "error":
                raise CallFailed(str(found.get("msg")))
            if found.get("op") == op and (found.get("topic") == topic if topic else found.get("id") == id_):
                return found


def _values(name: str, answer: Mapping[str, Any]) -> dict[str, Any]:
    values = answer.get("values")
    if not isinstance(values, dict):  # the text of an error
        raise CallFailed(f"{name}: {values}")
    return values
