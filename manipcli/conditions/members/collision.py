"""`collision`, `no_collision`: things press on each other, or do not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.conditions.condition import CheckContext, Condition, Gauge, Problem, World, untouchable
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.conditions.touch import between, impossible_pair
from manipcli.core.units import readable
from manipcli.model.state import Contact
from manipcli.spec.base import Model, or_short, problem
from manipcli.spec.quantity import Force

Pair = tuple[str, str]


class PairsSpec(Model):
    """Which parts, two by two; one pair may stand alone."""

    pairs: tuple[Pair, ...] = Field(
        min_length=1, description="Each two of: a body, `robot` (any of its links), `robot/LINK`."
    )

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, value: object) -> object:
        if not isinstance(value, list | tuple):
            return value
        if len(value) != 2 or not all(isinstance(part, str) for part in value):
            hint = "write `[robot, desk]`, or several as `{pairs: [[robot, desk], [cup, desk]]}`"
            raise problem("count", "expected two names: those of the parts that touch", hint=hint)
        return {"pairs": [value]}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        names = {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}
        return or_short(schema, handler, names)


class NoCollisionSpec(PairsSpec):
    """None of the pairs presses on each other with more than `below`. Short: `no_collision: [robot, desk]`."""

    below: Annotated[Force, Field(ge=0)] = Field(
        default=0.0, description="Largest normal force [N] that does not count. Default 0: any touch counts."
    )


class CollisionSpec(PairsSpec):
    """One of the pairs presses on each other with at least `above`. Short: `collision: [robot, desk]`."""

    above: Annotated[Force, Field(gt=0)] = Field(default=0.01, description="Least normal force [N]. Default 10 mN.")


def gauge_none(spec: NoCollisionSpec, world: World) -> Gauge:
    """`below` minus the largest normal force [N] between any of the pairs.

    A pair that does not press has the margin `below`: 0 N to spare when any touch counts, which still passes; where
    units differ, it is then compared to 1 N.
    """
    return _monitor(spec.pairs, spec.below, -1.0)


def gauge_some(spec: CollisionSpec, world: World) -> Gauge:
    """The largest normal force between any of the pairs, minus `above` [N]."""
    return _monitor(spec.pairs, spec.above, 1.0)


def _monitor(pairs: tuple[Pair, ...], limit: float, sign: float) -> Gauge:
    def hardest(contacts: Sequence[Contact]) -> Contact | None:
        hits = [contact for contact in contacts if any(between(pair, contact) for pair in pairs)]
        return max(hits, key=lambda contact: contact.force, default=None)

    def largest(contacts: Sequence[Contact]) -> float:
        hit = hardest(contacts)
        return 0.0 if hit is None else hit.force

    def look(window: StateWindow) -> Robustness:
        force = window.of_contacts(largest)

        def say(k: int) -> str:
            hit = hardest(window.touching(k))
            if hit is None or not hit.force:
                return "never touched" if sign < 0.0 else "nothing touches"
            asked = f"; {'at most' if sign < 0.0 else 'at least'} {readable(limit, 'N')}" if limit else ""
            return f"'{hit.a}' and '{hit.b}' press with {readable(hit.force, 'N')}{asked}"

        def at(k: int) -> float | None:
            return float(window.times[k]) if force[k] else None

        return robustness(sign * (force - limit), window.times, unit="N", scale=limit or 1.0, say=say, at=at)

    return look


def check(spec: NoCollisionSpec | CollisionSpec, context: CheckContext) -> tuple[Problem, ...]:
    """Every part is a body, the robot, or one of its links, and can touch the other of its pair."""
    return tuple(found for k, pair in enumerate(spec.pairs) for found in impossible_pair(context, pair, ("pairs", k)))


NO_COLLISION = Condition(
    name="no_collision",
    spec=NoCollisionSpec,
    units=("N",),
    open=gauge_none,
    check=check,
    absent=lambda spec, world: untouchable(world),
    scope="always",
    example="no_collision: {pairs: [[robot, desk], [robot, tray]]}",
    stateless=True,
)
COLLISION = Condition(
    name="collision",
    spec=CollisionSpec,
    units=("N",),
    open=gauge_some,
    check=check,
    absent=lambda spec, world: untouchable(world),
    example="collision: [robot, desk]",
    stateless=True,
)
