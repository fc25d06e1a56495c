"""HTTP server on 127.0.0.1 for one HTML page.

It refuses requests with another host name (`Host`, against DNS rebinding) or from another page (`Origin`). Other
programs and users of this machine can read the page.
"""

from __future__ import annotations

import errno
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from types import TracebackType
from typing import Self

from manipcli.core.errors import Diagnostic, InvalidInput

HOST = "127.0.0.1"
DEFAULT_PORT = 8080
MAX_PORTS = 100
"""Number of ports to try from `DEFAULT_PORT` on."""


def is_meant_for(host: str | None, origin: str | None, port: int) -> bool:
    """Whether a request with these headers is for the server at `port`, from its own page or without a page."""
    names = [f"{HOST}:{port}", f"localhost:{port}"]
    return host in names and (origin is None or origin in [f"http://{name}" for name in names])


def unusable_port(port: int, reason: str = "already in use", *, option: str = "--port") -> InvalidInput:
    """The error for a port that a server cannot listen on; `option` sets it."""
    hint = f"use another {option}, or omit it to use the first free port from {DEFAULT_PORT} on"
    return InvalidInput([Diagnostic("VIEW001", f"port {port} is {reason}", hint=hint)])


class PageServer:
    """Serves one page in a background thread. A context manager that closes the port at its end.

    Args:
        page: the HTML text.
        port: port to listen on; None: 8080 or the next free port; 0: any free port.

    Raises:
        InvalidInput: VIEW001 the port cannot be used.
    """

    def __init__(self, page: str, *, port: int | None = None) -> None:
        body = page.encode()

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                if not is_meant_for(self.headers["Host"], self.headers["Origin"], self.server.server_port):  # type: ignore[attr-defined]
                    self.send_error(HTTPStatus.FORBIDDEN, "Only browsers on this machine have access")
                elif self.path.partition("?")[0] != "/":
                    self.send_error(HTTPStatus.NOT_FOUND)
                else:
                    self.send_response(HTTPStatus.OK)
                    self.send_header("Content-Type", "text/html; charset=utf-8")
                    self.send_header("Content-Length", str(len(body)))
                    self.send_header("Cache-Control", "no-store")  # the next log may use the same port
                    self.end_headers()
                    self.wfile.write(body)

            def log_message(self, format: str, *arguments: object) -> None:
                """No log: stderr is for the user."""

        self._server = _listen(Handler, port)
        self.port = self._server.server_port
        self.url = f"http://{HOST}:{self.port}"
        self._thread = Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    block_on_close = False

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignored: a browser can close its connection early."""


def _listen(handler: type[BaseHTTPRequestHandler], port: int | None) -> ThreadingHTTPServer:
    ports = range(DEFAULT_PORT, DEFAULT_PORT + MAX_PORTS) if port is None else (port,)
    for candidate in ports:
        try:
            return _Server((HOST, candidate), handler)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise unusable_port(candidate, f"not usable: {error.strerror}") from error
    raise unusable_port(ports[-1])
