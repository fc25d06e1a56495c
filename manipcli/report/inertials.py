"""Where the inertials of links come from, if not from the description: as a table, and from the metadata of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from manipcli.core.text import digits
from manipcli.model.robot import LinkInertial
from manipcli.record.attachments import INERTIALS
from manipcli.report.table import table


def render_table(rows: Sequence[LinkInertial]) -> str:
    """One row per link, then the mass of all of them."""
    cells = [
        (row.link, row.kind, digits(row.mass), _three(row.centre), _three(row.moments), row.source) for row in rows
    ]
    headers = ("link", "inertial", "mass [kg]", "centre [m]", "principal moments [kg m2]", "from")
    total = digits(sum(row.mass for row in rows))
    return f"{table(headers, cells, right=('mass [kg]',))}\n{total} kg in these links"


def recorded_inertials(metadata: Mapping[str, Mapping[str, str]]) -> tuple[tuple[str, str], ...]:
    """Name and value for each link of a log: ("inertial of link_1", "estimated: 4.2 kg, ...")."""
    return tuple((f"inertial of {link}", how) for link, how in metadata.get(INERTIALS, {}).items())


def _three(values: Sequence[float]) -> str:
    return " ".join(f"{round(value, 6) + 0.0:.3g}" for value in values)
