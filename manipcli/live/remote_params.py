"""Parameters of a rosbridge server, by the services of its rosapi; a name is `/node:name`, a value is JSON."""

from __future__ import annotations

import json

from manipcli.core.text import did_you_mean
from manipcli.live.remote import Remote, RemoteFailed


def names(remote: Remote) -> list[str]:
    """All parameters."""
    found = remote.call("/rosapi/get_param_names").get("names")
    return [each for each in found if isinstance(each, str)] if isinstance(found, list) else []


def get(remote: Remote, name: str) -> object:
    """The value of a parameter.

    Raises:
        RemoteFailed: LIVE192 no such parameter; LIVE191 the server refuses.
    """
    try:
        values = _done(remote, "/rosapi/get_param", {"name": name})
    except RemoteFailed as failure:
        _require(remote, name)
        raise failure from None
    text = values.get("value")
    if text in (None, "", "null"):  # what servers of ROS answer for an unknown name
        _require(remote, name)
    try:
        return json.loads(text) if isinstance(text, str) else text
    except ValueError:
        return text


def set_to(remote: Remote, name: str, value: str) -> None:
    """Set a parameter to a JSON value; see `get`."""
    try:
        _done(remote, "/rosapi/set_param", {"name": name, "value": value})
    except RemoteFailed as failure:
        _require(remote, name)
        raise failure from None


def _done(remote: Remote, service: str, request: dict[str, str]) -> dict[str, object]:
    """The response; newer versions of rosapi answer whether it worked, and why not."""
    values = remote.call(service, request)
    if values.get("successful") is False:
        raise RemoteFailed("LIVE191", f"{request['name']}: {values.get('reason') or 'refused'}")
    return values


def _require(remote: Remote, name: str) -> None:
    known = names(remote)
    if name not in known:
        hint = did_you_mean(name, known, kind="parameters") or "the server has no parameters"
        raise RemoteFailed("LIVE192", f"no parameter '{name}'", hint=hint)
