"""Controllers of a task as a table or as JSON: type, rate, state at the start and claimed interfaces."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.report.json import dumps, picked
from manipcli.report.table import table
from manipcli.task.controller_rows import ControllerRow

MOST = 3
"""Most joints of a controller that the table names."""


def render_text(rows: Sequence[ControllerRow]) -> str:
    """A table with one row per controller."""
    return table(
        ("controller", "type", "at the start", "rate", "claims"),
        [(row.name, row.type, row.state, f"{row.update_rate:g} Hz", _claims(row)) for row in rows],
        right=("rate",),
    )


def render_json(task: str, rows: Sequence[ControllerRow]) -> str:
    """`interfaces`: what a controller claims while it is active; `claimed`: what it claims at the start."""
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
    return text if row.active else f"when active: {text}"
