"""MuJoCo engine. Needs the package mujoco-core (extra `manipcli[mujoco]`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from manipcli.control.command import JointCommand
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError, SimulationFailed
from manipcli.core.geometry import Array, Transform
from manipcli.model.normalised_urdf import massless_links
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineMember, EngineSettings, Refusal
from manipcli.simulate.engines.mujoco_attachment import Attachments
from manipcli.simulate.engines.mujoco_bodies import free_bodies
from manipcli.simulate.engines.mujoco_contacts import Contacts
from manipcli.simulate.engines.mujoco_joints import MovedStates
from manipcli.simulate.engines.mujoco_library import INSTALL, installed, library, version
from manipcli.simulate.engines.mujoco_mimics import Mimics
from manipcli.simulate.engines.mujoco_motors import Motors
from manipcli.simulate.engines.mujoco_sleep import Sleep, enable_sleep
from manipcli.simulate.engines.mujoco_world import build, contact_law
from manipcli.simulate.engines.mujoco_wrench import WrenchSensors
from manipcli.simulate.quiet import stdout_to_stderr
from manipcli.spec.base import Model
from manipcli.spec.quantity import Time

CONTACT_TIME: Final = 0.004
"""[s] With MuJoCo's default of 20 ms, a cup of 300 g with friction 0.5 slips by 2 mm while it is lifted and poured."""
IMPRATIO: Final = 100.0
"""With MuJoCo's default of 1, the same cup slips by 21 mm, with 10 by 4 mm, with 100 by less than 0.1 mm; with 1000 no
less, and a run takes 8 % longer."""


class MujocoSpec(Model):
    """Settings of MuJoCo."""

    restitution: Literal["refuse", "ignore"] = Field(
        "refuse",
        description="`restitution` of bodies has no counterpart in MuJoCo: refuse the task, or ignore it. "
        "Default refuse.",
    )
    contact_time: Annotated[Time, Field(ge=1e-5, le=0.1)] = Field(
        CONTACT_TIME, description="Time constant of contacts; at least 4 physics steps are used. Default 4 ms."
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
                built = build(mujoco, robot, scene, settings, contact_time=own.contact_time, impratio=own.impratio)
                if settings.sleep:
                    enable_sleep(mujoco, built.model)
                data = mujoco.MjData(built.model)
            except (ValueError, mujoco.FatalError) as error:
                raise SimulationFailed(f"the engine refused the world: {error}", time=0.0) from error
        model = built.model
        n, m, j = len(robot.joint_names), len(scene.movable), len(scene.joints)
        if (model.nq, model.nv) != (n + j + 7 * (m - j), n + j + 6 * (m - j)) or built.joints != tuple(range(n)):
            raise ManipcliError(f"MuJoCo loaded a different robot than '{robot.name}'")
        self._robot, self._model, self._data = robot, model, data
        self._step, self._step1, self._step2 = mujoco.mj_step, mujoco.mj_step1, mujoco.mj_step2
        self._substeps, self._period = settings.substeps, settings.step * settings.substeps
        self._ticks = 0
        data.qpos[:n] = settings.start
        self._position, self._velocity = data.qpos[:n], data.qvel[:n]
        self._state = WorldState.room(n, m)
        free = free_bodies(model, data, scene, built.bodies, self._state)
        at = [(int(model.jnt_qposadr[k]), int(model.jnt_dofadr[k])) for k in built.passive]
        self._bodies = MovedStates(data, scene, self._state, at, free) if at or len(free) > 1 else free[0]
        if settings.velocity is not None:
            self._velocity[:] = settings.velocity
        if settings.twists is not None:
            self._bodies.move(settings.twists)
        self._motors = Motors(model, data, robot, settings.step, islands=settings.sleep)
        self._contacts = Contacts(model, data, built.parts)
        self._wrenches = WrenchSensors(mujoco, model, data, built.links, settings.step)
        self._attachments = Attachments(mujoco, model, data, robot, scene, built.links)
        self._warnings = data.warning.number
        self._calm = self._warnings.tobytes()
        self._mimics = Mimics(data, robot)
        self._sleep = None
        if settings.sleep:
            trees = [int(model.body_treeid[built.bodies[body.name]]) for body in scene.movable]
            self._sleep = Sleep(mujoco, model, data, scene, trees, self._period)

    def read(self, *, velocities: bool = True) -> WorldState:
        state = self._state
        state.position[:] = self._position
        state.velocity[:] = self._velocity
        self._motors.efforts(state.effort)
        self._bodies.read(velocities=velocities)
        if self._wrenches:
            self._wrenches.measure()
        if self._attachments:
            self._attachments.measure()
        elif self._sleep is not None and self._sleep.due:
            self._sleep.look(state, self._contacts.peek())
        return state

    def write(self, command: JointCommand) -> None:
        self._motors.write(command)

    def sense_wrench(self, joint: str) -> Array:
        return self._wrenches.add(self._robot.joint(joint).child)

    def attach(self, body: str) -> Array:
        self._wake()
        return self._attachments.attach(body)

    def detach(self, body: str) -> None:
        self._wake()
        self._attachments.detach(body)

    def body_state(self, body: str) -> tuple[Transform, Array]:
        return self._bodies.state_of(body)

    def place(self, body: str, X_WO: Transform, twist: Array) -> None:
        self._wake()
        self._bodies.place(body, X_WO, twist)

    def _wake(self) -> None:
        if self._sleep is not None:
            self._sleep.wake()

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
                if self._mimics:
                    self._mimics.follow()
        self._ticks += 1
        if self._sleep is not None:
            self._sleep.ticked()
        if self._warnings.tobytes() != self._calm:
            self._fail()

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

    def contacts(self, *, peek: bool = False) -> tuple[Contact, ...]:
        found = self._contacts.peek() if peek else self._contacts.now()
        return found if self._sleep is None else self._sleep.with_kept(found)

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
    """The time constant and the depth of contacts, which depend on the physics step."""
    law = contact_law(settings.step, _own(settings.own).contact_time)
    return {"contact_time": f"{law.time:g} s", "contact_depth": f"{law.depth:g} m"}


MEMBER = EngineMember(
    name="mujoco",
    physics="full",
    spec=MujocoSpec,
    refuses=refuses,
    open=MujocoEngine,
    chosen=_chosen,
    version=version,
    prepare=library,
    missing=lambda: "" if installed() else INSTALL,
)
