"""`contact_force`: how hard parts press on each other."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from manipcli.core.units import readable
from manipcli.model.condition import Condition, Gauge, Problem, Setting, World, untouchable
from manipcli.model.moments import Moments
from manipcli.model.reading import Reading, least, reading
from manipcli.model.state import Contact
from manipcli.model.touch import between, impossible_pair, is_part, unknown_part
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Force


class ContactForceSpec(Model):
    """The sum of the normal forces between a pair, or of all on one part, is `below`, `above`, or between the two."""

    pair: tuple[str, str] | None = Field(default=None, description="Two of: a body, `robot`, `robot/LINK`.")
    of: str | None = Field(default=None, description="Instead of `pair`: a body, `robot` or `robot/LINK`.")
    below: Annotated[Force, Field(gt=0)] | None = Field(default=None, description="Largest force [N].")
    above: Annotated[Force, Field(gt=0)] | None = Field(default=None, description="Least force [N].")

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


def gauge(spec: ContactForceSpec, world: World) -> Gauge:
    """`below` minus the force, and the force minus `above` [N]; the lesser where both are given.

    Bodies are rigid: where they meet, a force of one physics step brings them to rest, mass times speed over that step.
    It grows with the speed: a hand that comes down on something with a few cm/s presses for a tick with 100 N and more.
    """

    def counts(contact: Contact) -> bool:
        if spec.pair is not None:
            return between(spec.pair, contact)
        part = spec.of or ""
        return is_part(part, contact.a) != is_part(part, contact.b)

    what = f"on '{spec.of}'" if spec.pair is None else f"between '{spec.pair[0]}' and '{spec.pair[1]}'"

    def look(moments: Moments) -> Reading:
        force = moments.of_contacts(lambda contacts: sum(c.force for c in contacts if counts(c)))

        def say(k: int) -> str:
            limits = [("below", spec.below), ("above", spec.above)]
            asked = " and ".join(f"{word} {readable(value, 'N')}" for word, value in limits if value is not None)
            return f"the force {what} is {readable(float(force[k]), 'N')}; {asked}"

        readings = []
        if spec.below is not None:
            readings.append(reading(spec.below - force, moments.times, unit="N", scale=spec.below, say=say))
        if spec.above is not None:
            readings.append(reading(force - spec.above, moments.times, unit="N", scale=spec.above, say=say))
        return least(readings)

    return look


def check(spec: ContactForceSpec, setting: Setting) -> tuple[Problem, ...]:
    """The parts exist, and those of a pair can touch each other."""
    if spec.pair is not None:
        return impossible_pair(setting, spec.pair, ("pair",))
    return unknown_part(setting, spec.of or "", ("of",))


CONTACT_FORCE = Condition(
    name="contact_force",
    spec=ContactForceSpec,
    units=("N",),
    open=gauge,
    check=check,
    absent=lambda spec, world: untouchable(world),
    scope="always",
    example="contact_force: {pair: [robot, cup], below: 20 N}",
)
