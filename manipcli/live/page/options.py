"""How a session is shown in the browser: plain data that opens the page in the process of the network."""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.live.outlet import Network, Outlet


@dataclass(frozen=True, slots=True)
class PageOptions:
    """The page.

    Attributes:
        token: that commands need; None: they need none.
        port: of 127.0.0.1; None: 8080 or the next free port; 0: any free port.
    """

    token: str | None
    port: int | None = None

    def open(self, network: Network) -> Outlet:
        """
        Raises:
            InvalidInput: VIEW001 the port cannot be used.
        """
        from manipcli.live.page.page import LivePage

        return LivePage(network, token=self.token, port=self.port)
