"""Holder of attached objects: attaches what the hand really touches, and frees what is loaded too much."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.grasp import LINK, friction_coefficient, pressing
from manipcli.model.holding import Holding, surface
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import Engine

MEAN: Final = 0.01
"""[s] An attachment breaks by the mean load over this time: a single impact of the physics does not break it."""


class Holder:
    """The attachment of one object to the tool.

    The load is the wrench of the whole hand on the object, of attachment and contacts: the force with which a cup or
    fingers press on it does not count.

    Args:
        robot, scene: the true world; the robot has a tool.
        holding: of the tool.
        engine: makes the attachments.
        period: [s] of a control tick.

    Attributes:
        attached: the object; "" without one.
        broken: why the last attachment broke; "" if it did not.
    """

    def __init__(self, robot: RobotModel, scene: Scene, holding: Holding, engine: Engine, period: float) -> None:
        assert robot.tool is not None
        self.holding = holding
        self.attached = self.broken = ""
        self._robot, self._scene, self._engine, self._tool = robot, scene, engine, robot.tool
        self._kinematics = Kinematics(robot, gravity=scene.gravity)
        self._loads: deque[Array] = deque(maxlen=max(1, round(MEAN / period)))
        self._wrench = np.zeros(6)
        self._mu = 0.0
        self._links = {LINK + link for link in tool_links(robot)}

    def take(self, name: str, state: WorldState, contacts: Sequence[Contact]) -> str:
        """Attach a movable body. Returns why it is not attached: the tool does not touch it; "" if it is."""
        self.let_go()
        body = self._scene.body(name)
        k = self._scene.movable.index(body)
        X_WO = Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k])
        if self.holding.kind == "suction" or not self._touches(name, contacts):
            missed = self.holding.missed(surface(body, X_WO, self._pose(state)), name)
            if missed:
                return missed
        self.hold(name)
        return ""

    def hold(self, name: str) -> None:
        """Attach a movable body as it is, whether or not the hand touches it."""
        self._mu = friction_coefficient(self._robot, self._scene.body(name))
        self._wrench = self._engine.attach(name)
        self.attached = name

    def let_go(self) -> None:
        """Free the object, if there is one."""
        self.broken = ""
        self._free()

    def look(self, state: WorldState, contacts: Sequence[Contact]) -> None:
        """Compare the load of the last physics step with the limits; at every tick while something is attached."""
        X_WT = self._pose(state)
        self._loads.append(self._wrench + self._pressed(X_WT, contacts))
        if len(self._loads) < (self._loads.maxlen or 0):
            return
        load = self.holding.load(np.mean(self._loads, axis=0), self._mu)
        if load.share > 1.0:
            self.broken = f"the {self.holding.kind} lost '{self.attached}' at {float(state.time):.3f} s: {load.text}"
            self._free()

    def _touches(self, name: str, contacts: Sequence[Contact]) -> bool:
        """Whether the tool presses on a body: the arm does not count, nor do contacts without a direction."""
        own = [contact for contact in contacts if self._links & {contact.a, contact.b}]
        sound = [each for each in own if all(np.isfinite(point.normal).all() for point in each.points)]
        return bool(pressing(sound, name))

    def _free(self) -> None:
        if self.attached:
            self._engine.detach(self.attached)
        self.attached = ""
        self._loads.clear()

    def _pressed(self, X_WT: Transform, contacts: Sequence[Contact]) -> Array:
        """(6) Wrench of the robot's contacts on the object, in the tool frame."""
        force, torque = np.zeros((2, 3))
        for contact in contacts:
            a, b = contact.a, contact.b
            if self.attached not in (a, b) or not (a.startswith(LINK) or b.startswith(LINK)):
                continue
            sign = 1.0 if a == self.attached else -1.0
            for point in contact.points:
                f = sign * (point.force * np.array(point.normal) + np.array(point.friction))
                force += f
                torque += np.cross(np.array(point.position) - X_WT.p, f)
        return np.concatenate((X_WT.R.T @ force, X_WT.R.T @ torque))

    def _pose(self, state: WorldState) -> Transform:
        """X_WT."""
        return self._kinematics.forward(state.position, self._tool.link) @ self._tool.X_LT


def tool_links(robot: RobotModel) -> frozenset[str]:
    """The links with which the tool touches: below its link, or below what carries that if they have no shape."""
    assert robot.tool is not None
    above = {joint.child: joint for joint in robot.joints if not joint.moves}
    link = robot.tool.link
    while link in above and not any(robot.link(each).collisions for each in robot.descendants(link)):
        link = above[link].parent
    return robot.descendants(link)
