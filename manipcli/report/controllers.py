"""The controllers of a task as a table or as JSON: who claims what."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.report.json import dumps, picked
from manipcli.report.table import table
from manipcli.task.controller_rows import ControllerRow

MOST = 3
"""So many joints of a controller are named in the table, and the last."""


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
