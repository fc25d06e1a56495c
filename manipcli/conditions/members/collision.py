"""`collision`, `no_collision`: parts are in contact, or are not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, untouchable
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.conditions.touch import between, impossible_pair
from manipcli.core.prose import amount, listing, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.spec.base import Model, or_short, problem
from manipcli.spec.names import MARK, PartName
from manipcli.spec.quantity import Force

Pair = tuple[PartName, PartName]


class PairsSpec(Model):
    """Pairs of parts; a single pair needs no list."""

    pairs: tuple[Pair, ...] = Field(
        min_length=1,
        description="Pairs of parts, each a body, `robot` (any of its links) or `robot/LINK`; `[robot, robot]`: two of "
        "its links.",
    )

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, value: object) -> object:
        if not isinstance(value, list | tuple):
            return value
        if len(value) != 2 or not all(isinstance(part, str) for part in value):
            hint = "write `[robot, desk]` for one pair, `{pairs: [[robot, desk], [cup, desk]]}` for several"
            raise problem("count", "expected two names, one for each part", hint=hint)
        return {"pairs": [value]}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        names = {"type": "array", "items": {"type": "string", MARK: "part"}, "minItems": 2, "maxItems": 2}
        return or_short(schema, handler, names)


class NoCollisionSpec(PairsSpec):
    """The contact force of each pair is at most `below`. Short form: `no_collision: [robot, desk]`."""

    below: Annotated[Force, Field(ge=0)] = Field(
        default=0.0, description="Largest allowed normal force [N]. Default 0: no contact at all."
    )


class CollisionSpec(PairsSpec):
    """The contact force of at least one pair is `above` or more. Short form: `collision: [robot, desk]`."""

    above: Annotated[Force, Field(gt=0)] = Field(default=0.01, description="Least normal force [N]. Default 10 mN.")


def monitor_no_collision(spec: NoCollisionSpec, world: World) -> Monitor:
    """`below` minus the largest normal force [N] of all pairs.

    Without contact the margin is `below`: 0 N by default, which passes. Where units differ, the margin is divided by
    `below`, or by 1 N if that is 0.
    """
    return _monitor(spec.pairs, spec.below, -1.0)


def monitor_collision(spec: CollisionSpec, world: World) -> Monitor:
    """The largest normal force of all pairs, minus `above` [N]."""
    return _monitor(spec.pairs, spec.above, 1.0)


def _monitor(pairs: tuple[Pair, ...], limit: float, sign: float) -> Monitor:
    def hardest(contacts: Sequence[Contact]) -> Contact | None:
        hits = [contact for contact in contacts if any(between(pair, contact) for pair in pairs)]
        return max(hits, key=lambda contact: contact.force, default=None)

    def largest(contacts: Sequence[Contact]) -> float:
        hit = hardest(contacts)
        return 0.0 if hit is None else hit.force

    def look(window: StateWindow) -> Robustness:
        force = window.of_contacts(largest)

        def describe(k: int) -> str:
            hit = hardest(window.touching(k))
            if hit is None or not hit.force:
                return "no contact"
            bound = f"; {'at most' if sign < 0.0 else 'at least'} {readable(limit, 'N')}" if limit else ""
            return f"'{hit.a}' and '{hit.b}' touch with {readable(hit.force, 'N')}{bound}"

        def at(k: int) -> float | None:
            return float(window.times[k]) if force[k] else None

        return robustness(sign * (force - limit), window.times, unit="N", scale=limit or 1.0, describe=describe, at=at)

    return look


def check(spec: NoCollisionSpec | CollisionSpec, context: CheckContext) -> tuple[Problem, ...]:
    """Unknown parts, and pairs without contacts in the simulation."""
    return tuple(found for k, pair in enumerate(spec.pairs) for found in impossible_pair(context, pair, ("pairs", k)))


def _pairs(spec: PairsSpec, touches: str) -> str:
    """`the robot touches 'desk' or 'tray', or 'cup' touches 'desk'`: pairs grouped by their first part."""
    others: dict[str, list[str]] = {}
    for a, b in spec.pairs:
        others.setdefault(named(a), []).append("itself" if a == b else named(b))
    return "; or ".join(f"{a} {touches} {listing(b, 'or')}" for a, b in others.items())


def no_collision_clause(spec: NoCollisionSpec, robot: RobotModel) -> str:
    pairs = _pairs(spec, "does not touch").replace("; or ", "; ")
    return f"{pairs}, with more than {amount(spec.below, 'N')}" if spec.below else pairs


def collision_clause(spec: CollisionSpec, robot: RobotModel) -> str:
    return f"{_pairs(spec, 'touches')} with {amount(spec.above, 'N')} or more"


NO_COLLISION = Condition(
    name="no_collision",
    spec=NoCollisionSpec,
    units=("N",),
    open=monitor_no_collision,
    check=check,
    absent=lambda spec, world: untouchable(world),
    scope="always",
    clause=no_collision_clause,
    example="no_collision: {pairs: [[robot, desk], [robot, tray]]}",
    stateless=True,
)
COLLISION = Condition(
    name="collision",
    spec=CollisionSpec,
    units=("N",),
    open=monitor_collision,
    check=check,
    absent=lambda spec, world: untouchable(world),
    clause=collision_clause,
    example="collision: [robot, desk]",
    stateless=True,
)
