"""Jointed things of a scene in PyBullet: one multi-body each, with limits, damping, dry friction and springs.

Dry friction is a motor that holds the speed 0 with at most that effort. A spring is an effort per physics step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from types import ModuleType
from typing import Final, NamedTuple

import numpy as np

from manipcli.core.errors import ManipcliError
from manipcli.core.geometry import Transform
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.damping import STIFF
from manipcli.model.normalised_urdf import MASSLESS, links_urdf
from manipcli.scene.joint_inertia import moved_inertia
from manipcli.scene.joints import SceneJoint, root_of
from manipcli.scene.scene import Body, Scene
from manipcli.simulate.engines.pybullet_readback import body_differences

BASE: Final = -1
"""Bullet's number of the root of a multi-body."""


class Place(NamedTuple):
    """Bullet's numbers of a body of the scene: of the multi-body, and of its link."""

    body: int
    link: int = BASE


class JointedThings:
    """The jointed things of one world.

    Args:
        p, client: PyBullet and its world.
        scene: with the things.
        step: [s] of the physics.
        folder: for description and mesh files, until Bullet has read them.
    """

    def __init__(self, p: ModuleType, client: int, scene: Scene, step: float, folder: Path) -> None:
        self._p, self._client, self._joints = p, client, scene.joints
        self.places: dict[str, Place] = {}
        for root in dict.fromkeys(root_of(scene.joints, joint.child) for joint in scene.joints):
            self._load(scene, scene.body(root), step, folder)
        self._at = [self.places[joint.child] for joint in scene.joints]
        self._groups: list[tuple[int, list[int], list[int]]] = []
        for body in dict.fromkeys(place.body for place in self._at):
            rows = [k for k, place in enumerate(self._at) if place.body == body]
            self._groups.append((body, [self._at[k].link for k in rows], rows))
        self._sprung = [
            (body, [self._at[k].link for k in sprung], [scene.joints[k] for k in sprung])
            for body, _, rows in self._groups
            if (sprung := [k for k in rows if scene.joints[k].stiffness > 0.0])
        ]

    def _load(self, scene: Scene, root: Body, step: float, folder: Path) -> None:
        p, client = self._p, self._client
        joints = [joint for joint in scene.joints if root_of(scene.joints, joint.child) == root.name]
        bodies = [root, *(scene.body(joint.child) for joint in joints)]
        file = folder / f"thing_{p.getNumBodies(physicsClientId=client)}.urdf"
        file.write_text(links_urdf(*_description(bodies, joints, scene, step), folder), encoding="utf-8")
        X_WI = root.X_WO @ root.X_OI
        number: int = p.loadURDF(
            str(file),
            basePosition=list(X_WI.p),
            baseOrientation=list(X_WI.quat_xyzw),
            useFixedBase=root.fixed,
            flags=p.URDF_USE_INERTIA_FROM_FILE
            | p.URDF_USE_IMPLICIT_CYLINDER
            | p.URDF_IGNORE_VISUAL_SHAPES
            | p.URDF_USE_SELF_COLLISION,
            physicsClientId=client,
        )
        infos = [p.getJointInfo(number, k, physicsClientId=client) for k in range(len(joints))]
        links = {info[12].decode(): k for k, info in enumerate(infos)}  # depth first, and so not in the order of joints
        for k, body in enumerate(bodies):
            self.places[body.name] = place = Place(number, links.get(f"link{k}", BASE))
            self._finish(body, place)
        for joint in joints:
            p.setJointMotorControl2(
                number, self.places[joint.child].link, p.VELOCITY_CONTROL, targetVelocity=0.0, force=joint.friction,
                physicsClientId=client,
            )  # fmt: skip
        joined = {frozenset((joint.parent, joint.child)) for joint in joints}
        for a, b in combinations(bodies, 2):
            if frozenset((a.name, b.name)) in joined:
                first, second = self.places[a.name].link, self.places[b.name].link
                p.setCollisionFilterPair(number, number, first, second, 0, physicsClientId=client)

    def _finish(self, body: Body, place: Place) -> None:
        """Contact parameters of a link, its inertia if it is the root, and a comparison with the body."""
        p, client = self._p, self._client
        # Two calls: with a damping, Bullet drops all other values of a link.
        p.changeDynamics(*place, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
        p.changeDynamics(
            *place,
            lateralFriction=body.friction,
            rollingFriction=body.rolling_friction,
            spinningFriction=body.spinning_friction,
            restitution=body.restitution,
            physicsClientId=client,
        )
        if place.link == BASE and not body.fixed:
            p.changeDynamics(*place, localInertiaDiagonal=list(np.diag(body.inertia)), physicsClientId=client)
        unlike = "; ".join(body_differences(p, client, place.body, body, place.link))
        if unlike:
            raise ManipcliError(f"Bullet loaded a different body than '{body.name}': {unlike}")

    def __bool__(self) -> bool:
        return bool(self._joints)

    def set(self, joint: int, position: float, velocity: float) -> None:
        """Put a joint, by its number in the scene, at a position, with a velocity."""
        self._p.resetJointState(*self._at[joint], position, velocity, physicsClientId=self._client)

    def read(self) -> tuple[list[float], list[float]]:
        """Positions and velocities of all joints, in the order of the scene."""
        positions, velocities = [0.0] * len(self._joints), [0.0] * len(self._joints)
        for body, links, rows in self._groups:
            for k, state in zip(rows, self._p.getJointStates(body, links, self._client), strict=True):
                positions[k], velocities[k] = state[0], state[1]
        return positions, velocities

    def push(self) -> None:
        """Apply the springs for the next physics step: Bullet clears them after each step."""
        p, client = self._p, self._client
        for body, links, joints in self._sprung:
            states = p.getJointStates(body, links, client)
            efforts = [joint.stiffness * (joint.rest - state[0]) for state, joint in zip(states, joints, strict=True)]
            p.setJointMotorControlArray(body, links, p.TORQUE_CONTROL, forces=efforts, physicsClientId=client)


def _description(
    bodies: Sequence[Body], joints: Sequence[SceneJoint], scene: Scene, step: float
) -> tuple[list[Link], list[Joint]]:
    """Links and joints for Bullet; the root's frame is that of its inertia, as that of any other body."""
    X_IO = bodies[0].X_OI.inverse()
    names = {body.name: f"link{k}" for k, body in enumerate(bodies)}
    links = []
    for k, body in enumerate(bodies):
        shapes = [replace(shape, X_LS=X_IO @ shape.X_LS if k == 0 else shape.X_LS) for shape in body.geometries]
        inertial = Inertial(mass=body.mass, X_LI=body.X_OI, inertia=body.inertia)
        if k == 0:  # isotropic, as Bullet would otherwise rotate the frame; `_finish` sets the true inertia
            inertial = MASSLESS if body.fixed else replace(inertial, X_LI=Transform.identity(), inertia=np.eye(3))
        links.append(Link(names[body.name], inertial, (), tuple(shapes)))
    made = [
        Joint(
            name=f"joint{k}",
            type=joint.type,
            parent=names[joint.parent],
            child=names[joint.child],
            X_PJ=X_IO @ joint.X_PJ if joint.parent == bodies[0].name else joint.X_PJ,
            axis=joint.axis,
            limits=JointLimits(_finite(joint.lower), _finite(joint.upper)),
            damping=_stable_damping(joint.damping, moved_inertia(scene, joint), step),
        )
        for k, joint in enumerate(joints)
    ]
    return links, made


def _finite(limit: float) -> float | None:
    return limit if math.isfinite(limit) else None


def _stable_damping(damping: float, inertia: float, step: float) -> float:
    """The damping for Bullet, which integrates it explicitly: a stiff one decays as exp(-damping t / inertia)."""
    share = damping * step / inertia
    return damping if share <= STIFF else -math.expm1(-share) * inertia / step
