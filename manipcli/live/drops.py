"""Reports of messages that a client did not read in time: a status for it, a line of `/rosout` for all.

The line is not in the log: how fast somebody reads depends on the machine, and a log is simulated again.
"""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.live.connection import Connection
from manipcli.record.channels import ROSOUT
from manipcli.record.json_message import compact, definition, from_json
from manipcli.record.schemas import LOG

_WARN = 30


def report_drops(connection: Connection) -> list[str]:
    """Send a client the number of its dropped messages of each topic since the last call.

    Returns:
        The `publish` operations of the same on `/rosout`.
    """
    lines = []
    for one in connection.outbox.subscriptions.values():
        if one.dropped:
            text = f"{one.topic}: {one.dropped} messages were dropped; read faster or throttle"
            connection.status("warning", text)
            stamp = connection.services.rosapi.now
            lines.append(drop_line(f"client {connection.number}: {text}", stamp))
            one.dropped = 0
    return lines


def drop_line(text: str, stamp: Mapping[str, int]) -> str:
    """The `publish` operation of a text on `/rosout`; `stamp`: builtin_interfaces/Time."""
    values = {"stamp": {**stamp}, "level": _WARN, "name": "manipcli", "msg": text, "function": "dropped"}
    message = from_json(definition(LOG), values)
    return compact({"op": "publish", "topic": ROSOUT, "msg": message})
