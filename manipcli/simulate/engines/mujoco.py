"""MuJoCo engine. Needs the package mujoco-core (extra `manipcli[mujoco]`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from manipcli.control.command import JointCommand
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError, SimulationFailed
from manipcli.core.geometry import Array, rotate
from manipcli.model.normalised_urdf import massless_links
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineMember, EngineSettings, Refusal
from manipcli.simulate.engines.mujoco_contacts import Contacts
from manipcli.simulate.engines.mujoco_library import INSTALL, installed, library, version
from manipcli.simulate.engines.mujoco_motors import Motors
from manipcli.simulate.engines.mujoco_world import build
from manipcli.simulate.engines.mujoco_wrench import WrenchSensors
from manipcli.simulate.quiet import stdout_to_stderr
from manipcli.spec.base import Model
from manipcli.spec.quantity import Time

CONTACT_TIME: Final = 0.004
"""[s] With MuJoCo's default of 20 ms, a heavy object sinks in by millimetres."""
IMPRATIO: Final = 100.0
"""With MuJoCo's default of 1, a lifted cup slips by 15 mm, with 10 by 2 mm."""


class MujocoSpec(Model):
    """Settings of MuJoCo."""

    restitution: Literal["refuse", "ignore"] = Field(
        "refuse",
        description="`restitution` of bodies has no counterpart in MuJoCo: refuse the task, or ignore it. "
        "Default refuse.",
    )
    contact_time: Annotated[Time, Field(ge=1e-5, le=0.1)] = Field(
        CONTACT_TIME, description="Time constant of contacts, at least 2 physics steps are used. Default 4 ms."
    )
    impratio: Annotated[float, Field(ge=1.0, le=1e4)] = Field(
        IMPRATIO, description="Stiffness ratio of friction to normal contact, 1 to 10000. Default 100."
    )


class MujocoEngine:
    """One MuJoCo world."""

    ideal: Final = False

    def __init__(self, robot: RobotModel, scene: Scene, settings: EngineSettings) -> None:
        if refused := refuses(robot, scene, settings.own):
            raise InvalidInput([refusal.finding for refusal in refused])
        own = _own(settings.own)
        mujoco = library()
        with stdout_to_stderr():
            try:
                built = build(
                    mujoco, robot, scene, step=settings.step, contact_time=own.contact_time, impratio=own.impratio
                )
                data = mujoco.MjData(built.model)
            except (ValueError, mujoco.FatalError) as error:
                raise SimulationFailed(f"the engine refused the world: {error}", time=0.0) from error
        model = built.model
        n, m = len(robot.joint_names), len(scene.movable)
        if (model.nq, model.nv) != (n + 7 * m, n + 6 * m) or np.any(model.jnt_qposadr[:n] != np.arange(n)):
            raise ManipcliError(f"MuJoCo loaded a different robot than '{robot.name}'")
        self._robot, self._model, self._data = robot, model, data
        self._step, self._step1, self._step2 = mujoco.mj_step, mujoco.mj_step1, mujoco.mj_step2
        self._substeps, self._period = settings.substeps, settings.step * settings.substeps
        self._ticks = 0
        data.qpos[:n] = settings.start
        self._position, self._velocity = data.qpos[:n], data.qvel[:n]
        self._poses = data.qpos[n:].reshape(m, 7)
        self._twists = data.qvel[n:].reshape(m, 6)
        offsets = np.array([body.X_OI.p for body in scene.movable]).reshape(m, 3)
        self._offset_rows = [(k, *offset.tolist()) for k, offset in enumerate(offsets) if offset.any()]
        self._offsets = offsets
        self._state = WorldState.room(n, m)
        self._motors = Motors(model, data, robot, settings.step)
        self._contacts = Contacts(model, data, built.parts)
        self._wrenches = WrenchSensors(mujoco, model, data, built.links, settings.step)
        self._warnings = data.warning.number
        mimics = [(k, joint.mimic) for k, joint in enumerate(robot.moving_joints) if joint.mimic is not None]
        self._followers = np.array([k for k, _ in mimics], dtype=np.intp)
        self._drivers = np.array([robot.joint_names.index(mimic.joint) for _, mimic in mimics], dtype=np.intp)
        self._multipliers = np.array([mimic.multiplier for _, mimic in mimics])
        self._mimic_offsets = np.array([mimic.offset for _, mimic in mimics])

    def read(self, *, velocities: bool = True) -> WorldState:
        state, poses = self._state, self._poses
        state.position[:] = self._position
        state.velocity[:] = self._velocity
        self._motors.efforts(state.effort)
        if len(poses):
            state.body_position[:] = poses[:, :3]
            state.body_quat_xyzw[:, :3] = poses[:, 4:]
            state.body_quat_xyzw[:, 3] = poses[:, 3]
            for row in self._offset_rows:
                _shift(poses, state.body_position, *row)
            if velocities:
                self._read_velocities()
        if self._wrenches:
            self._wrenches.measure()
        return state

    def _read_velocities(self) -> None:
        """Velocities of the origins O; MuJoCo has those of the centres of mass, and spins in the body's axes."""
        state, twists = self._state, self._twists
        quats = state.body_quat_xyzw
        angular = rotate(quats, twists[:, 3:])
        state.body_angular[:] = angular
        state.body_linear[:] = twists[:, :3] - np.cross(angular, rotate(quats, self._offsets))

    def write(self, command: JointCommand) -> None:
        self._motors.write(command)

    def sense_wrench(self, joint: str) -> Array:
        return self._wrenches.add(self._robot.joint(joint).child)

    def advance(self) -> None:
        model, data, motors = self._model, self._data, self._motors
        if not motors.active and not self._wrenches:
            self._step(model, data, self._substeps)
        else:
            last = self._substeps - 1
            for k in range(self._substeps):
                if k == last and self._wrenches:
                    self._wrenches.remember()
                self._step1(model, data)
                motors.push()
                self._step2(model, data)
                if len(self._followers):
                    self._follow()
        self._ticks += 1
        if self._warnings.any():
            self._fail()

    def _follow(self) -> None:
        """Put the mimic joints exactly where they belong: the solver leaves a small error."""
        position, velocity = self._position, self._velocity
        position[self._followers] = self._multipliers * position[self._drivers] + self._mimic_offsets
        velocity[self._followers] = self._multipliers * velocity[self._drivers]

    def _fail(self) -> None:
        """Raise the first warning of MuJoCo: after it, the state is not usable."""
        k = int(np.flatnonzero(self._warnings)[0])
        raise SimulationFailed(
            f"MuJoCo {WARNINGS[k] if k < len(WARNINGS) else 'failed'}; its controllers may be unstable, or masses and "
            "forces implausible",
            time=self._ticks * self._period,
        )

    def touches_changed(self) -> bool:
        return self._contacts.changed()

    def contacts(self) -> tuple[Contact, ...]:
        return self._contacts.now()

    def close(self) -> None:
        """Memory is freed with the object."""


WARNINGS: Final = (
    "found a near-singular inertia",
    "ran out of memory for contacts",
    "ran out of memory for constraints",
    "computed a position that is not finite",
    "computed a velocity that is not finite",
    "computed an acceleration that is not finite",
    "got a control that is not finite",
)
"""MuJoCo's warnings (mjtWarning), in its order."""


def _shift(poses: Array, positions: Array, k: int, a: float, b: float, c: float) -> None:
    """Subtract R (a, b, c) from the position of body k; plain floats are faster than arrays here."""
    px, py, pz, w, x, y, z = poses[k].tolist()
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    positions[k] = (
        px - a - w * tx - y * tz + z * ty,
        py - b - w * ty - z * tx + x * tz,
        pz - c - w * tz - x * ty + y * tx,
    )


def _own(settings: Model | None) -> MujocoSpec:
    return settings if isinstance(settings, MujocoSpec) else MujocoSpec()


def refuses(robot: RobotModel, scene: Scene, own: Model | None) -> tuple[Refusal, ...]:
    """A missing package, moving links without mass, and restitution."""
    found = []
    if not installed():
        message = "engine 'mujoco' needs the package mujoco-core, which is not installed"
        found.append(Refusal(Diagnostic("SIM130", message, hint=INSTALL), ("simulation", "engine")))
    found += [Refusal(finding) for finding in massless_links(robot, "SIM121")]
    if _own(own).restitution == "refuse":
        for body in scene.bodies:
            if body.restitution:
                message = f"body '{body.name}' has a restitution of {body.restitution:g}; MuJoCo has no restitution"
                hint = "remove it, write 'simulation: {mujoco: {restitution: ignore}}', or use the engine pybullet"
                at = ("scene", body.name, "restitution")
                found.append(Refusal(Diagnostic("SIM131", message, hint=hint), at))
    return tuple(found)


def _chosen(robot: RobotModel, scene: Scene, settings: EngineSettings) -> Mapping[str, str]:
    return {}


MEMBER = EngineMember(
    name="mujoco",
    physics="full",
    spec=MujocoSpec,
    refuses=refuses,
    open=MujocoEngine,
    chosen=_chosen,
    version=version,
    prepare=library,
)
