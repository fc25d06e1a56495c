"""Pairs of parts as task files name them (`allow:`, `clearance:`), and as collision queries do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from manipcli.conditions.condition import CheckContext, Problem
from manipcli.conditions.touch import is_part, unknown_part
from manipcli.core.errors import Loc
from manipcli.model.collision import Pair
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene


def expanded_pairs(robot: RobotModel, scene: Scene, written: Iterable[Pair]) -> frozenset[Pair]:
    """The pairs of single parts; `robot` stands for each of its links."""
    parts = [*(f"robot/{link.name}" for link in robot.links), *(body.name for body in scene.bodies)]
    return frozenset(
        (a, b)
        for first, second in written
        for a in parts
        if is_part(first, a)
        for b in parts
        if is_part(second, b) and a != b
    )


def pair_problems(context: CheckContext, pair: Pair, loc: Loc) -> Iterator[Problem]:
    """Problems of a pair: unknown parts, or a part and itself."""
    unknown = [p for k, name in enumerate(pair) for p in unknown_part(context, name, (*loc, k))]
    yield from unknown
    if not unknown and pair[0] == pair[1] != "robot":
        yield Problem(loc, f"'{pair[0]}' is in the pair twice")
