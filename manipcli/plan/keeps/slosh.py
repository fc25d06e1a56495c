"""`slosh`: the apparent gravity at the contents within a cone about the held container's axis."""

from __future__ import annotations

import math

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.prose import amount
from manipcli.plan.held_frame import tilts
from manipcli.plan.keep import POURING, KeepMember, Kept
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.timing_bounds.slosh import SloshBound
from manipcli.spec.keep import KeepSpec


def opened(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    """At the mean of the contents' centres of mass; in an empty container, or another body, at its centre.

    At rest the axis must be within the angle of the vertical, too.
    """
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

    def text(q: Array) -> str:
        tilt = math.degrees(float(tilts(planner, carried, q[None])[0]))
        return f"'{carried.body}' tilts by {tilt:.1f} deg, beyond `slosh: {math.degrees(angle):g} deg`"

    return Kept(
        "slosh",
        lambda q: angle - tilts(planner, carried, q),
        text,
        lambda dynamics: SloshBound(dynamics, link, X_LC, gravity, angle),
        POURING,
    )


def clause(spec: KeepSpec) -> str:
    return f"gravity and acceleration together act within {amount(spec.slosh or 0.0, 'rad')} of the held object's axis"


MEMBER = KeepMember("slosh", opened, clause)
