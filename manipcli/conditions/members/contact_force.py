"""`contact_force`: how hard parts press on each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import CheckContext, Condition, Gauge, Problem, World, untouchable
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.conditions.touch import between, impossible_pair, is_part, unknown_part
from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.model.state import Contact
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Force, Time


class ContactForceSpec(Model):
    """The sum of the normal forces between a pair, or of all on one part, is `below`, `above`, or between the two."""

    pair: tuple[str, str] | None = Field(default=None, description="Two of: a body, `robot`, `robot/LINK`.")
    of: str | None = Field(default=None, description="Instead of `pair`: a body, `robot` or `robot/LINK`.")
    below: Annotated[Force, Field(gt=0)] | None = Field(default=None, description="Largest force [N].")
    above: Annotated[Force, Field(gt=0)] | None = Field(default=None, description="Least force [N].")
    mean_over: Annotated[Time, Field(ge=1e-4, le=60)] | None = Field(
        default=None,
        description="The force is averaged over this time up to each tick [s], 0.1 ms to 60 s. Default: it is not.",
    )

    @model_validator(mode="after")
    def _whole(self) -> ContactForceSpec:
        if (self.pair is None) == (self.of is None):
            raise problem("conflict", "say either `pair: [a, b]` or `of: part`")
        if self.below is None and self.above is None:
            raise problem("conflict", "say how hard: `below`, `above`, or both")
        if self.below is not None and self.above is not None and self.above >= self.below:
            asked = f"no force is below {readable(self.below, 'N')} and above {readable(self.above, 'N')}"
            raise problem(
                "conflict", asked, at=("above",), hint="write the least force under `above`, the largest under `below`"
            )
        return self


def monitor(spec: ContactForceSpec, world: World) -> Gauge:
    """`below` minus the force, and the force minus `above` [N]; the lesser where both are given.

    Bodies are rigid: where they meet, a force of one physics step brings them to rest, mass times speed over that step.
    It grows with the speed: a hand that comes down on something with a few cm/s presses for a tick with 100 N and more.
    `mean_over: 50 ms` looks past such knocks, as a filtered sensor does; at first it is the mean of what was seen.
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

    def look(moments: StateWindow) -> Robustness:
        force = moments.of_contacts(pressed) if mean is None else mean.of(moments)

        def say(k: int) -> str:
            limits = [("below", spec.below), ("above", spec.above)]
            asked = " and ".join(f"{word} {readable(value, 'N')}" for word, value in limits if value is not None)
            return f"the {kind} {what} is {readable(float(force[k]), 'N')}; {asked}"

        readings = []
        if spec.below is not None:
            readings.append(robustness(spec.below - force, moments.times, unit="N", scale=spec.below, say=say))
        if spec.above is not None:
            readings.append(robustness(force - spec.above, moments.times, unit="N", scale=spec.above, say=say))
        return least(readings)

    return look


class _Mean:
    """The mean over the last `window` [s] of a force, each value of which holds until the next; at the first tick the
    value. It is that of the force and not of the ticks: of a log that holds fewer of them it is the same.

    F(t) = sum of value * how long it held, up to t; the mean is (F(t) - F(t - window)) / window.
    """

    def __init__(self, window: float, force: Callable[[Sequence[Contact]], float]) -> None:
        self._window, self._force = window, force
        self._begin = 0.0
        self._times: list[float] = []
        self._values: list[float] = []
        self._sums: list[float] = []

    def of(self, moments: StateWindow) -> Array:
        """(T,) at each of the next ticks."""
        ticks = moments.times
        if not self._times:
            self._begin = float(ticks[0])
            self._append(self._begin, self._force(moments.touching(0)), 0.0)
        for one in moments.contacts:
            held = one.time - self._times[-1]
            if held > 0.0:
                self._append(one.time, self._force(one.contacts), self._sums[-1] + self._values[-1] * held)
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
    """The parts exist, and those of a pair can touch each other."""
    if spec.pair is not None:
        return impossible_pair(context, spec.pair, ("pair",))
    return unknown_part(context, spec.of or "", ("of",))


CONTACT_FORCE = Condition(
    name="contact_force",
    spec=ContactForceSpec,
    units=("N",),
    open=monitor,
    check=check,
    absent=lambda spec, world: untouchable(world),
    scope="always",
    example="contact_force: {pair: [robot, cup], below: 20 N}",
    stateless=True,
)
