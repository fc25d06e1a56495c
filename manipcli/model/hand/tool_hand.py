"""The hand at the tool frame T: its finger tips, the axis along which they open, and how far they are apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.model.configuration import configuration, zero_configuration
from manipcli.model.hand.closure import STEPS, Closure, HandShape
from manipcli.model.hand.gap import closing_axis, gap_between
from manipcli.model.hand.measure import measure_hand
from manipcli.model.hand.parts import hand_at
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel, Tool

ALONG: Final = float(np.cos(np.radians(35.0)))
"""Least cosine between an axis of the tool and the direction that it stands for."""


@dataclass(frozen=True, slots=True)
class FingerTip:
    """A finger tip: the link, and (3,) [m] the tip in this link."""

    link: str
    p_L: Array


@dataclass(frozen=True, slots=True, eq=False)
class ToolHand:
    """A hand as its tool frame T sees it.

    Attributes:
        tool: the tool frame, as the robot states it; measured on the hand where it states none.
        stated: whether the robot states it.
        joints: independent joints of the hand.
        tips: of the fingers, and of a fixed jaw.
        axis: (3,) unit vector in T, the axis along which the hand opens.
        along_y, out_along_z: whether that is y of T, and whether z of T points out of the hand, within 35 deg.
        narrowest, widest: [m] the gap between the fingers, closed and open; below 0 the fingers pass each other.
        measured: the fingers have shapes; without shapes there is no gap.
        opened: (n) joint positions with the hand open by its joint limits, the other joints at zero.
    """

    tool: Tool
    stated: bool
    joints: tuple[str, ...]
    tips: tuple[FingerTip, ...]
    axis: Array
    along_y: bool
    out_along_z: bool
    narrowest: float
    widest: float
    measured: bool
    opened: Array
    _shape: HandShape
    _closure: Closure
    _R_PA: Array
    _kinematics: Kinematics

    def tips_at(self, q: Array) -> Array:
        """(k, 3) [m] the finger tips in T, at joint positions `q` (n)."""
        X_TW = self.pose(q).inverse()
        return np.array([(X_TW @ self._kinematics.forward(q, tip.link)).apply(tip.p_L) for tip in self.tips])

    def gap_at(self, q: Array) -> float:
        """[m] the gap between the fingers along `axis`, at joint positions `q` (n)."""
        fingers = q[self._kinematics.robot.indices(self.joints)]
        return gap_between(self._shape, self._closure, fingers, self._R_PA).width

    def pose(self, q: Array) -> Transform:
        """X_WT at joint positions `q` (n)."""
        return self._kinematics.forward(q, self.tool.link) @ self.tool.X_LT

    def widest_pose(self) -> tuple[str, Array]:
        """The named pose of the hand alone with the widest gap, and its (n) joint positions; else "" and `opened`."""
        gaps = self.gaps_of_poses()
        if not gaps:
            return "", self.opened
        name = max(gaps, key=lambda name: gaps[name])
        return name, configuration(self._kinematics.robot, name, rest=self.opened)

    def gaps_of_poses(self) -> dict[str, float]:
        """[m] the gap in each named pose of the hand alone."""
        robot = self._kinematics.robot
        poses = [pose.name for pose in robot.poses if set(self.joints) == set(pose.joints)]
        return {name: self.gap_at(configuration(robot, name)) for name in poses}


def tool_hand(robot: RobotModel) -> ToolHand | None:
    """The hand that carries the robot's tool frame; None for a tool without fingers.

    The range of the gap is that of the joints between open and closed, as `measure_hand` finds them.
    """
    kinematics = Kinematics(robot)
    points = ShapePoints(kinematics)
    hand = hand_at(robot, points, kinematics, None if robot.tool is None else robot.tool.link)
    if hand is None:
        return None
    shape = HandShape(hand, kinematics, points, zero_configuration(robot))
    closure, frame = measure_hand(shape)
    tool = Tool(frame.link, frame.X_PT) if robot.tool is None else robot.tool
    opened = shape.whole(closure.opened)
    X_PT = kinematics.forward(opened, hand.palm).inverse() @ kinematics.forward(opened, tool.link) @ tool.X_LT
    ends = [*closure.fingers, *([hand.fixed] if hand.fixed else [])]
    out_along_z = bool(X_PT.R[:, 2] @ closure.out >= ALONG)
    along_y = _moves_along(shape, closure, X_PT.R[:, 1])
    R = X_PT.R if out_along_z and along_y else frame.X_PT.R
    shares = np.linspace(0.0, 1.0, STEPS + 1)[:, None]
    ramp = (1.0 - shares) * closure.opened + shares * closure.closed
    gaps = [gap_between(shape, closure, here, R).width for here in ramp]
    links = [link for branch in hand.branches for link in branch]
    return ToolHand(
        tool=tool,
        stated=robot.tool is not None,
        joints=hand.joints,
        tips=tuple(FingerTip(link, frozen(p)) for link, p in map(shape.tip_point, ends)),
        axis=frozen(X_PT.R.T @ R[:, 1]),
        along_y=along_y,
        out_along_z=out_along_z,
        narrowest=min(gaps),
        widest=max(gaps),
        opened=opened,
        measured=len(points.missing(links)) < len(links),
        _shape=shape,
        _closure=closure,
        _R_PA=R,
        _kinematics=kinematics,
    )


def _moves_along(shape: HandShape, closure: Closure, y: Array) -> bool:
    """Whether the tips move along y (3,) in P, as far as along the direction in which they move most."""
    axis = closing_axis(shape, closure)
    axis = axis / max(1e-9, float(np.linalg.norm(axis)))
    steps = [shape.tip(finger, closure.closed) - shape.tip(finger, closure.opened) for finger in closure.fingers]
    most, along = (float(np.linalg.norm(np.array(steps) @ direction)) for direction in (axis, y))
    return along >= ALONG * most
