"""`above`: the held object, or the tool, higher than the top of a body."""

from __future__ import annotations

from itertools import product

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.plan.held_frame import held_points, points_of
from manipcli.plan.keep import NEAR, RESERVE, KeepMember, Kept
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.scene.scene import Body
from manipcli.spec.keep import KeepSpec


def opened(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    """By the highest corner of the body's bounding box, and the lowest corner of the held object's."""
    if spec.above is None:
        return None
    other, by = spec.above, spec.by or 0.0
    level = by + _top(planner.scene.body(other), planner, state)
    name = held_points(planner, state)[0]

    def margin(q: Array) -> Array:
        return np.asarray(points_of(planner, state, q)[..., 2].min(axis=1) - level)

    def text(q: Array) -> str:
        height = float(margin(q[None])[0]) + by
        where = f"{readable(height, 'm')} above" if height >= 0.0 else f"{readable(-height, 'm')} below"
        return f"{name} is {where} the top of '{other}', beyond `above: {other}, by: {readable(by, 'm')}`"

    return Kept("above", margin, text, exempt=NEAR, reserve=RESERVE)


def _top(body: Body, planner: Planner, state: PlanningState) -> float:
    corners = [body.centre + np.array(signs) * body.size for signs in product((-0.5, 0.5), repeat=3)]
    return float(max(planner.body_pose(state, body.name).apply(corner)[2] for corner in corners))


def clause(spec: KeepSpec) -> str:
    return f"the held object (else the tool) is at least {amount(spec.by or 0.0, 'm')} above {named(str(spec.above))}"


MEMBER = KeepMember("above", opened, clause)
