"""A headless Chromium, driven through its DevTools protocol: open a page, look at it, click in it."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from urllib.request import urlopen

from websockets.sync.client import ClientConnection, connect

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
    "--window-size=1280,800",
)


class Page:
    """One page; what it asked for over the network and what it complained about is kept.

    `messages`: all lines of its console; `complaints`: its errors.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._number = 0
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.messages: list[str] = []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.ask(f"{domain}.enable")

    def __enter__(self) -> Page:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._socket.close()

    def ask(self, method: str, **parameters: object) -> dict[str, object]:
        """One command and its result; events that come before it are noted."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=120))
            if message.get("id") == self._number:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, event: dict[str, dict[str, object]]) -> None:
        match event:
            case {"method": "Network.requestWillBeSent", "params": {"request": {"url": str(url)}}}:
                self.requests.append(url)
            case {"method": "Network.webSocketCreated", "params": {"url": str(url)}}:
                self.requests.append(url)
            case {"method": "Runtime.exceptionThrown", "params": {"exceptionDetails": details}}:
                self.complaints.append(str(details))
            case {"method": "Log.entryAdded", "params": {"entry": {"level": str(level), "text": str(text)}}}:
                if "GL Driver Message (OpenGL, Performance" in text:
                    return  # of the renderer on the processor, where reading depths waits for the picture
                self.messages.append(text)
                if level == "error":
                    self.complaints.append(text)
            case {"method": "Runtime.consoleAPICalled", "params": {"args": list(values)}}:
                self.messages.append(" ".join(str(value.get("value")) for value in values))

    def open(self, url: str) -> None:
        self.ask("Page.navigate", url=url)

    def evaluate(self, script: str) -> object:
        """The value of a JavaScript expression."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        return answer["result"].get("value")  # type: ignore[attr-defined]

    def wait_for(self, script: str, seconds: float = 120.0) -> None:
        """Until an expression is true."""
        end = time.monotonic() + seconds
        while not self.evaluate(script):
            assert time.monotonic() < end, f"not within {seconds} s: {script}"
            time.sleep(0.2)

    def press(self, key: str) -> None:
        """A key, named as in `KeyboardEvent.key`."""
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, **(text if kind == "keyDown" else {}))

    def point(self, selector: str, x: float, y: float) -> None:
        """Move the mouse to a place of an element: 0 to 1 from left to right and from top to bottom."""
        box = json.loads(
            str(self.evaluate(f"JSON.stringify(document.querySelector({selector!r}).getBoundingClientRect())"))
        )
        at = {"x": box["x"] + x * box["width"], "y": box["y"] + y * box["height"]}
        self.ask("Input.dispatchMouseEvent", type="mouseMoved", **at)

    def screenshot(self) -> bytes:
        """A PNG file."""
        return base64.b64decode(str(self.ask("Page.captureScreenshot", format="png")["data"]))


@contextmanager
def started(program: str, folder: Path) -> Iterator[Page]:
    """An empty page of the browser `program`, with its profile in the new `folder`."""
    folder.mkdir()
    command = [program, *FLAGS, f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        written = folder / "DevToolsActivePort"
        end = time.monotonic() + 60
        while not (written.is_file() and written.read_text().count("\n")):
            assert process.poll() is None and time.monotonic() < end, "the browser does not start"
            time.sleep(0.1)
        port = int(written.read_text().splitlines()[0])
        with urlopen(f"http://127.0.0.1:{port}/json/list", timeout=60) as answer:
            target = next(one for one in json.loads(answer.read()) if one["type"] == "page")
        with Page(connect(target["webSocketDebuggerUrl"], max_size=None)) as page:
            yield page
    finally:
        process.terminate()
        process.wait(20)
