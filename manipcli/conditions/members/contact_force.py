"""`contact_force`: the normal force between two parts, or on one part."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, untouchable
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.conditions.touch import between, impossible_pair, is_part, unknown_part
from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.spec.base import Model, problem
from manipcli.spec.names import PartName
from manipcli.spec.quantity import Force, Time


class ContactForceSpec(Model):
    """The sum of the normal forces between a pair, or on one part, is `below` and/or `above` a limit."""

    pair: tuple[PartName, PartName] | None = Field(
        default=None, description="Two parts, each a body, `robot` or `robot/LINK`."
    )
    of: PartName | None = Field(
        default=None, description="Instead of `pair`: one part, a body, `robot` or `robot/LINK`."
    )
    below: Annotated[Force, Field(gt=0)] | None = Field(default=None, description="Largest force [N].")
    above: Annotated[Force, Field(gt=0)] | None = Field(default=None, description="Least force [N].")
    mean_over: Annotated[Time, Field(ge=1e-4, le=60)] | None = Field(
        default=None,
        description="Averaging window up to each tick [s], 0.1 ms to 60 s. Default: no averaging.",
    )

    @model_validator(mode="after")
    def _whole(self) -> ContactForceSpec:
        if (self.pair is None) == (self.of is None):
            raise problem("conflict", "give either `pair: [a, b]` or `of: part`")
        if self.below is None and self.above is None:
            raise problem("conflict", "limit missing: give `below`, `above` or both")
        if self.below is not None and self.above is not None and self.above >= self.below:
            message = f"`above` {readable(self.above, 'N')} is not less than `below` {readable(self.below, 'N')}"
            raise problem(
                "conflict", message, at=("above",), hint="`above` is the least force, `below` the largest: swap them"
            )
        return self


def monitor(spec: ContactForceSpec, world: World) -> Monitor:
    """`below` minus the force, and the force minus `above` [N]; the lesser if both are given.

    Bodies are rigid: an impact is stopped within one physics step, by a force of mass times speed over that step. A
    hand that touches down at a few cm/s presses with 100 N and more for one tick. `mean_over: 50 ms` filters such
    impacts, as a filtered sensor does; until the window is full it is the mean since the first tick.
    """

    def counts(contact: Contact) -> bool:
        if spec.pair is not None:
            return between(spec.pair, contact)
        part = spec.of or ""
        return is_part(part, contact.a) != is_part(part, contact.b)

    def pressed(contacts: Sequence[Contact]) -> float:
        return sum(c.force for c in contacts if counts(c))

    mean = None if spec.mean_over is None else _Mean(spec.mean_over, pressed)
    kind = "force" if spec.mean_over is None else f"mean force over {readable(spec.mean_over, 's')}"
    what = f"on '{spec.of}'" if spec.pair is None else f"between '{spec.pair[0]}' and '{spec.pair[1]}'"

    def look(window: StateWindow) -> Robustness:
        force = window.of_contacts(pressed) if mean is None else mean.of(window)

        def describe(k: int) -> str:
            limits = [("below", spec.below), ("above", spec.above)]
            bounds = " and ".join(f"{word} {readable(value, 'N')}" for word, value in limits if value is not None)
            return f"the {kind} {what} is {readable(float(force[k]), 'N')}; {bounds}"

        readings = []
        if spec.below is not None:
            readings.append(robustness(spec.below - force, window.times, unit="N", scale=spec.below, describe=describe))
        if spec.above is not None:
            readings.append(robustness(force - spec.above, window.times, unit="N", scale=spec.above, describe=describe))
        return least(readings)

    return look


class _Mean:
    """The mean of a piecewise constant force over the last `window` [s]; at the first tick its value there.

    The mean is over time, not over ticks, so it is the same for a log with fewer ticks:
    (F(t) - F(t - window)) / window, with F the integral of the force.
    """

    def __init__(self, window: float, force: Callable[[Sequence[Contact]], float]) -> None:
        self._window, self._force = window, force
        self._begin = 0.0
        self._times: list[float] = []
        self._values: list[float] = []
        self._sums: list[float] = []

    def of(self, window: StateWindow) -> Array:
        """(T,) the mean at each of the next ticks."""
        ticks = window.times
        if not self._times:
            self._begin = float(ticks[0])
            self._append(self._begin, self._force(window.touching(0)), 0.0)
        for change in window.contacts:
            held = change.time - self._times[-1]
            if held > 0.0:
                self._append(change.time, self._force(change.contacts), self._sums[-1] + self._values[-1] * held)
        times, values, sums = np.array([self._times, self._values, self._sums])

        def total(at: Array) -> Array:
            k = np.searchsorted(times, at, side="right") - 1
            found: Array = sums[k] + values[k] * (at - times[k])
            return found

        since = np.maximum(ticks - self._window, self._begin)
        mean = np.full(len(ticks), values[0])
        np.divide(total(ticks) - total(since), ticks - since, out=mean, where=ticks > since)
        old = int(np.searchsorted(times, since[-1], side="right")) - 1
        del self._times[:old], self._values[:old], self._sums[:old]
        return mean

    def _append(self, time: float, value: float, before: float) -> None:
        self._times.append(time)
        self._values.append(value)
        self._sums.append(before)


def check(spec: ContactForceSpec, context: CheckContext) -> tuple[Problem, ...]:
    """Unknown parts, or a pair without contacts in the simulation."""
    if spec.pair is not None:
        return impossible_pair(context, spec.pair, ("pair",))
    return unknown_part(context, spec.of or "", ("of",))


def clause(spec: ContactForceSpec, robot: RobotModel) -> str:
    between = f"on {named(spec.of)}" if spec.of is not None else ""
    if spec.pair is not None:
        between = f"between {named(spec.pair[0])} and {named(spec.pair[1])}"
    limits = [
        f"{word} {amount(limit, 'N')}"
        for word, limit in (("above", spec.above), ("below", spec.below))
        if limit is not None
    ]
    mean = "" if spec.mean_over is None else f", averaged over {amount(spec.mean_over, 's')}"
    return f"the contact force {between} is {' and '.join(limits)}{mean}"


CONTACT_FORCE = Condition(
    name="contact_force",
    spec=ContactForceSpec,
    units=("N",),
    open=monitor,
    check=check,
    absent=lambda spec, world: untouchable(world),
    scope="always",
    clause=clause,
    example="contact_force: {pair: [robot, cup], below: 20 N}",
    stateless=True,
)
