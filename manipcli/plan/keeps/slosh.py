"""`slosh`: the apparent gravity at the contents within a cone about the held container's axis."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.plan.keep import POURING, KeepMember, Kept
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.timing_bounds.slosh import SloshBound
from manipcli.spec.keep import KeepSpec


def opened(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    """At the mean of the contents' centres of mass; in an empty container, or a body without interior, at its centre."""
    angle, carried = spec.slosh, state.carried
    if angle is None or carried is None or not np.linalg.norm(planner.scene.gravity) > 0.0:
        return None
    X_OW = planner.body_pose(state, carried.body).inverse()
    inside = [
        (X_OW @ planner.body_pose(state, name)).apply(planner.scene.body(name).X_OI.p)
        for name in planner.contents(state, carried.body)
    ]
    centre = np.mean(inside, axis=0) if inside else planner.scene.body(carried.body).centre
    X_LC = carried.X_LO @ Transform.of(xyz=centre)
    gravity, link = planner.scene.gravity, carried.link
    return Kept("slosh", bound=lambda dynamics: SloshBound(dynamics, link, X_LC, gravity, angle), exempt=POURING)


MEMBER = KeepMember("slosh", opened)
