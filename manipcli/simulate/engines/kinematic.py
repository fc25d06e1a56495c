"""Ideal engine: exact tracking without physics; objects do not move, joints of the scene stay where they are, and there
are no contacts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from manipcli.control.command import JointCommand
from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineMember, EngineSettings, Refusal
from manipcli.simulate.engines.link_states import LinkStates, joint_state, start_positions
from manipcli.spec.base import Model


class KinematicSpec(Model):
    """The ideal engine has no settings of its own."""


class KinematicEngine:
    """Ideal tracking on any interface; mimic joints follow their driver exactly. Fast, for tests.

    A written reference applies in its own tick. The next read has moved on at the reference velocity, so that a moving
    controller sees an error of a T^2 / 2, not of v T. With commanded velocities it has not, because their reference is
    already the position one tick ahead.
    """

    ideal: Final = True

    def __init__(self, robot: RobotModel, scene: Scene, settings: EngineSettings) -> None:
        n, m = len(robot.joint_names), len(scene.movable)
        self._followers = [
            (k, robot.joint_names.index(joint.mimic.joint), joint.mimic)
            for k, joint in enumerate(robot.moving_joints)
            if joint.mimic is not None
        ]
        self._period = settings.step * settings.substeps
        self._advanced = False
        self._version = -1
        self._commanded, self._coasts = np.zeros((2, n), dtype=np.bool_)
        state = self._state = WorldState.room(n, m)
        state.position[:] = settings.start
        self._rows = {body.name: k for k, body in enumerate(scene.movable)}
        self._scene, self._passive = scene, start_positions(scene)
        self._links = LinkStates(scene, state)
        for body in scene.movable[: m - len(scene.joints)]:
            self.place(body.name, body.X_WO, np.zeros(6))
        self._links.fill(self._passive, None)

    def read(self, *, velocities: bool = True) -> WorldState:
        if self._advanced:
            self._advanced = False
            position, velocity = self._state.position, self._state.velocity
            np.add(position, self._period * velocity, out=position, where=self._coasts)
            self._follow()
        return self._state

    def write(self, command: JointCommand) -> None:
        if command.version != self._version:
            self._version = command.version
            self._commanded = np.array([mode not in ("brake", "free") for mode in command.modes])
            self._coasts = np.array([mode in ("position", "effort") for mode in command.modes])
        position, velocity = self._state.position, self._state.velocity
        np.copyto(position, command.reference_position, where=self._commanded)
        velocity[:] = np.where(self._commanded, command.reference_velocity, 0.0)
        self._follow()

    def _follow(self) -> None:
        position, velocity = self._state.position, self._state.velocity
        for follower, driver, mimic in self._followers:
            position[follower] = mimic.follow(position[driver])
            velocity[follower] = mimic.ratio(position[driver]) * velocity[driver]

    def sense_wrench(self, joint: str) -> Array:
        return np.zeros(6)

    def attach(self, body: str) -> Array:
        return np.zeros(6)

    def detach(self, body: str) -> None:
        """No effect: objects do not move."""

    def body_state(self, body: str) -> tuple[Transform, Array]:
        state, k = self._state, self._rows[body]
        return Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k]), np.zeros(6)

    def place(self, body: str, X_WO: Transform, twist: Array) -> None:
        if any(joint.child == body for joint in self._scene.joints):
            k, joint = self._scene.mover(body)
            self._passive[k], _ = joint_state(self._scene, joint, self.body_state, X_WO, twist)
        else:
            state, k = self._state, self._rows[body]
            state.body_position[k], state.body_quat_xyzw[k] = X_WO.p, X_WO.quat_xyzw
        self._links.fill(self._passive, None)

    def advance(self) -> None:
        self._advanced = True

    def touches_changed(self) -> bool:
        return False

    def contacts(self, *, peek: bool = False) -> tuple[Contact, ...]:
        return ()

    def close(self) -> None:
        """No effect."""


def _version() -> str:
    from manipcli.core.version import __version__

    return __version__


def _refuses(robot: RobotModel, scene: Scene, own: Model | None) -> tuple[Refusal, ...]:
    return ()


def _chosen(robot: RobotModel, scene: Scene, settings: EngineSettings) -> Mapping[str, str]:
    return {}


def _prepare() -> None:
    """No effect: it needs no library."""


MEMBER = EngineMember(
    name="kinematic",
    physics="none",
    spec=KinematicSpec,
    refuses=_refuses,
    open=KinematicEngine,
    chosen=_chosen,
    version=_version,
    prepare=_prepare,
)
