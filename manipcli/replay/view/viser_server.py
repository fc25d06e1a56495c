"""A viser server that is reachable only from this machine.

By default viser listens on every interface, answers every client, and lets any open page of the browser connect or
request a public tunnel. This server listens on 127.0.0.1, refuses requests with another host name (`Host`, against DNS
rebinding) or from another page (`Origin`), and has no tunnel. Programs of all users of this machine can still connect.
"""

from __future__ import annotations

import http
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from typing import TYPE_CHECKING, Self

from manipcli.core.errors import ManipcliError
from manipcli.replay.page_server import DEFAULT_PORT, HOST, is_meant_for, unusable_port

if TYPE_CHECKING:
    from types import TracebackType

    import viser
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

Answer = Callable[["ServerConnection", "Request"], "Response | None"]


class Unguarded(ManipcliError):
    """The installed viser starts its server differently, so that its requests cannot be checked."""

    code = "VIEW101"


class LocalServer:
    """A viser server on 127.0.0.1. A context manager that stops it at the end.

    Args:
        title: title of the panel.
        port: port to listen on; None: 8080 or the next free port; 0: any free port.

    Raises:
        InvalidInput: VIEW001 the port is in use.
        Unguarded: the installed viser does not allow checking its requests.
    """

    def __init__(self, title: str, *, port: int | None = None) -> None:
        import viser

        class Private(viser.ViserServer):
            def request_share_url(self, verbose: bool = True) -> str | None:
                return None

        with _silent(), _checked_requests() as made:
            server = Private(host=HOST, port=DEFAULT_PORT if port is None else port, label=title, verbose=False)
        self.viser: viser.ViserServer = server
        self._stopped = False
        if not made:
            self.stop()
            raise Unguarded("the installed viser cannot check its requests; install viser 1.1")
        if port and server.get_port() != port:
            self.stop()
            raise unusable_port(port)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.stop()

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


@contextmanager
def _checked_requests() -> Iterator[list[object]]:
    """Check requests before viser answers them: viser has no option for it, but its websocket library has.

    Yields a list that is not empty once a server was started with the check.
    """
    from websockets.asyncio import server as library

    before = library.serve
    made: list[object] = []

    class Checked(library.serve):
        def __init__(self, *arguments: object, process_request: Answer, **options: object) -> None:
            def answer(connection: ServerConnection, request: Request) -> Response | None:
                port = connection.local_address[1]
                if is_meant_for(request.headers.get("Host"), request.headers.get("Origin"), port):
                    return process_request(connection, request)
                return connection.respond(http.HTTPStatus.FORBIDDEN, "Only browsers on this machine have access.\n")

            # viser's options are passed on unchanged.
            super().__init__(*arguments, process_request=answer, **options)  # type: ignore[arg-type]
            made.append(self)

    # Replace the class of the library while viser starts.
    library.serve = Checked  # type: ignore[misc, assignment]
    try:
        yield made
    finally:
        library.serve = before  # type: ignore[misc]
