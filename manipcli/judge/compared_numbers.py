"""The numbers of several runs of one task, side by side, with the difference that `agree:` allows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, TypeVar

from manipcli.core.units import NUMBER, parse_unit
from manipcli.judge.measured_run import MeasuredRun, Number
from manipcli.judge.measures.floors import share_of
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome
from manipcli.spec.agree import AgreeSpec, amount_of

T = TypeVar("T")
Kind = Literal["margin", "duration", "step_duration", "slip", "rotation", "grasp_force", "contact_force"]
"""A compared number; `duration` is that of the task, `contact_force` the largest of a step."""


@dataclass(frozen=True, slots=True)
class Row:
    """One number of all runs.

    Attributes:
        kind, name: of the number; `name` is an expectation, a step or a body, and "" for the duration of the task.
        values: of each run; None where it has none.
        outcomes: of the expectation in each run; empty for other numbers.
        difference: between the largest and the smallest value of the engines, in `unit`; None with fewer than two
            values; infinite where their units differ (another part of a condition decides).
        allowed: limit of the difference in its unit; None: any.
        misfit: why the limit of the task cannot be used: its unit is not that of the number; "" where it can.
    """

    kind: Kind
    name: str
    values: tuple[Number | None, ...]
    outcomes: tuple[str, ...] = ()
    difference: float | None = None
    allowed: float | None = None
    misfit: str = ""

    @property
    def unit(self) -> str:
        """SI unit of the first known value; "" without one."""
        return next((value.unit for value in self.values if value is not None), "")

    @property
    def agrees(self) -> bool:
        """Whether the difference is allowed; a number that a run does not have is not compared."""
        if self.misfit:
            return False
        return self.allowed is None or self.difference is None or self.difference <= self.allowed


def rows_of(runs: Sequence[MeasuredRun]) -> Iterator[Row]:
    """All numbers: margins, durations, grasps, peak forces of steps."""
    agree = runs[0].agree
    judged = [by_name(run.verdict.expectations, lambda expectation: expectation.name) for run in runs]
    for name in _names(judged):
        found = [expectations.get(name) for expectations in judged]
        margins = [None if expectation is None else margin_of(expectation) for expectation in found]
        outcomes = tuple("" if expectation is None else expectation.outcome for expectation in found)
        row = _row("margin", name, margins, runs, partial(_margin_limit, agree, name), outcomes)
        yield row if row.difference is None else replace(row, misfit=_misfit(agree, name, row.unit))
    ran = [run if run.log is not None or run.verdict.simulated_time > 0.0 else None for run in runs]
    durations = [None if run is None else Number(run.verdict.simulated_time, "s") for run in ran]
    yield _row("duration", "", durations, runs, _share(agree.duration))
    steps = [by_name(run.verdict.steps, lambda step: step.id) for run in runs]
    for name in _names(steps):
        took = [_took(of.get(name)) for of in steps]
        yield _row("step_duration", name, took, runs, _share(agree.duration))
    grasps = [by_name(run.grasps, lambda grasp: grasp.name) for run in runs]
    for name in _names(grasps):
        mine = [of.get(name) for of in grasps]
        slips = [_number(None if grasp is None else grasp.slip, "m") for grasp in mine]
        rotations = [_number(None if grasp is None else grasp.rotation, "rad") for grasp in mine]
        yield _row("slip", name, slips, runs, lambda _size, _unit: agree.slip)
        yield _row("rotation", name, rotations, runs, _share(None))
        forces = [_number(None if grasp is None else grasp.force, "N") for grasp in mine]
        yield _row("grasp_force", name, forces, runs, _share(agree.force))
    limit = _share(agree.contact_force)
    for name in _names([run.forces for run in runs]):
        yield _row("contact_force", name, [_number(run.forces.get(name), "N") for run in runs], runs, limit)


Limit = Callable[[float, str], float | None]
"""The allowed difference from the largest |value| and its unit; None: any."""


def _share(share: float | None) -> Limit:
    return lambda size, unit: None if share is None else share_of(share, size, unit)


def _margin_limit(agree: AgreeSpec, name: str, size: float, unit: str) -> float | None:
    """The allowed difference of a margin; None also for an amount in another unit."""
    amount = agree.margins.get(name)
    if amount is None or isinstance(amount, float | int):
        return amount if amount is not None else _share(agree.margin)(size, unit)
    quantity = amount_of(amount)
    if quantity.dimension == NUMBER:
        return share_of(quantity.value, size, unit)
    return None if _misfit(agree, name, unit) else quantity.value


def _misfit(agree: AgreeSpec, name: str, unit: str) -> str:
    """Why the amount for this margin cannot be used; "" if it can. For a condition whose margin can have several units,
    only the run shows which: the others are refused with the task."""
    amount = agree.margins.get(name)
    quantity = amount_of(amount) if isinstance(amount, str) else None
    if quantity is None or quantity.dimension in (NUMBER, parse_unit(unit).dimension if unit else NUMBER):
        return ""
    where = f"in {unit}" if unit else "without a unit"
    return f"agree.margins.{name}: '{amount}' is {quantity.dimension.name}; the margin is {where}"


def _row(
    kind: Kind,
    name: str,
    values: Sequence[Number | None],
    runs: Sequence[MeasuredRun],
    limit: Limit,
    outcomes: tuple[str, ...] = (),
) -> Row:
    mine = [value for value, run in zip(values, runs, strict=True) if value is not None and not run.variant.half_step]
    if len(mine) < 2:
        return Row(kind, name, tuple(values), outcomes)
    numbers, unit = [number.value for number in mine], mine[0].unit
    allowed = limit(max(map(abs, numbers)), unit)
    comparable = all(number.unit == unit for number in mine)
    return Row(kind, name, tuple(values), outcomes, max(numbers) - min(numbers) if comparable else math.inf, allowed)


def margin_of(expectation: ExpectationOutcome) -> Number | None:
    """The margin of an expectation; None if it was not evaluated."""
    return _number(expectation.margin, expectation.unit)


def _number(value: float | None, unit: str) -> Number | None:
    return Number(value, unit) if value is not None and math.isfinite(value) else None


def _took(step: StepOutcome | None) -> Number | None:
    if step is None or step.started is None or step.ended is None:
        return None
    return Number(step.ended - step.started, "s")


def by_name(items: Sequence[T], name: Callable[[T], str]) -> dict[str, T]:
    """The items by their names."""
    return {name(item): item for item in items}


def _names(of: Sequence[Mapping[str, object]]) -> list[str]:
    """All names of the runs, in the order of the first run that has each."""
    return list(dict.fromkeys(name for names in of for name in names))
