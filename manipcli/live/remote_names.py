"""Names and types that a rosbridge server offers, asked from its rosapi, with the nearest names for unknown ones."""

from __future__ import annotations

from typing import Any, Final

from manipcli.core.text import did_you_mean
from manipcli.live.remote import Remote, RemoteFailed

TOPICS: Final = "topics"
SERVICES: Final = "services"
ACTIONS: Final = "actions"


def topics(remote: Remote) -> dict[str, str]:
    """All topics and their types."""
    found = remote.call("/rosapi/topics")
    types = _texts(found.get("types"))
    return {name: types[k] if k < len(types) else "" for k, name in enumerate(_texts(found.get("topics")))}


def nodes_of_topic(remote: Remote, name: str) -> dict[str, list[str]]:
    """Nodes that publish a topic, and those that subscribe it, by the words of `ros2 topic info`."""
    found = {}
    for word, service in (("Publisher", "publishers"), ("Subscription", "subscribers")):
        found[word] = _texts(remote.call(f"/rosapi/{service}", {"topic": name}).get(service))
    return found


def services(remote: Remote) -> list[str]:
    """All services."""
    return _texts(remote.call("/rosapi/services").get("services"))


def actions(remote: Remote) -> list[str]:
    """All actions."""
    return _texts(remote.call("/rosapi/action_servers").get("action_servers"))


def service_type(remote: Remote, name: str) -> str:
    """The type of a service; "" if the server does not know it."""
    return str(remote.call("/rosapi/service_type", {"service": name}).get("type") or "")


def action_type(remote: Remote, name: str) -> str:
    """The type of an action; "" if the server does not know it."""
    return str(remote.call("/rosapi/action_type", {"action": name}).get("type") or "")


def known_type(remote: Remote, kind: str, name: str, given: str | None = None) -> str:
    """The type of a topic, service or action; "" for a server without rosapi, where `given` is returned.

    Args:
        remote: the connection.
        kind: `topics`, `services` or `actions`.
        name: its name.
        given: the type that the user wrote, with or without `/msg/`.

    Raises:
        RemoteFailed: LIVE192 no such name; LIVE195 another type.
    """
    try:
        found = topics(remote) if kind == TOPICS else _one(remote, kind, name)
    except RemoteFailed as failure:
        if failure.findings[0].code == "LIVE191":  # no rosapi there: the server itself refuses what is wrong
            return given or ""
        raise
    if name not in found:
        noun = kind.removesuffix("s")
        raise RemoteFailed("LIVE192", f"no {noun} '{name}'", hint=did_you_mean(name, found, kind=kind))
    own = found[name]
    if given and own and short_type(given) != short_type(own):
        raise RemoteFailed("LIVE195", f"'{name}' is of type {own}, not {given}")
    return own or given or ""


def _one(remote: Remote, kind: str, name: str) -> dict[str, str]:
    """All names of a kind, and the type of one of them."""
    names = services(remote) if kind == SERVICES else actions(remote)
    if name not in names:
        return dict.fromkeys(names, "")
    own = service_type(remote, name) if kind == SERVICES else action_type(remote, name)
    return {**dict.fromkeys(names, ""), name: own}


def short_type(kind: str) -> str:
    """`std_msgs/String` of `std_msgs/msg/String`: as ROS 1 writes it."""
    parts = kind.split("/")
    return f"{parts[0]}/{parts[-1]}"


def _texts(value: Any) -> list[str]:
    return [each for each in value if isinstance(each, str)] if isinstance(value, list) else []
