"""A viser server that is reachable only from this machine.

By default viser listens on every interface, answers every client, and lets any open page of the browser connect or
request a public tunnel. This server listens on 127.0.0.1, refuses requests with another host name (`Host`, against DNS
rebinding) or from another page (`Origin`), and has no tunnel. Programs of all users of this machine can still connect;
how many at once, how large their messages are and how fast they come is limited. Faults of a connection close it.
"""

from __future__ import annotations

import asyncio
import http
import io
import logging
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from html import escape
from typing import TYPE_CHECKING, Any, Final, Self
from urllib.parse import urlsplit
from weakref import WeakSet

from manipcli.core.errors import ManipcliError
from manipcli.replay.page_server import DEFAULT_PORT, HOST, is_meant_for, unusable_port

if TYPE_CHECKING:
    from types import TracebackType

    import viser
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

Answer = Callable[["ServerConnection", "Request"], "Response | None"]
"""Answers a request; None: it is answered as usual."""

MAX_BROWSERS: Final = 16
MAX_MESSAGE: Final = 1 << 20
"""Largest message from a browser [byte]."""
MESSAGES: Final = ("ViewerCameraMessage", "GuiUpdateMessage")
"""Those that a browser may send: its camera, and what somebody clicks and slides."""
RATE: Final = 400.0
"""Messages per second from a browser, and as many at once; a camera that moves sends 50."""


class Unguarded(ManipcliError):
    """The installed viser starts its server differently, so that its requests cannot be checked."""

    code = "VIEW101"


class LocalServer:
    """A viser server on 127.0.0.1. A context manager that stops it at the end.

    Args:
        title: of the panel and of the window.
        port: port to listen on; None: 8080 or the next free port; 0: any free port.
        option: which sets the port, for the hint of an error.
        check: answers requests before viser, instead of `of_this_machine`. What it sets in context variables holds for
            the callbacks of this connection that are coroutines.

    Raises:
        InvalidInput: VIEW001 the port is in use.
        Unguarded: the installed viser does not allow checking its requests.
    """

    def __init__(
        self, title: str, *, port: int | None = None, option: str = "--port", check: Answer | None = None
    ) -> None:
        import viser

        class Private(viser.ViserServer):
            def request_share_url(self, verbose: bool = True) -> str | None:
                return None

        # A browser that leaves during an update, or sends nonsense, is nothing for the user.
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        warnings.filterwarnings("ignore", message=r"\[viser\] .* does not match annotation")
        with _silent(), _checked_requests(check or of_this_machine, title) as made:
            server = Private(host=HOST, port=DEFAULT_PORT if port is None else port, label=title, verbose=False)
        self.viser: viser.ViserServer = server
        self._stopped = False
        if not made:
            self.stop()
            raise Unguarded("the installed viser cannot check its requests; install viser 1.1")
        if port and server.get_port() != port:
            self.stop()
            raise unusable_port(port, option=option)
        self.darken(False)
        server.gui.main_panel.dock_right()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.stop()

    def darken(self, dark: bool) -> None:
        """Dark or light colours of the panel, in all browsers."""
        self.viser.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False)

    @property
    def port(self) -> int:
        """Port of the server."""
        return self.viser.get_port()

    @property
    def url(self) -> str:
        """URL to open in a browser."""
        return f"http://{HOST}:{self.port}"

    def stop(self) -> None:
        """Close the port and all connections; can be called repeatedly."""
        if not self._stopped:
            self._stopped = True
            with _silent():
                self.viser.stop()


@contextmanager
def _silent() -> Iterator[None]:
    """Suppress the banners that viser prints to stdout, which is for results only."""
    with redirect_stdout(io.StringIO()):
        yield


def of_this_machine(connection: ServerConnection, request: Request) -> Response | None:
    """Refuses a request with another host name or from another page."""
    port = connection.local_address[1]
    if is_meant_for(request.headers.get("Host"), request.headers.get("Origin"), port):
        return None
    return connection.respond(http.HTTPStatus.FORBIDDEN, "Only browsers on this machine have access.\n")


@contextmanager
def _checked_requests(check: Answer, title: str) -> Iterator[list[object]]:
    """Check requests before viser answers them: viser has no option for it, but its websocket library has.

    Yields a list that is not empty once a server was started with the check.
    """
    from viser.infra import Message
    from websockets.asyncio import server as library
    from websockets.protocol import State

    before = library.serve
    made: list[object] = []
    connected: WeakSet[ServerConnection] = WeakSet()

    class Limited(library.ServerConnection):
        """Drops messages that no page of ours needs, and breaks off when too many come."""

        _left, _filled = RATE, 0.0

        async def recv(self, decode: bool | None = None) -> Any:
            while True:
                data = await super().recv(decode)
                now = time.monotonic()
                self._left = min(RATE, self._left + (now - self._filled) * RATE) - 1.0
                self._filled = now
                if self._left < 0.0:
                    self.transport.abort()  # a close frame would wait behind the flood
                if type(Message.deserialize(data)).__name__ in MESSAGES:  # type: ignore[arg-type]
                    return data

    class Checked(library.serve):
        def __init__(self, *arguments: object, process_request: Answer, **options: object) -> None:
            titled = _titled(process_request, title)

            def answer(connection: ServerConnection, request: Request) -> Response | None:
                # Faults of one connection are no texts for the user.
                asyncio.get_running_loop().set_exception_handler(lambda loop, context: None)
                try:
                    refused = check(connection, request)
                except LookupError:  # a header that is given twice
                    refused = connection.respond(http.HTTPStatus.BAD_REQUEST, "Duplicate header.\n")
                if refused is not None:
                    return refused
                if request.headers.get("Upgrade") is not None:
                    if sum(one.state in (State.CONNECTING, State.OPEN) for one in connected) >= MAX_BROWSERS:
                        return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, "Too many browsers.\n")
                    connected.add(connection)
                return titled(connection, request)

            # viser's other options are passed on unchanged.
            options |= {"max_size": MAX_MESSAGE, "create_connection": Limited, "logger": _quiet()}
            super().__init__(*arguments, process_request=answer, **options)  # type: ignore[arg-type]
            made.append(self)

    # Replace the class of the library while viser starts.
    library.serve = Checked  # type: ignore[misc, assignment]
    try:
        yield made
    finally:
        library.serve = before  # type: ignore[misc]


def _titled(process_request: Answer, title: str) -> Answer:
    """The same answers, with a title of the window: viser has no option for it."""

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        page = request.headers.get("Upgrade") is None and urlsplit(request.path).path == "/"
        if page and "Accept-Encoding" in request.headers:
            del request.headers["Accept-Encoding"]  # its text is needed
        response = process_request(connection, request)
        if page and response is not None and response.body is not None:
            named = f"<title>{escape(title)}</title>".encode()
            response.body = response.body.replace(b"<title>Viser</title>", named, 1)
            del response.headers["Content-Length"]
            response.headers["Content-Length"] = str(len(response.body))
        return response

    return answer


def _quiet() -> logging.Logger:
    """A logger that writes nothing."""
    logger = logging.getLogger("manipcli.view")
    logger.propagate = False
    logger.addHandler(logging.NullHandler())
    return logger
