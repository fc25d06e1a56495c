"""A browser of a test: viser's protocol over a raw WebSocket, without a picture."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Self

import msgspec
import viser
import zstandard
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (1.0, 1.0, 1.0), "fov": 1.0, "near": 0.01,
    "far": 100.0, "image_height": 600, "image_width": 800, "look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0),
}  # fmt: skip


class Visitor:
    """Connects, and sends its camera as viser's page does.

    Attributes:
        inputs: last properties of elements with a label or a content, by uuid.
    """

    def __init__(self, port: int, token: str | None = None) -> None:
        query = "" if token is None else f"/?token={token}"
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self.socket: ClientConnection = connect(f"ws://127.0.0.1:{port}{query}", subprotocols=[protocol], max_size=None)
        self.inputs: dict[str, dict[str, Any]] = {}
        self.send(**CAMERA)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.socket.close()

    def send(self, **message: Any) -> None:
        self.socket.send(msgspec.msgpack.encode(message))

    def set(self, uuid: str, value: object) -> None:
        """As somebody who slides or clicks."""
        self.send(type="GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def until(self, condition: Callable[[], object], seconds: float = 20.0) -> None:
        """Read until something is true."""
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "the page did not become what it should"
            with suppress(TimeoutError):
                data = self.socket.recv(timeout=0.05)
                assert isinstance(data, bytes)
                size = int.from_bytes(data[8:16], "little")
                found = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16 : 16 + size]))
                for message in found["messages"]:
                    self._read(message)

    def _read(self, message: dict[str, Any]) -> None:
        if message["type"] == "GuiUpdateMessage":
            self.inputs.get(message["uuid"], {}).update(message["updates"])
        elif "props" in message and {"label", "content"} & message["props"].keys():
            kind = {"type": message["type"], "value": message.get("value")}
            self.inputs[message["uuid"]] = {**message["props"], **kind}

    def labels(self, kind: str) -> dict[str, str]:
        """Uuids of the elements of a kind ("Button", "Slider", ...) by label."""
        return {one["label"]: uuid for uuid, one in self.inputs.items() if one["type"] == f"Gui{kind}Message"}

    @property
    def text(self) -> str:
        """All texts."""
        return "\n".join(str(one["content"]) for one in self.inputs.values() if "content" in one)
