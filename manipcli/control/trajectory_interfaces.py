"""Which sets of interfaces a joint trajectory controller may command and read: ROS 2's rules."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, get_args

from manipcli.core.text import did_you_mean
from manipcli.spec.controllers import Interface

COMMANDED: Final[tuple[tuple[Interface, ...], ...]] = (
    ("position",),
    ("position", "velocity"),
    ("position", "velocity", "acceleration"),
    ("velocity",),
    ("effort",),
    ("position", "effort"),
)
READ: Final[tuple[tuple[Interface, ...], ...]] = COMMANDED[:3]


def controlled_by_error(command_interfaces: Sequence[str]) -> bool:
    """Whether a PID makes the command: a velocity or an effort alone."""
    return tuple(command_interfaces) in {("velocity",), ("effort",)}


def refused(command_interfaces: Sequence[str], state_interfaces: Sequence[str]) -> tuple[str, str] | None:
    """What is wrong with such interfaces, and a hint; None when nothing is."""
    for what, given, legal in (("command", command_interfaces, COMMANDED), ("state", state_interfaces, READ)):
        for one in given:
            if one not in get_args(Interface):
                known = get_args(Interface)
                return f"unknown {what} interface '{one}'", did_you_mean(one, known, kind="interfaces") or ""
        if len(set(given)) < len(given) or set(given) not in [set(one) for one in legal]:
            sets = "; ".join(f"[{', '.join(one)}]" for one in legal)
            return f"{what}_interfaces [{', '.join(given)}] are not a set that it serves", f"expected {sets}"
    if "velocity" not in state_interfaces and (
        controlled_by_error(command_interfaces) or "effort" in command_interfaces
    ):
        message = f"state_interfaces [{', '.join(state_interfaces)}] lack the velocity that commands of "
        return message + f"[{', '.join(command_interfaces)}] need", "say state_interfaces: [position, velocity]"
    return None
