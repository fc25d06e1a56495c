"""Combinations of conditions: monitors, checks and scopes of formulas with `all`, `any`, `not`, `believed`, and of one
condition over the bodies of a selection, `all_of`, `any_of`, `at_least`.

all: [{upright: {...}}, {any: [{near: {...}}, {not: {inside: {...}}}]}]
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, Scope, World
from manipcli.conditions.robustness import Robustness, greatest, least, named, nth_greatest, opposite
from manipcli.conditions.selection import each, least_number, selection_problems
from manipcli.conditions.state_window import StateWindow
from manipcli.core.registry import Seam
from manipcli.scene.scene import Scene
from manipcli.spec.condition import SELECTING, ConditionSpec

# Any: the members of a seam have different specs; each is called with its own.
Seams = Seam[Condition[Any]]


def opened(spec: ConditionSpec, world: World, seam: Seams) -> Monitor:
    """The monitor of a condition or combination, from the next state window on."""
    if not spec.combines:
        member = seam[spec.name]
        monitor: Monitor = member.open(spec.body, world)
        return monitor
    if spec.name == "believed":
        return believing(spec.members[0], world, seam)
    if spec.name in SELECTING:
        return over_selection(spec, world, seam)
    members = [_named(member, opened(member, world, seam)) for member in spec.members]

    def look(window: StateWindow) -> Robustness:
        readings = [member(window) for member in members]
        if spec.name == "not":
            return opposite(readings[0])
        return least(readings) if spec.name == "all" else greatest(readings)

    return look


def believing(spec: ConditionSpec, world: World, seam: Seams) -> Monitor:
    """The monitor of a condition on what the robot believes."""
    monitor = opened(spec, world.belief or world, seam)
    named_so = _named(spec, monitor)
    return lambda window: named_so(window.belief or window)


def _named(spec: ConditionSpec, monitor: Monitor) -> Monitor:
    """In a combination the texts of a member begin with the name of its condition."""
    return monitor if spec.combines else lambda window: named(monitor(window), spec.name)


def absent(spec: ConditionSpec, world: World, seam: Seams) -> str | None:
    """Why the first of its conditions that cannot be evaluated in this world cannot; None if all can."""
    for leaf in leaves(spec, world.scene):
        reason: str | None = seam[leaf.name].absent(leaf.body, world)
        if reason is not None:
            return reason
    return None


def problems(spec: ConditionSpec, context: CheckContext, seam: Seams) -> tuple[Problem, ...]:
    """Every unknown name in it; `loc` begins with the name of the condition."""
    found: list[Problem] = []
    if spec.combines:
        if spec.name in SELECTING:
            return selection_problems(spec, context, lambda member: problems(member, context, seam))
        for loc, member in zip(spec.where, spec.members, strict=True):
            found += [Problem((*loc, *p.loc), p.message, p.hint, p.code) for p in problems(member, context, seam)]
        return tuple(found)
    own = seam[spec.name].check(spec.body, context)
    return tuple(Problem((spec.name, *p.loc), p.message, p.hint, p.code) for p in own)


def scopes(spec: ConditionSpec, seam: Seams) -> dict[Scope, str]:
    """The default scopes of its conditions, each with the name of the first condition that has it."""
    found: dict[Scope, str] = {}
    for leaf in leaves(spec):
        found.setdefault(seam[leaf.name].scope, leaf.name)
    return found


def units_of(spec: ConditionSpec, seam: Seams) -> tuple[str, ...]:
    """The SI units that its margin can have, without duplicates."""
    return tuple(dict.fromkeys(unit for leaf in leaves(spec) for unit in seam[leaf.name].units))


def sensors_of(spec: ConditionSpec, seam: Seams) -> tuple[str, ...]:
    """The sensors whose readings it asks for, without duplicates."""
    asked = ((seam[leaf.name].sensor, leaf.body) for leaf in leaves(spec))
    return tuple(dict.fromkeys(sensor(body) for sensor, body in asked if sensor is not None))


def leaves(spec: ConditionSpec, scene: Scene | None = None) -> Iterator[ConditionSpec]:
    """The conditions in it, without combinations; with a `scene`, one for each body of a selection."""
    if not spec.combines:
        yield spec
    for member in spec.members:
        chosen = each(spec, scene) if scene is not None and spec.name in SELECTING else (member,)
        for one in chosen:
            yield from leaves(one, scene)


def over_selection(spec: ConditionSpec, world: World, seam: Seams) -> Monitor:
    """The monitor of a condition over the bodies of a selection: the n-th greatest of their margins."""
    monitors = [_named(member, opened(member, world, seam)) for member in each(spec, world.scene)]
    wanted = least_number(spec, len(monitors))

    def look(window: StateWindow) -> Robustness:
        return nth_greatest([monitor(window) for monitor in monitors], wanted)

    return look
