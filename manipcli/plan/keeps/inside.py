"""`inside`: the held object, or the tool, in a box that is fixed in a frame."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.prose import named, point
from manipcli.core.units import readable
from manipcli.plan.held_frame import held_points, points_of
from manipcli.plan.keep import RESERVE, KeepMember, Kept
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.spec.keep import KeepSpec


def opened(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    """By the corners of the held object's bounding box."""
    if spec.inside is None:
        return None
    frame = spec.inside.frame
    X_FW = None if frame is None else planner.frame(frame, state).inverse()
    centre, half = np.array(spec.inside.box.centre), 0.5 * np.array(spec.inside.box.size)
    name = held_points(planner, state)[0]

    def room(q: Array) -> Array:
        """(k, 3) the least distance to the sides along each axis [m]."""
        p = points_of(planner, state, q)
        p = p if X_FW is None else X_FW.apply(p.reshape(-1, 3)).reshape(p.shape)
        return np.asarray((half - np.abs(p - centre)).min(axis=1))

    def text(q: Array) -> str:
        left = room(q[None])[0]
        axis = int(np.argmin(left))
        return f"{name} leaves `inside: {{box: ...}}` by {readable(float(-left[axis]), 'm')} along {'xyz'[axis]}"

    return Kept("inside", lambda q: room(q).min(axis=1), text, reserve=RESERVE)


def clause(spec: KeepSpec) -> str:
    assert spec.inside is not None
    box, frame = spec.inside.box, spec.inside.frame
    where = "" if frame is None else f" in the frame of {named(frame)}"
    return f"the held object (else the tool) is in a box of {point(box.size)} around {point(box.centre)}{where}"


MEMBER = KeepMember("inside", opened, clause)
