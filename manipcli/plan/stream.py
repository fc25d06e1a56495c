"""Where what is poured is predicted to land, by the flight of each body from the rim of a planned tilt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.model.configuration import with_joints
from manipcli.plan.flight import (
    PLACE_ERROR,
    SPEED_ERROR,
    SPHERE,
    Contents,
    Leaving,
    Tilting,
    fall,
    hollow_along,
    leaving,
    room,
)
from manipcli.plan.motion import PlanningState, StepPlan, Stream
from manipcli.plan.planner import Planner
from manipcli.scene.scene import Body

_SAMPLES: Final = 250  # of the tilt; between them it is linear


@dataclass(frozen=True, slots=True)
class Pouring:
    """What is poured from where into what.

    Attributes:
        cup, receiver: containers.
        X_TO: of the cup in the tool.
        X_WR: of the receiver.
        heights: [m] of the centres of the contents above the floor of the upright cup, by body.
        gravity: [m/s2] downwards.
    """

    cup: Body
    receiver: Body
    X_TO: Transform
    X_WR: Transform
    heights: Sequence[tuple[Body, float]]
    gravity: float

    @classmethod
    def of(cls, planner: Planner, state: PlanningState, cup: str, into: str) -> Pouring | None:
        """None where nothing is known to be in the cup, or one of the two has no known hollow."""
        body, receiver = planner.scene.body(cup), planner.scene.body(into)
        names, (gx, gy, gz) = planner.contents(state, cup), planner.scene.gravity
        if not names or body.interior is None or receiver.interior is None or gz >= 0.0 or math.hypot(gx, gy) > 1e-9:
            return None
        X_SW = (planner.body_pose(state, cup) @ body.interior.X_OS).inverse()
        floor, heights = body.interior.floor, []
        for name in names:
            content = planner.scene.body(name)
            centre = X_SW.apply(planner.body_pose(state, name).apply(content.centre))
            heights.append((content, float(centre[2]) - floor))
        X_WR = planner.body_pose(state, into)
        return cls(body, receiver, planner.held_in_tool(state), X_WR, tuple(heights), -float(gz))

    def leavings(self, R_WT0: Array, w: Array, tilting: Tilting) -> tuple[Leaving, ...]:
        """How each of the contents leaves the rim; T is the tool, at R_WT0 while the cup is upright."""
        assert self.cup.interior is not None  # see `of`
        hollow = self.cup.interior
        R_WO = R_WT0 @ self.X_TO.R
        depth = hollow.rim - hollow.floor
        centre = R_WT0 @ self.X_TO.p + R_WO @ hollow.X_OS.p
        axis, rim = float(centre @ w), float(centre[2]) + hollow.rim
        wall = axis + hollow_along(hollow, R_WO, w)
        found = []
        for body, height in self.heights:
            radius = float(min(body.size)) / 2.0
            start = min(max(height, radius), depth) + rim - depth
            inertia = SPHERE if body.kind == "sphere" else 0.0
            friction = body.friction * self.cup.friction
            found.append(leaving(Contents(wall - radius, start, rim, radius, inertia, friction), tilting, self.gravity))
        return tuple(each for each in found if each is not None)

    def landing(self, p_WT: Array, R_WT0: Array, w: Array, tilting: Tilting) -> Stream | None:
        """Where the contents pass the plane of the receiver's rim; None if they stay in the cup."""
        assert self.receiver.interior is not None  # see `of`
        hollow = self.receiver.interior
        X_WS = self.X_WR @ hollow.X_OS
        top = float(X_WS.apply([0.0, 0.0, hollow.rim])[2])
        out = self.leavings(R_WT0, w, tilting)
        if not out:
            return None
        ways, ends = [], []
        for each in out:
            height = float(p_WT[2] + each.position[1]) - top
            ways.append(fall(height, each.velocity, self.gravity)[1])
            ends.append(p_WT + (float(each.position[0]) + ways[-1]) * w)
        spread = PLACE_ERROR + SPEED_ERROR * max(map(abs, ways))
        widest = max(width(body) / 2.0 for body, _ in self.heights)
        margin = float(min(room(hollow, X_WS.inverse().apply(end)) for end in ends)) - widest - spread
        beyond = [float((end - X_WS.p) @ w) for end in ends]
        fastest = max(each.speed for each in out)
        return Stream((max(beyond) + min(beyond)) / 2.0, spread, margin, fastest, max(each.tilt for each in out))


def width(body: Body) -> float:
    """[m] Of the least opening that a body passes end first: the middle one of its lengths."""
    return float(np.sort(body.size)[1])


def tilting(planner: Planner, state: PlanningState, plan: StepPlan, axis: Array) -> Tilting:
    """The tilt of the tool from `state` about a horizontal `axis` (3,) of the world, in the last motion of a plan."""
    trajectory = plan.motions[-1].trajectory
    assert trajectory is not None  # a rotation in place
    index = np.unique(np.linspace(0, len(trajectory.times) - 1, _SAMPLES).astype(int))
    path = with_joints(planner.robot, state.position, trajectory.names, trajectory.positions[index])
    R = [planner.solver.forward(q).R for q in path]
    quarter = matrix_from_axis_angle(axis, math.pi / 2.0)
    level = np.array([-axis[1], axis[0], 0.0])  # at right angles to the axis
    turned = [each @ R[0].T @ level for each in R]
    angles = np.unwrap([math.atan2(float(v @ (quarter @ level)), float(v @ level)) for v in turned])
    return Tilting(np.asarray(trajectory.times[index] - trajectory.times[0]), np.asarray(angles))
