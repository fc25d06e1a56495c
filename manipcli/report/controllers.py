"""The controllers of a task as a table or as JSON: who claims what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from manipcli.report.json import dumps, picked
from manipcli.report.table import table

MOST = 3
"""So many joints of a controller are named in the table, and the last."""


@dataclass(frozen=True, slots=True)
class ControllerRow:
    """One controller, at the start of a task.

    Attributes:
        name, type: as in the controllers file.
        active: whether it is, at the start.
        joints: that it commands or reads.
        interfaces: that it claims of each of its joints while it is active.
        update_rate: [Hz].
    """

    name: str
    type: str
    active: bool
    joints: tuple[str, ...]
    interfaces: tuple[str, ...]
    update_rate: float

    @property
    def state(self) -> str:
        """`active` or `inactive`."""
        return "active" if self.active else "inactive"

    @property
    def wanted(self) -> tuple[str, ...]:
        """The `joint/interface` that it claims while it is active."""
        return tuple(f"{joint}/{interface}" for joint in self.joints for interface in self.interfaces)


def render_text(rows: Sequence[ControllerRow]) -> str:
    """A line a controller."""
    return table(
        ("controller", "type", "at the start", "rate", "claims"),
        [(row.name, row.type, row.state, f"{row.update_rate:g} Hz", _claims(row)) for row in rows],
        right=("rate",),
    )


def render_json(task: str, rows: Sequence[ControllerRow]) -> str:
    """`interfaces` are those that a controller claims while it is active, `claimed` those that it does at the start."""
    controllers = [
        {
            **picked(row, "name type state joints"),
            "interfaces": list(row.wanted),
            "claimed": list(row.wanted if row.active else ()),
            "update_rate": row.update_rate,
        }
        for row in rows
    ]
    return dumps({"task": task, "controllers": controllers})


def _claims(row: ControllerRow) -> str:
    if not row.wanted:
        return "nothing"
    names = list(row.joints)
    if len(names) > MOST + 1:
        names[MOST:-1] = ["..."]
        names[-1] += f" ({len(row.joints)} joints)"
    text = f"{', '.join(row.interfaces)} of {', '.join(names)}"
    return text if row.active else f"once active: {text}"
