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
    _require(remote, name)
    values = remote.call("/rosapi/get_param", {"name": name})
    _require_success(name, values)
    text = values.get("value")
    try:
        return json.loads(text) if isinstance(text, str) else text
    except ValueError:
        return text


def set_to(remote: Remote, name: str, value: str) -> None:
    """Set a parameter to a JSON value; see `get`."""
    _require(remote, name)
    _require_success(name, remote.call("/rosapi/set_param", {"name": name, "value": value}))


def _require(remote: Remote, name: str) -> None:
    known = names(remote)
    if name not in known:
        hint = did_you_mean(name, known, kind="parameters") or "the server has no parameters"
        raise RemoteFailed("LIVE192", f"no parameter '{name}'", hint=hint)


def _require_success(name: str, values: dict[str, object]) -> None:
    """Newer versions of rosapi answer whether it worked, and why not."""
    if values.get("successful") is False:
        raise RemoteFailed("LIVE191", f"{name}: {values.get('reason') or 'refused'}")
