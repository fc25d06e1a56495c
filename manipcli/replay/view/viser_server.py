"""A page in the browser that only this machine sees.

viser serves page and data on one port. As it comes it listens on every interface, answers whoever asks, and lets any
page that is open in the browser join in, or ask for a tunnel that makes the scene public. Here it listens on 127.0.0.1,
refuses requests that were not meant for it (`Host`, against names that are bound to 127.0.0.1 later) or that come from
another page (`Origin`), and has no tunnel. What remains: programs of this machine, other users' too, can look.
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
    """The installed viser starts its server in another way, so that the checks of requests would not be made."""

    code = "VIEW101"


class LocalServer:
    """A viser server on 127.0.0.1. A context manager: it stops at the end.

    Args:
        title: at the top of the panel.
        port: to listen on; None takes 8080 or the next free one, 0 any free one.

    Raises:
        InvalidInput: VIEW001 the port is taken.
        Unguarded: this viser does not let its requests be checked.
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
            raise Unguarded("the installed viser cannot be kept to its own page; install viser 1.1")
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
        """Where it listens."""
        return self.viser.get_port()

    @property
    def url(self) -> str:
        """What to open in a browser."""
        return f"http://{HOST}:{self.port}"

    def stop(self) -> None:
        """Close the port and every connection; again does nothing."""
        if not self._stopped:
            self._stopped = True
            with _silent():
                self.viser.stop()


@contextmanager
def _silent() -> Iterator[None]:
    """viser prints banners to stdout, where only results belong."""
    with redirect_stdout(io.StringIO()):
        yield


@contextmanager
def _checked_requests() -> Iterator[list[object]]:
    """Put our check before viser's answers: its server has no option for it, but the library beneath has.

    Yields a list that holds something once a server was started under the check.
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
                return connection.respond(http.HTTPStatus.FORBIDDEN, "Only for the browser of this machine.\n")

            # What viser passes on is the library's business: handed through unread.
            super().__init__(*arguments, process_request=answer, **options)  # type: ignore[arg-type]
            made.append(self)

    # A class stands in for the library's class of this name, for as long as viser starts.
    library.serve = Checked  # type: ignore[misc, assignment]
    try:
        yield made
    finally:
        library.serve = before  # type: ignore[misc]
