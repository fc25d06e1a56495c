"""Poses and velocities of the bodies that joints of a scene move, from the positions and velocities of the joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.state import WorldState
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import Scene
from manipcli.simulate.engines.vectors import Quat, Vector, cross, plus, product, rotated, scaled


@dataclass(frozen=True, slots=True)
class _Link:
    """A moved body: its row, that of its parent (-1: it is fixed), and J in the parent, or in the world if it is."""

    row: int
    parent: int
    slides: bool
    axis: Vector
    p: Vector
    quat: Quat


class LinkStates:
    """The rows of a state for the bodies that joints move: the last rows, in the order of `Scene.joints`.

    Args:
        scene: with joints.
        state: receives what is read; from `WorldState.room`.
    """

    def __init__(self, scene: Scene, state: WorldState) -> None:
        rows = {body.name: k for k, body in enumerate(scene.movable)}
        self._links = [_link(scene, joint, rows) for joint in scene.joints]
        self._first = state.numbers.size - 7 * len(rows)
        self._numbers = cast("memoryview[float]", state.numbers.reshape(-1).data)
        self._linear = cast("memoryview[float]", state.body_linear.reshape(-1).data)
        self._angular = cast("memoryview[float]", state.body_angular.reshape(-1).data)

    def fill(self, positions: Sequence[float], velocities: Sequence[float] | None) -> None:
        """Write the poses, and with `velocities` also the twists, of all moved bodies; those of roots are there."""
        numbers, linear, angular = self._numbers, self._linear, self._angular
        for k, link in enumerate(self._links):
            q = positions[k]
            p, quat, root = link.p, link.quat, (0.0, 0.0, 0.0)
            if link.parent >= 0:
                at = self._first + 7 * link.parent
                its = numbers[at + 3 : at + 7].tolist()
                root = (numbers[at], numbers[at + 1], numbers[at + 2])
                p, quat = plus(root, rotated(its, p)), product(its, quat)
            axis = rotated(quat, link.axis)
            if link.slides:
                p = plus(p, scaled(q, axis))
            else:
                half = math.sin(0.5 * q)
                quat = product(quat, (*scaled(half, link.axis), math.cos(0.5 * q)))
            at = self._first + 7 * link.row
            for j, value in enumerate((*p, *quat)):
                numbers[at + j] = value
            if velocities is None:
                continue
            v, w = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            if link.parent >= 0:
                at = 3 * link.parent
                w = (angular[at], angular[at + 1], angular[at + 2])
                arm = (p[0] - root[0], p[1] - root[1], p[2] - root[2])
                v = plus((linear[at], linear[at + 1], linear[at + 2]), cross(w, arm))
            own = scaled(velocities[k], axis)
            v, w = (plus(v, own), w) if link.slides else (v, plus(w, own))
            at = 3 * link.row
            for j in range(3):
                linear[at + j], angular[at + j] = v[j], w[j]


def _link(scene: Scene, joint: SceneJoint, rows: dict[str, int]) -> _Link:
    parent = scene.body(joint.parent)
    X = parent.X_WO @ joint.X_PJ if parent.fixed else joint.X_PJ
    return _Link(
        row=rows[joint.child],
        parent=-1 if parent.fixed else rows[joint.parent],
        slides=joint.slides,
        axis=cast(Vector, tuple(joint.axis.tolist())),
        p=cast(Vector, tuple(X.p.tolist())),
        quat=cast(Quat, tuple(X.quat_xyzw.tolist())),
    )


def start_positions(scene: Scene) -> list[float]:
    """Positions of the joints for the poses that the bodies have at the start."""
    return [joint.position(scene.body(joint.parent).X_WO, scene.body(joint.child).X_WO) for joint in scene.joints]


def start_velocities(scene: Scene, twists: Array) -> list[float]:
    """Velocities of the joints for twists (m, 6) of the movable bodies."""
    known = {body.name: twist for body, twist in zip(scene.movable, twists, strict=True)}
    return [
        joint.velocity(
            scene.body(joint.parent).X_WO, known.get(joint.parent, np.zeros(6)), scene.body(joint.child).X_WO,
            known[joint.child],
        )
        for joint in scene.joints
    ]  # fmt: skip


StateOf = Callable[[str], tuple[Transform, Array]]
"""X_WO and twist (6) of a movable body."""


def link_state(
    scene: Scene, joint: SceneJoint, state_of: StateOf, position: float, velocity: float
) -> tuple[Transform, Array]:
    """X_WC and twist (6) of the body that a joint moves."""
    X_WP, twist_P = parent_state(scene, joint, state_of)
    X_WC = joint.child_pose(X_WP, position)
    return X_WC, joint.child_twist(X_WP, twist_P, X_WC, velocity)


def joint_state(
    scene: Scene, joint: SceneJoint, state_of: StateOf, X_WC: Transform, twist: Array
) -> tuple[float, float]:
    """Position and velocity of a joint for a pose and a twist (6) of the body that it moves."""
    X_WP, twist_P = parent_state(scene, joint, state_of)
    return joint.position(X_WP, X_WC), joint.velocity(X_WP, twist_P, X_WC, twist)


def parent_state(scene: Scene, joint: SceneJoint, state_of: StateOf) -> tuple[Transform, Array]:
    """X_WP and twist (6) of the body to which a joint is fixed."""
    parent = scene.body(joint.parent)
    return (parent.X_WO, np.zeros(6)) if parent.fixed else state_of(parent.name)
