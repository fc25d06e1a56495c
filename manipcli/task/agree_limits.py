"""Errors in `agree.margins` that are known before a run: names without an expectation, units that no margin has."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from manipcli.conditions.formula import units_of
from manipcli.conditions.members import CONDITIONS
from manipcli.core.errors import Diagnostic
from manipcli.core.text import did_you_mean
from manipcli.core.units import NUMBER, Dimension, parse_unit
from manipcli.judge.expectation import labels
from manipcli.spec.agree import amount_of
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec

UNNAMED: Final = 230
MISFIT: Final = 246
"""Numbers of the codes."""


def unusable_limits(task: Located[TaskSpec]) -> Iterator[Diagnostic]:
    """An error for each limit of a margin that does not exist, or that never has the unit of the limit.

    A condition whose margin can have several units (`slip`: m or rad) accepts each of them here: only the run shows
    which part decides.
    """
    spec = task.spec
    named = dict(zip(labels(spec.judged), spec.judged, strict=True))
    for name, amount in spec.agree.margins.items():
        at = ("agree", "margins", name)
        if name not in named:
            near = did_you_mean(name, tuple(named), kind="expectations")
            yield task.source.finding(UNNAMED, at, f"the task has no expectation '{name}'", hint=near, key=True)
            continue
        quantity = amount_of(amount) if isinstance(amount, str) else None
        units = units_of(named[name].condition, CONDITIONS)
        if quantity is None or quantity.dimension in (NUMBER, *(_dimension(unit) for unit in units)):
            continue
        words = f"in {' or '.join(filter(None, units))}" if any(units) else "without a unit"
        message = f"'{amount}' is {quantity.dimension.name}; the margin is {words}"
        hint = "write an amount in this unit, or a share: 20 %" if any(units) else "write a number, or a share: 20 %"
        yield task.source.finding(MISFIT, at, message, hint=hint)


def _dimension(unit: str) -> Dimension:
    return parse_unit(unit).dimension if unit else NUMBER
