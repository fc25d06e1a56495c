"""The table of what `locate` corrected: belief against truth, before and after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from manipcli.core.units import readable
from manipcli.judge.located import Correction, PoseError

LOCATED: Final = ("located", "object", "belief was off by", "is off by", "measured")


def located_rows(corrections: Sequence[Correction]) -> list[tuple[str, ...]]:
    """A row for each correction, with these headers."""
    return [(each.step or "-", each.object, _error(each.before), _error(each.after), each.text) for each in corrections]


def _error(error: PoseError | None) -> str:
    if error is None:
        return "-"
    return f"{readable(error.position, 'm')}, {math.degrees(error.rotation):.1f} deg"
