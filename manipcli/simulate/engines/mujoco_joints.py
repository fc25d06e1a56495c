"""Joints of a scene in MuJoCo: hinges and slides with a range, damping, dry friction and a spring."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import ModuleType
from typing import Any, Final

from manipcli.core.geometry import Array, Transform
from manipcli.model.state import WorldState
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import Body, Scene
from manipcli.simulate.engines.link_states import (
    LinkStates,
    joint_state,
    link_state,
    start_positions,
    start_velocities,
)
from manipcli.simulate.engines.mujoco_bodies import BodyStates
from manipcli.simulate.engines.mujoco_shapes import wxyz

HARD: Final = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""Impedance of motors, mimic joints, limits and dry friction: the largest that MuJoCo supports."""
STOP: Final = (0.004, 1.0)
"""[s], damping ratio of an end stop."""


def in_trees(scene: Scene) -> list[tuple[int, Body]]:
    """The bodies with their numbers, those of things with joints first: free joints of all others are the last ones."""
    joined = {name for joint in scene.joints for name in (joint.parent, joint.child)}
    return sorted(enumerate(scene.bodies), key=lambda each: each[1].name not in joined)


def place_in_parent(joint: SceneJoint, parent: Body, child: Body) -> dict[str, Any]:
    """Pose of a moved body at position 0 in its parent; frames of bodies are at their centres of mass."""
    X = Transform.of(xyz=-parent.X_OI.p) @ joint.X_PJ @ Transform.of(xyz=child.X_OI.p)
    return {"pos": X.p, "quat": wxyz(X.quat_xyzw)}


def add_joint(mujoco: ModuleType, made: Any, joint: SceneJoint, child: Body, number: int) -> None:
    """Add a joint to the `MjsBody` of the body that it moves."""
    limited = math.isfinite(joint.lower) or math.isfinite(joint.upper)
    added = made.add_joint(
        name=name_of(number),
        type=mujoco.mjtJoint.mjJNT_SLIDE if joint.slides else mujoco.mjtJoint.mjJNT_HINGE,
        pos=-child.X_OI.p,
        axis=joint.axis,
        limited=limited,
        range=[max(joint.lower, -1e9), min(joint.upper, 1e9)],
        solimp_limit=HARD,
        solref_limit=STOP,
        frictionloss=joint.friction,
        solimp_friction=HARD,
        springref=joint.rest,
    )
    added.damping[0] = joint.damping  # the others are of a polynomial
    added.stiffness[0] = joint.stiffness


def name_of(number: int) -> str:
    """The name in `MjSpec` of the joint with this number in the scene."""
    return f"passive{number}"


class MovedStates:
    """All movable bodies of a scene with joints: groups with free joints, then those that joints move.

    Args:
        data: `MjData`.
        scene: with joints.
        state: receives what is read.
        at: number of the position and of the velocity of each joint in `data`.
        free: the bodies with free joints.
    """

    def __init__(
        self, data: Any, scene: Scene, state: WorldState, at: Sequence[tuple[int, int]], free: Sequence[BodyStates]
    ) -> None:
        self._data, self._scene, self._free = data, scene, free
        self._qpos, self._qvel = [q for q, _ in at], [v for _, v in at]
        self._links = LinkStates(scene, state)
        self._children = {joint.child for joint in scene.joints}
        data.qpos[self._qpos] = start_positions(scene)

    def read(self, *, velocities: bool) -> None:
        """See `BodyStates.read`."""
        data = self._data
        for group in self._free:
            group.read(velocities=velocities)
        self._links.fill(data.qpos[self._qpos].tolist(), data.qvel[self._qvel].tolist() if velocities else None)

    def move(self, twists: Array) -> None:
        """See `BodyStates.move`."""
        for group in self._free:
            group.move(twists)
        self._data.qvel[self._qvel] = start_velocities(self._scene, twists)

    def state_of(self, body: str) -> tuple[Transform, Array]:
        """See `Engine.body_state`."""
        if body not in self._children:
            return self._group(body).state_of(body)
        k, joint = self._scene.mover(body)
        position, velocity = float(self._data.qpos[self._qpos[k]]), float(self._data.qvel[self._qvel[k]])
        return link_state(self._scene, joint, self.state_of, position, velocity)

    def place(self, body: str, X_WO: Transform, twist: Array) -> None:
        """See `Engine.place`. The solver begins without its last acceleration."""
        if body not in self._children:
            self._group(body).place(body, X_WO, twist)
            return
        data = self._data
        k, joint = self._scene.mover(body)
        data.qpos[self._qpos[k]], data.qvel[self._qvel[k]] = joint_state(self._scene, joint, self.state_of, X_WO, twist)
        data.qacc_warmstart[self._qvel[k]] = 0.0

    def _group(self, body: str) -> BodyStates:
        return next(group for group in self._free if body in group)
