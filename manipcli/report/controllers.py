"""The controllers of a task as a table or as JSON: who claims what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from manipcli.report.json import dumps
from manipcli.report.table import table

MOST = 3
"""So many joints of a controller are named in the table, and the last."""


class Row(Protocol):
    """A controller, at the start of a task."""

    @property
    def name(self) -> str: ...
    @property
    def type(self) -> str: ...
    @property
    def active(self) -> bool: ...
    @property
    def joints(self) -> tuple[str, ...]: ...
    @property
    def interfaces(self) -> tuple[str, ...]: ...
    @property
    def wanted(self) -> tuple[str, ...]: ...
    @property
    def update_rate(self) -> float: ...


def render_text(rows: Sequence[Row]) -> str:
    """A line a controller."""
    return table(
        ("controller", "type", "at the start", "rate", "claims"),
        [(row.name, row.type, _state(row), f"{row.update_rate:g} Hz", _claims(row)) for row in rows],
        right=("rate",),
    )


def render_json(task: str, rows: Sequence[Row]) -> str:
    """`interfaces` are those that a controller claims while it is active, `claimed` those that it does at the start."""
    return dumps(
        {
            "task": task,
            "controllers": [
                {
                    "name": row.name,
                    "type": row.type,
                    "state": _state(row),
                    "joints": list(row.joints),
                    "interfaces": list(row.wanted),
                    "claimed": list(row.wanted if row.active else ()),
                    "update_rate": row.update_rate,
                }
                for row in rows
            ],
        }
    )


def _state(row: Row) -> str:
    return "active" if row.active else "inactive"


def _claims(row: Row) -> str:
    if not row.wanted:
        return "nothing"
    names = list(row.joints)
    if len(names) > MOST + 1:
        names[MOST:-1] = ["..."]
        names[-1] += f" ({len(row.joints)} joints)"
    text = f"{', '.join(row.interfaces)} of {', '.join(names)}"
    return text if row.active else f"once active: {text}"
