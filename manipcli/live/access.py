"""Who may connect, and who may command.

On 127.0.0.1 a page of another origin, or a request with another host name (DNS rebinding), is refused, as by `view`;
a valid token replaces the check of the origin. Commands need the token. A server on another address answers nobody
without it.
"""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import parse_qs, quote, urlsplit

from manipcli.replay.page_server import HOST, is_meant_for

MIN_TOKEN: Final = 16
"""Least characters of a token from a file."""


@dataclass(frozen=True, slots=True)
class Decision:
    """About one connection: whether it may command; `refused`: HTTP status and reason, None if it may connect."""

    commands: bool = False
    refused: tuple[int, str] | None = None


@dataclass(frozen=True, slots=True)
class Access:
    """Rules of a server.

    Attributes:
        token: that commands need; None: commands need none, on 127.0.0.1 only (`--open`).
        host: the address that the server listens on.
    """

    token: str | None
    host: str = HOST

    @property
    def local(self) -> bool:
        """Whether only this machine can connect."""
        return self.host == HOST

    @property
    def address(self) -> str:
        """The host in a URL for clients; of a server that listens on all addresses, that of this machine."""
        try:
            host = ip_address(self.host)
        except ValueError:  # a name
            return self.host
        if host.version == 4:
            return HOST if host.is_unspecified else self.host
        return "[::1]" if host.is_unspecified else f"[{self.host}]"

    def decide(
        self, path: str, *, port: int, host: str | None, origin: str | None, authorization: str | None
    ) -> Decision:
        """The decision on a request.

        Args:
            path: with the query.
            port: of the server.
            host, origin, authorization: its headers.
        """
        given = _tokens(path, authorization)
        known = self.token is not None and any(_same(text, self.token) for text in given)
        if given and not known and self.token is not None:
            return Decision(refused=(401, "wrong token"))
        if not self.local:
            return Decision(commands=True) if known else Decision(refused=(401, "a token is needed"))
        if not is_meant_for(host, None if known else origin, port):
            return Decision(refused=(403, "only programs and pages of this machine have access"))
        return Decision(commands=known or self.token is None)


def query(token: str | None) -> str:
    """The path and query of a URL that carries a token; "" without one."""
    return "" if token is None else f"/?token={quote(token, safe='')}"


def random_token() -> str:
    """A new token."""
    return secrets.token_urlsafe(24)


def _tokens(path: str, authorization: str | None) -> list[str]:
    """The tokens of a request: in its query, or its Authorization header."""
    try:
        found = parse_qs(urlsplit(path).query, max_num_fields=20).get("token", [])
    except ValueError:
        return ["?"]  # not a query: like a wrong token
    kind, _, value = (authorization or "").partition(" ")
    return [*found, value.strip()] if kind.lower() == "bearer" else found


def _same(first: str, second: str) -> bool:
    """Compares in a time that does not depend on the texts."""
    return hmac.compare_digest(first.encode("utf-8", "replace"), second.encode("utf-8", "replace"))
