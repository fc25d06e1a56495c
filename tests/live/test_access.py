"""Who may connect and command: every combination of address, token, host and origin, against the rules in words."""

from __future__ import annotations

import itertools
from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.live.access import Access
from manipcli.live.session import LiveOptions

TOKEN = "0123456789abcdef"
HOSTS = ("127.0.0.1:9090", "localhost:9090", "evil.example:9090", None)
ORIGINS = (None, "http://127.0.0.1:9090", "http://localhost:9090", "http://evil.example", "null")
QUERIES = ("/", f"/?token={TOKEN}", "/?token=wrong", "/?token=", "/?token=%E9", f"/?token=wrong&token={TOKEN}")
HEADERS = (None, f"Bearer {TOKEN}", "Bearer wrong", "Basic x")


@pytest.mark.parametrize("address", ["127.0.0.1", "0.0.0.0"])
def test_reading_needs_the_same_origin_and_commanding_the_token(address: str) -> None:
    access = Access(TOKEN, address)
    for host, origin, path, header in itertools.product(HOSTS, ORIGINS, QUERIES, HEADERS):
        decision = access.decide(path, port=9090, host=host, origin=origin, authorization=header)
        known = TOKEN in path or TOKEN in (header or "")
        wrong = not known and ("wrong" in path or "%E9" in path or "wrong" in (header or ""))
        if address == "127.0.0.1":
            own_host = host in HOSTS[:2]
            may = own_host and not wrong and (known or origin in ORIGINS[:3])
        else:
            may = known
        assert (decision.refused is None) == may, (host, origin, path, header)
        assert decision.commands == (may and known)


def test_an_open_server_still_refuses_pages_of_others() -> None:
    access = Access(None)
    local = access.decide("/", port=9090, host="127.0.0.1:9090", origin=None, authorization=None)
    assert local.commands
    page = access.decide("/", port=9090, host="127.0.0.1:9090", origin="http://evil.example", authorization=None)
    rebound = access.decide("/", port=9090, host="evil.example:9090", origin=None, authorization=None)
    assert page.refused is not None
    assert rebound.refused is not None


@given(st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=16))
def test_a_token_of_any_signs_opens_the_server_at_the_address_that_is_printed(token: str) -> None:
    access = Access(token)
    parts = urlsplit(LiveOptions(access).url(9090))
    request = f"{parts.path}?{parts.query}"
    assert parts.fragment == ""
    assert access.decide(request, port=9090, host=parts.netloc, origin=None, authorization=None).commands


@pytest.mark.parametrize(
    ("host", "reached"),
    [
        ("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "127.0.0.1"), ("::", "::1"), ("::1", "::1"),
        ("10.0.0.7", "10.0.0.7"), ("fe80::1", "fe80::1"), ("cell.example", "cell.example"),
    ],
)  # fmt: skip
def test_clients_can_connect_to_the_address_that_is_printed(host: str, reached: str) -> None:
    """The URL has the host and the port, as a library of URLs reads it."""
    parts = urlsplit(LiveOptions(Access(TOKEN, host)).url(9091))
    assert (parts.hostname, parts.port) == (reached, 9091)
