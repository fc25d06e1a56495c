"""Conditions as they are written, with `all`, `any` and `not` around them, made ready to be asked.

all: [{upright: {...}}, {any: [{near: {...}}, {not: {inside: {...}}}]}]
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from manipcli.conditions.condition import CheckContext, Condition, Gauge, Problem, Scope, World
from manipcli.conditions.robustness import Robustness, greatest, least, named, opposite
from manipcli.conditions.state_window import StateWindow
from manipcli.core.errors import Loc
from manipcli.core.registry import Seam
from manipcli.spec.condition import ConditionSpec

# Any: a seam holds members of different specs; each is only ever called with its own.
Seams = Seam[Condition[Any]]


def opened(spec: ConditionSpec, world: World, seam: Seams) -> Gauge:
    """The gauge of a condition or combination, from the next moments on."""
    if not spec.combines:
        member = seam[spec.name]
        monitor: Gauge = member.open(spec.body, world)
        return monitor
    members = [_told(one, opened(one, world, seam)) for one in spec.members]

    def look(window: StateWindow) -> Robustness:
        readings = [member(window) for member in members]
        if spec.name == "not":
            return opposite(readings[0])
        return least(readings) if spec.name == "all" else greatest(readings)

    return look


def _told(spec: ConditionSpec, monitor: Gauge) -> Gauge:
    """As a member of a combination it says which condition it is."""
    return monitor if spec.combines else lambda window: named(monitor(window), spec.name)


def absent(spec: ConditionSpec, world: World, seam: Seams) -> str | None:
    """Why it cannot be evaluated in this world, of the first of its conditions that cannot; None where all can."""
    for one in leaves(spec):
        reason: str | None = seam[one.name].absent(one.body, world)
        if reason is not None:
            return reason
    return None


def problems(spec: ConditionSpec, context: CheckContext, seam: Seams) -> tuple[Problem, ...]:
    """Everything in it that the setting does not know; `loc` begins with the word."""
    found: list[Problem] = []
    if spec.combines:
        for k, one in enumerate(spec.members):
            loc: Loc = (spec.name,) if spec.name == "not" else (spec.name, k)
            found += [Problem((*loc, *p.loc), p.message, p.hint, p.code) for p in problems(one, context, seam)]
        return tuple(found)
    told = seam[spec.name].check(spec.body, context)
    return tuple(Problem((spec.name, *p.loc), p.message, p.hint, p.code) for p in told)


def scopes(spec: ConditionSpec, seam: Seams) -> dict[Scope, str]:
    """Where its conditions are expected to hold when nobody says where, each with the first word that wants it."""
    found: dict[Scope, str] = {}
    for one in leaves(spec):
        found.setdefault(seam[one.name].scope, one.name)
    return found


def leaves(spec: ConditionSpec) -> Iterator[ConditionSpec]:
    """The conditions that it combines."""
    if not spec.combines:
        yield spec
    for one in spec.members:
        yield from leaves(one)
