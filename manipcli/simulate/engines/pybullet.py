"""PyBullet engine, in DIRECT mode."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from manipcli.control.command import JointCommand
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError, SimulationFailed
from manipcli.core.geometry import Array, Transform
from manipcli.description.lint.checks.joints import MAX_JOINTS
from manipcli.model.batch_kinematics import still_links
from manipcli.model.normalised_urdf import engine_urdf, massless_links
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineMember, EngineSettings, Refusal
from manipcli.simulate.engines.link_states import LinkStates, joint_state, link_state, start_positions, start_velocities
from manipcli.simulate.engines.pybullet_attachment import Attachments
from manipcli.simulate.engines.pybullet_contacts import (
    BulletPoint,
    ContactMerger,
    ContactWatch,
)
from manipcli.simulate.engines.pybullet_joints import BASE, JointedThings, Place
from manipcli.simulate.engines.pybullet_motors import Motors
from manipcli.simulate.engines.pybullet_normals import Normals
from manipcli.simulate.engines.pybullet_readback import differences
from manipcli.simulate.engines.pybullet_rotor_inertia import add_rotor_inertia
from manipcli.simulate.engines.pybullet_sleep import Sleep
from manipcli.simulate.engines.pybullet_solver import iterations
from manipcli.simulate.engines.pybullet_world import add_body, centre, close_loops, collide_only, couple_mimics
from manipcli.simulate.engines.pybullet_wrench import WrenchSensors
from manipcli.simulate.engines.resting import Resting
from manipcli.simulate.engines.vectors import Vector, cross, minus, rotated
from manipcli.simulate.quiet import silence, stdout_to_stderr
from manipcli.spec.base import Model


class PybulletSpec(Model):
    """Settings of PyBullet."""

    solver_iterations: Annotated[int, Field(ge=1, le=10_000)] | None = Field(
        None,
        description="Largest number of iterations of the contact solver per physics step, 1 to 10000. Default: by the "
        "scene. 1000 if a movable body is lighter than 50 g. 100 for at most 5 movable bodies with masses up to 50 "
        "times apart and a robot without rotor inertia; what lies in a movable container need only have 10 g. Else "
        "200. The log contains the number and the reason.",
    )


class PybulletEngine:
    """One PyBullet world."""

    ideal: Final = False

    def __init__(self, robot: RobotModel, scene: Scene, settings: EngineSettings) -> None:
        if refused := refuses(robot, scene, settings.own):
            raise InvalidInput([refusal.finding for refusal in refused])
        pybullet = _library()
        with stdout_to_stderr():
            self._p = pybullet
            self._client: int = pybullet.connect(pybullet.DIRECT)
            try:
                self._build(robot, scene, settings)
            except BaseException as error:
                self.close()
                if isinstance(error, pybullet.error):
                    raise SimulationFailed(f"the engine refused the world: {error}", time=0.0) from error
                raise

    def _build(self, robot: RobotModel, scene: Scene, settings: EngineSettings) -> None:
        p, client = self._p, self._client
        p.setGravity(*scene.gravity, physicsClientId=client)
        p.setPhysicsEngineParameter(
            fixedTimeStep=settings.step,
            numSolverIterations=_own(settings.own).solver_iterations or iterations(robot, scene).number,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        with tempfile.TemporaryDirectory(prefix="manipcli-") as folder:
            self._things = JointedThings(p, client, scene, settings.step, Path(folder))
            self._places = {
                body.name: self._things.places.get(body.name) or Place(add_body(p, client, body, Path(folder)))
                for body in scene.bodies
            }
            self._load_robot(robot, scene, settings, Path(folder))
        self._scene, places = scene, self._places
        self._rows = {body.name: row for row, body in enumerate(scene.movable)}
        self._movable = [  # what joints move comes last
            (places[body.name].body, *centre(body)) for body in scene.movable if places[body.name].link == BASE
        ]
        self._start(robot, settings)
        links = {name: k for k, name in self._links.items()}
        self._wrenches = WrenchSensors(
            p, client, robot, self._robot, self._joints, links, gravity=scene.gravity, step=settings.step
        )
        self._attachments = Attachments(p, client, robot, self._robot, links, places)
        n, m = len(self._joints), len(scene.movable)
        state = self._state = WorldState.room(n, m)
        self._linked = LinkStates(scene, state)
        self._room = [0.0] * (7 * len(scene.joints))
        self._buffer, self._pack = state.numbers.data.cast("B"), struct.Struct(f"{state.numbers.size}d").pack_into
        self._watch = ContactWatch(self._robot)
        self._points: tuple[BulletPoint, ...] | None = None
        self._substeps = settings.substeps
        self._sleep = self._sleeping(scene, settings) if settings.sleep else None

    def _sleeping(self, scene: Scene, settings: EngineSettings) -> Sleep:
        resting = Resting(scene, settings.step * settings.substeps)
        bodies = {row: place[0] for row, place in enumerate(self._movable) if row not in resting.never}
        fixed = [
            self._places[body.name].body for body in scene.bodies if body.fixed and body.name not in resting.jointed
        ]
        return Sleep(self._p, self._client, resting, bodies, fixed)

    def _load_robot(self, robot: RobotModel, scene: Scene, settings: EngineSettings, folder: Path) -> None:
        p, client = self._p, self._client
        file = folder / "robot.urdf"
        file.write_text(engine_urdf(robot, folder), encoding="utf-8")
        self._robot: int = p.loadURDF(
            str(file),
            basePosition=list(robot.X_WB.p),
            baseOrientation=list(robot.X_WB.quat_xyzw),
            useFixedBase=True,
            flags=p.URDF_USE_INERTIA_FROM_FILE
            | p.URDF_IGNORE_VISUAL_SHAPES
            | (p.URDF_USE_SELF_COLLISION if settings.self_collision else 0),
            physicsClientId=client,
        )
        count = p.getNumJoints(self._robot, physicsClientId=client)
        infos = [p.getJointInfo(self._robot, k, physicsClientId=client) for k in range(count)]
        by_name = {info[1].decode(): k for k, info in enumerate(infos)}
        self._joints = [by_name[name] for name in robot.joint_names]
        self._model = robot
        self._links = link_names = {-1: robot.root} | {k: info[12].decode() for k, info in enumerate(infos)}
        for link in link_names:
            # Two calls: with a damping, Bullet drops all other values of a link.
            p.changeDynamics(self._robot, link, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
            p.changeDynamics(self._robot, link, lateralFriction=robot.friction, physicsClientId=client)
        places = {name: (place.body, place.link) for name, place in self._places.items()}
        still = [
            *(place for name, place in places.items() if scene.body(name).fixed),
            *((self._robot, link) for link, name in link_names.items() if name in still_links(robot)),
        ]
        names = {place: name for name, place in places.items()}
        names |= {(self._robot, link): f"robot/{name}" for link, name in link_names.items()}
        self._merge = ContactMerger(names, still=still).merged
        moving = {row: places[body.name] for row, body in enumerate(scene.movable)}
        self._normals = Normals(p, client, moving, still)
        if settings.self_collision:
            collide_only(p, client, self._robot, link_names, settings.self_collision)
        unlike = list(differences(p, client, self._robot, robot, link_names))
        if unlike:
            self.close()
            raise ManipcliError(f"Bullet loaded a different robot than '{robot.name}': {'; '.join(unlike)}")

    def _start(self, robot: RobotModel, settings: EngineSettings) -> None:
        p, client = self._p, self._client
        velocity = 0.0 * settings.start if settings.velocity is None else settings.velocity
        for k, position, speed in zip(self._joints, settings.start, velocity, strict=True):
            p.resetJointState(self._robot, k, float(position), float(speed), physicsClientId=client)
        if settings.twists is not None:
            self._move_bodies(settings.twists[: len(self._movable)])
        if self._things:
            self._start_joints(settings.twists)
        couple_mimics(p, client, robot, self._robot, self._joints)
        close_loops(p, client, robot, self._robot, {name: k for k, name in self._links.items()})
        add_rotor_inertia(p, client, robot, self._robot, self._joints, step=settings.step)
        self._motors = Motors(p, client, self._robot, self._joints, robot, settings.step)

    def _move_bodies(self, twists: Array) -> None:
        """Give the movable bodies their velocities; Bullet's are those of their centres."""
        for row, twist in enumerate(twists.tolist()):
            self._move_body(row, twist)

    def _start_joints(self, twists: Array | None) -> None:
        """Put the joints of the scene where its bodies are."""
        scene = self._scene
        positions = start_positions(scene)
        velocities = [0.0] * len(positions) if twists is None else start_velocities(scene, twists)
        for k, (position, velocity) in enumerate(zip(positions, velocities, strict=True)):
            self._things.set(k, position, velocity)

    def _move_body(self, row: int, twist: list[float]) -> None:
        p, client = self._p, self._client
        k, offset, _ = self._movable[row]
        x, y, z, *angular = twist
        if offset is not None:
            wx, wy, wz = angular
            ax, ay, az = cross((wx, wy, wz), rotated(self._pose(row)[1], offset))
            x, y, z = x + ax, y + ay, z + az
        p.resetBaseVelocity(k, (x, y, z), angular, physicsClientId=client)

    def _pose(self, row: int) -> tuple[Vector, tuple[float, ...]]:
        """Position and quaternion xyzw of the frame O of a movable body."""
        p, client = self._p, self._client
        k, offset, turned = self._movable[row]
        position, quat = p.getBasePositionAndOrientation(k, client)
        if turned is not None:
            _, quat = p.multiplyTransforms((0, 0, 0), quat, (0, 0, 0), turned)
        return position if offset is None else minus(position, rotated(quat, offset)), quat

    def _velocity(self, row: int, quat: tuple[float, ...]) -> tuple[Vector, Vector]:
        """Velocity of O and angular velocity of a movable body with this orientation."""
        k, offset, _ = self._movable[row]
        linear, angular = self._p.getBaseVelocity(k, self._client)
        return linear if offset is None else minus(linear, cross(angular, rotated(quat, offset))), angular

    def read(self, *, velocities: bool = True) -> WorldState:
        p, client, state = self._p, self._client, self._state
        # One list for all numbers, copied at once: one array operation per number is too slow for a tick.
        states = p.getJointStates(self._robot, self._joints, client)
        numbers = [s[0] for s in states]
        numbers += [s[1] for s in states]
        numbers += self._motors.efforts(states)
        for row in range(len(self._movable)):
            position, quat = self._pose(row)
            numbers += position
            numbers += quat
        self._pack(self._buffer, 0, *numbers, *self._room)
        if velocities:
            for row in range(len(self._movable)):
                quat = tuple(state.body_quat_xyzw[row].tolist())
                state.body_linear[row], state.body_angular[row] = self._velocity(row, quat)
        if self._things:
            positions, speeds = self._things.read()
            self._linked.fill(positions, speeds if velocities else None)
        pulls = self._attachments.measure() if self._attachments else ()
        if self._wrenches:
            self._wrenches.measure(state.numbers[: 2 * len(self._joints)], self._contact_points, pulls)
        if self._sleep is not None and self._sleep.due and not self._attachments:
            self._sleep.look(state, self._contact_points())
        if turned := self._normals.turned(state.body_quat_xyzw):
            self._normals.look(turned, self._contact_points())
        return state

    def write(self, command: JointCommand) -> None:
        self._motors.write(command)

    def sense_wrench(self, joint: str) -> Array:
        return self._wrenches.add(self._model.joint(joint).child)

    def attach(self, body: str) -> Array:
        self._wake()
        return self._attachments.attach(body)

    def detach(self, body: str) -> None:
        self._wake()
        self._attachments.detach(body)

    def body_state(self, body: str) -> tuple[Transform, Array]:
        row = self._rows[body]
        if self._places[body].link != BASE:
            k, joint = self._scene.mover(body)
            positions, velocities = self._things.read()
            return link_state(self._scene, joint, self.body_state, positions[k], velocities[k])
        position, quat = self._pose(row)
        twist = np.concatenate(self._velocity(row, quat))
        return Transform.of(xyz=position, quat_xyzw=quat), twist

    def place(self, body: str, X_WO: Transform, twist: Array) -> None:
        p, client, row = self._p, self._client, self._rows[body]
        self._wake()
        if self._places[body].link != BASE:
            k, joint = self._scene.mover(body)
            self._things.set(k, *joint_state(self._scene, joint, self.body_state, X_WO, twist))
            return
        k, offset, turned = self._movable[row]
        quat = tuple(X_WO.quat_xyzw.tolist())
        if turned is not None:
            _, quat = p.multiplyTransforms((0, 0, 0), quat, (0, 0, 0), p.invertTransform((0, 0, 0), turned)[1])
        position = X_WO.p if offset is None else X_WO.apply(offset)
        p.resetBasePositionAndOrientation(k, position.tolist(), quat, physicsClientId=client)
        self._move_body(row, twist.tolist())

    def _wake(self) -> None:
        if self._sleep is not None:
            self._sleep.wake()

    def advance(self) -> None:
        last = self._substeps - 1
        for k in range(self._substeps):
            self._motors.push()
            if self._things:
                self._things.push()
            if k == last and self._wrenches:
                self._wrenches.remember()
            self._p.stepSimulation(self._client)
            self._wrenches.moved()
        self._points = None
        if self._sleep is not None:
            self._sleep.ticked()

    def touches_changed(self) -> bool:
        return self._watch.changed(self._contact_points())

    def contacts(self, *, peek: bool = False) -> tuple[Contact, ...]:
        points = self._contact_points()
        if not peek:
            self._watch.seen(points)
        return self._merge(points)

    def _contact_points(self) -> tuple[BulletPoint, ...]:
        """Read once per tick: building the tuples costs as much as reading them."""
        if self._points is None:
            self._points = self._p.getContactPoints(physicsClientId=self._client)
        return self._points

    def close(self) -> None:
        if self._client >= 0:
            self._p.disconnect(self._client)
            self._client = -1


def _library() -> ModuleType:
    """PyBullet, without its banner."""
    with silence():
        import pybullet

    library: ModuleType = pybullet
    return library


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    for distribution in ("pybullet", "pybullet-arm64"):
        try:
            return version(distribution)
        except PackageNotFoundError:
            continue
    return "unknown"


def refuses(robot: RobotModel, scene: Scene, own: Model | None) -> tuple[Refusal, ...]:
    """Too many joints for Bullet, and moving links without mass."""
    found = []
    if len(robot.joints) > MAX_JOINTS:
        message = (
            f"robot '{robot.name}' has {len(robot.joints)} joints; Bullet supports {MAX_JOINTS}, including fixed ones"
        )
        found.append(Diagnostic("SIM120", message, hint="merge links that are fixed to each other"))
    return tuple(Refusal(finding) for finding in (*found, *massless_links(robot, "SIM121")))


def _own(settings: Model | None) -> PybulletSpec:
    return settings if isinstance(settings, PybulletSpec) else PybulletSpec()


def _chosen(robot: RobotModel, scene: Scene, settings: EngineSettings) -> Mapping[str, str]:
    if _own(settings.own).solver_iterations is not None:
        return {}
    number, reason = iterations(robot, scene)
    return {"solver_iterations": str(number), "solver_iterations_reason": reason}


MEMBER = EngineMember(
    name="pybullet",
    physics="full",
    spec=PybulletSpec,
    refuses=refuses,
    open=PybulletEngine,
    chosen=_chosen,
    version=_version,
    prepare=_library,
)
