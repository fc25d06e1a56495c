"""Bullet through PyBullet's DIRECT mode. The only file that knows PyBullet's indices and tuples."""

from __future__ import annotations

import math
import struct
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Final, cast

import numpy as np

from manipcli.control.actuation import motor_effort_limits
from manipcli.control.command import JointCommand, Mode
from manipcli.core.errors import Finding, InvalidInput, ManipcliError, SimulationFailed
from manipcli.core.geometry import Array
from manipcli.model.mesh_files import clean_mesh
from manipcli.model.normalise import engine_urdf, massless_joints
from manipcli.model.robot import Box, Cylinder, Mesh, RobotModel, Sphere
from manipcli.model.scene import Body, Scene
from manipcli.model.state import Contact, WorldState
from manipcli.simulate.engine import EngineMember, EngineSettings
from manipcli.simulate.engines.pybullet_contacts import NONE, ContactMerger, Pair, Vector, touching_pairs
from manipcli.simulate.engines.pybullet_readback import differences
from manipcli.simulate.engines.pybullet_rotors import add_rotors
from manipcli.simulate.engines.pybullet_wrench import WrenchSensor
from manipcli.simulate.quiet import silence, stdout_to_stderr

SOLVER_ITERATIONS: Final = 50
MAX_JOINTS: Final = 127
"""Moving and fixed; with one more `getJointState` fails, with thousands the process."""
UNLIMITED_EFFORT: Final = 1e6
"""Stands for "no effort limit" where PyBullet wants a number [N m or N]."""
POSITION_TIME: Final = 0.01
"""A position command is approached with this time constant [s], whatever the physics step; ros_gz's default gain of
0.1 at 1 kHz is nearly that."""
MIMIC_ERP: Final = 0.2
MIMIC_EFFORT: Final = 200.0
"""What a mimic coupling may carry [N m or N]."""


class PybulletEngine:
    """One PyBullet world."""

    ideal: Final = False

    def __init__(self, robot: RobotModel, scene: Scene, settings: EngineSettings) -> None:
        if refused := refuses(robot):
            raise InvalidInput(refused)
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
            numSolverIterations=SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        with tempfile.TemporaryDirectory(prefix="manipcli-") as folder:
            self._bodies = [self._add_body(body, Path(folder)) for body in scene.bodies]
            self._load_robot(robot, scene, Path(folder))
        self._movable = [
            (k, *_centre(body)) for body, k in zip(scene.bodies, self._bodies, strict=True) if not body.fixed
        ]
        self._start(robot, settings)
        n, m = len(self._joints), len(self._movable)
        poses = np.zeros(2 * n + 7 * m)
        bodies = poses[2 * n :].reshape(m, 7)
        self._buffer, self._pack = poses.data.cast("B"), struct.Struct(f"{poses.size}d").pack_into
        self._state = WorldState(
            time=np.zeros(()),
            position=poses[:n],
            velocity=poses[n : 2 * n],
            effort=np.zeros(n),
            body_position=bodies[:, :3],
            body_quat_xyzw=bodies[:, 3:],
            body_linear=np.zeros((m, 3)),
            body_angular=np.zeros((m, 3)),
        )
        self._pairs: set[Pair] = NONE
        self._substeps = settings.substeps
        self._stiffness = -math.expm1(-settings.step / POSITION_TIME)

    def _add_body(self, body: Body, folder: Path) -> int:
        p, client = self._p, self._client
        kinds, half, radii, lengths, positions, quats = [], [], [], [], [], []
        files, scales = [], []
        for geometry in body.geometries:
            X_IS = body.X_OI.inverse() @ geometry.X_LS
            shape = geometry.shape
            kinds.append(_geometry_kind(p, shape))
            half.append([s / 2 for s in shape.size] if isinstance(shape, Box) else [0.0, 0.0, 0.0])
            radii.append(shape.radius if isinstance(shape, Sphere | Cylinder) else 0.0)
            lengths.append(shape.length if isinstance(shape, Cylinder) else 0.0)
            files.append(str(clean_mesh(shape, folder)) if isinstance(shape, Mesh) else "")
            scales.append(list(shape.scale) if isinstance(shape, Mesh) else [1.0, 1.0, 1.0])
            positions.append(list(X_IS.p))
            quats.append(list(X_IS.quat_xyzw))
        collision = p.createCollisionShapeArray(
            shapeTypes=kinds,
            halfExtents=half,
            radii=radii,
            lengths=lengths,
            fileNames=files,
            meshScales=scales,
            collisionFramePositions=positions,
            collisionFrameOrientations=quats,
            physicsClientId=client,
        )
        X_WI = body.X_WO @ body.X_OI
        k = p.createMultiBody(
            baseMass=0.0 if body.fixed else body.mass,
            baseCollisionShapeIndex=collision,
            basePosition=list(X_WI.p),
            baseOrientation=list(X_WI.quat_xyzw),
            physicsClientId=client,
        )
        p.changeDynamics(
            k,
            -1,
            lateralFriction=body.friction,
            rollingFriction=body.rolling_friction,
            spinningFriction=body.spinning_friction,
            restitution=body.restitution,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=client,
        )
        if not body.fixed:
            p.changeDynamics(k, -1, localInertiaDiagonal=list(np.diag(body.inertia)), physicsClientId=client)
        return cast(int, k)

    def _load_robot(self, robot: RobotModel, scene: Scene, folder: Path) -> None:
        p, client = self._p, self._client
        file = folder / "robot.urdf"
        file.write_text(engine_urdf(robot, folder), encoding="utf-8")
        self._robot: int = p.loadURDF(
            str(file),
            basePosition=list(robot.X_WB.p),
            baseOrientation=list(robot.X_WB.quat_xyzw),
            useFixedBase=True,
            flags=p.URDF_USE_INERTIA_FROM_FILE | p.URDF_IGNORE_VISUAL_SHAPES,
            physicsClientId=client,
        )
        count = p.getNumJoints(self._robot, physicsClientId=client)
        infos = [p.getJointInfo(self._robot, k, physicsClientId=client) for k in range(count)]
        by_name = {info[1].decode(): k for k, info in enumerate(infos)}
        self._joints = [by_name[name] for name in robot.joint_names]
        self._sensed = {joint.name: (by_name[joint.name], joint) for joint in robot.joints}
        self._sensors: list[WrenchSensor] = []
        link_names = {-1: robot.root} | {k: info[12].decode() for k, info in enumerate(infos)}
        for link in link_names:
            p.changeDynamics(
                self._robot,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                lateralFriction=robot.friction,
                physicsClientId=client,
            )
        self._merge = ContactMerger(
            {(k, -1): body.name for body, k in zip(scene.bodies, self._bodies, strict=True)}
            | {(self._robot, link): f"robot/{name}" for link, name in link_names.items()}
        ).merged
        unlike = list(differences(p, client, self._robot, robot, link_names))
        if unlike:
            self.close()
            raise ManipcliError(f"Bullet holds another robot than '{robot.name}': {'; '.join(unlike)}")

    def _start(self, robot: RobotModel, settings: EngineSettings) -> None:
        p, client = self._p, self._client
        for k, position in zip(self._joints, settings.start, strict=True):
            p.resetJointState(self._robot, k, float(position), 0.0, physicsClientId=client)
        p.setJointMotorControlArray(
            self._robot,
            self._joints,
            p.VELOCITY_CONTROL,
            forces=[0.0] * len(self._joints),
            physicsClientId=client,
        )
        for joint in robot.moving_joints:
            if joint.mimic is not None:
                self._couple(robot, joint.name, joint.mimic.joint, joint.mimic.multiplier, joint.mimic.offset)
        n = len(self._joints)
        self._version = -1
        self._torques_at: slice | list[int] = []
        self._torque_joints: list[int] = []
        self._torques: list[float] = []
        self._motors: list[tuple[int, int, Mode]] = []
        self._measures = False
        self._applied = np.zeros(n)
        add_rotors(p, client, robot, self._robot, self._joints)
        limits = [joint.limits for joint in robot.moving_joints]
        self._efforts = [min(float(effort), UNLIMITED_EFFORT) for effort in motor_effort_limits(robot)]
        self._velocities = [math.inf if limit.velocity is None else limit.velocity for limit in limits]

    def _couple(self, robot: RobotModel, follower: str, driver: str, multiplier: float, offset: float) -> None:
        """A gear constraint between the two joints' child links: follower - multiplier * driver = offset."""
        p, client = self._p, self._client
        constraint = p.createConstraint(
            self._robot,
            self._joints[robot.joint_names.index(follower)],
            self._robot,
            self._joints[robot.joint_names.index(driver)],
            jointType=p.JOINT_GEAR,
            jointAxis=list(robot.joint(follower).axis),
            parentFramePosition=[0, 0, 0],
            childFramePosition=[0, 0, 0],
            physicsClientId=client,
        )
        p.changeConstraint(
            constraint,
            gearRatio=-multiplier,
            relativePositionTarget=offset,
            erp=MIMIC_ERP,
            maxForce=MIMIC_EFFORT,
            physicsClientId=client,
        )

    def read(self, *, velocities: bool = True) -> WorldState:
        p, client, state = self._p, self._client, self._state
        # One list for all numbers, copied at once: a tick has no time for an array operation for each of them.
        states = p.getJointStates(self._robot, self._joints, client)
        numbers = [s[0] for s in states]
        numbers += [s[1] for s in states]
        for k, offset, turned in self._movable:
            position, quat = p.getBasePositionAndOrientation(k, client)
            if turned is not None:
                _, quat = p.multiplyTransforms((0, 0, 0), quat, (0, 0, 0), turned)
            numbers += position if offset is None else _minus(position, _rotated(quat, offset))
            numbers += quat
        self._pack(self._buffer, 0, *numbers)
        if self._measures:
            state.effort[:] = [s[3] for s in states]
            state.effort[self._torques_at] += self._applied[self._torques_at]
        else:
            state.effort[:] = self._applied
        if velocities:
            for row, (k, offset, _) in enumerate(self._movable):
                linear, angular = p.getBaseVelocity(k, client)
                if offset is not None:
                    arm = _rotated(tuple(state.body_quat_xyzw[row].tolist()), offset)
                    linear = _minus(linear, _cross(angular, arm))
                state.body_linear[row] = linear
                state.body_angular[row] = angular
        for sensor in self._sensors:
            sensor.measure()
        return state

    def write(self, command: JointCommand) -> None:
        if command.version != self._version:
            self._obey(command)
        p, client = self._p, self._client
        if self._torque_joints:
            at = self._torques_at
            self._applied[at] = command.effort[at]
            self._torques = self._applied[at].tolist()
        for row, joint, mode in self._motors:
            if mode == "position":
                p.setJointMotorControl2(
                    self._robot,
                    joint,
                    p.POSITION_CONTROL,
                    targetPosition=float(command.position[row]),
                    targetVelocity=float(command.velocity[row]),
                    positionGain=self._stiffness,
                    force=self._efforts[row],
                    maxVelocity=self._velocities[row],
                    physicsClientId=client,
                )
            else:
                p.setJointMotorControl2(
                    self._robot,
                    joint,
                    p.VELOCITY_CONTROL,
                    targetVelocity=float(command.velocity[row]),
                    force=self._efforts[row],
                    physicsClientId=client,
                )

    def _obey(self, command: JointCommand) -> None:
        """What each joint obeys has changed: motors on or off. A motor is Bullet's own constraint on a joint's speed,
        with the joint's effort as its limit; where efforts are commanded it has none."""
        p = self._p
        self._version = command.version
        modes = command.modes
        torques = [k for k, mode in enumerate(modes) if mode in ("effort", "position")]
        self._torques_at = slice(None) if len(torques) == len(modes) else torques
        self._torque_joints = [self._joints[k] for k in torques]
        self._torques = [0.0] * len(torques)
        self._motors = [(k, self._joints[k], mode) for k, mode in enumerate(modes) if mode in ("position", "velocity")]
        self._measures = bool(self._motors) or "brake" in modes
        self._applied[:] = 0.0
        for k, mode in enumerate(modes):
            if mode == "brake":
                self._brake(k)
        released = [self._joints[k] for k, mode in enumerate(modes) if mode in ("effort", "free")]
        if released:
            none = [0.0] * len(released)
            p.setJointMotorControlArray(
                self._robot, released, p.VELOCITY_CONTROL, forces=none, physicsClientId=self._client
            )

    def _brake(self, k: int) -> None:
        p, joint = self._p, self._joints[k]
        p.setJointMotorControl2(
            self._robot, joint, p.VELOCITY_CONTROL, targetVelocity=0.0, force=self._efforts[k],
            physicsClientId=self._client,
        )  # fmt: skip

    def sense_wrench(self, joint: str) -> Array:
        sensor = WrenchSensor(self._p, self._client, self._robot, *self._sensed[joint])
        self._sensors.append(sensor)
        return sensor.values

    def advance(self) -> None:
        p, client, joints = self._p, self._client, self._torque_joints
        for _ in range(self._substeps):
            if joints:  # Bullet forgets torques after a step
                p.setJointMotorControlArray(
                    self._robot, joints, p.TORQUE_CONTROL, forces=self._torques, physicsClientId=client
                )
            p.stepSimulation(client)

    def touches_changed(self) -> bool:
        points = self._p.getContactPoints(self._robot, physicsClientId=self._client)
        return (touching_pairs(points) if points else NONE) != self._pairs

    def robot_contacts(self) -> tuple[Contact, ...]:
        points = self._p.getContactPoints(self._robot, physicsClientId=self._client)
        self._pairs = touching_pairs(points)
        return self._merge(points)

    def contacts(self) -> tuple[Contact, ...]:
        return self._merge(self._p.getContactPoints(physicsClientId=self._client))

    def close(self) -> None:
        if self._client >= 0:
            self._p.disconnect(self._client)
            self._client = -1


def _geometry_kind(p: ModuleType, shape: Box | Sphere | Cylinder | Mesh) -> int:
    if isinstance(shape, Box):
        return cast(int, p.GEOM_BOX)
    if isinstance(shape, Sphere):
        return cast(int, p.GEOM_SPHERE)
    if isinstance(shape, Cylinder):
        return cast(int, p.GEOM_CYLINDER)
    return cast(int, p.GEOM_MESH)


def _centre(body: Body) -> tuple[Vector | None, tuple[float, ...] | None]:
    """Where Bullet's frame of a body, which is that of its principal inertia, stands in the body's own: the position of
    the one, and the rotation back; None where there is nothing to change."""
    x, y, z = (float(v) for v in body.X_OI.p)
    turned = None if np.allclose(body.X_OI.R, np.eye(3)) else tuple(body.X_OI.inverse().quat_xyzw)
    return (x, y, z) if x or y or z else None, turned


# Plain floats: numpy costs ten times as much for three numbers.


def _rotated(quat: tuple[float, ...], v: Vector) -> Vector:
    """R(quat_xyzw) v."""
    x, y, z, w = quat
    a, b, c = v
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


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


def refuses(robot: RobotModel) -> tuple[Finding, ...]:
    """More joints than Bullet reads the state of, and joints that move nothing that has mass."""
    found = []
    if len(robot.joints) > MAX_JOINTS:
        message = f"robot '{robot.name}' has {len(robot.joints)} joints; Bullet holds {MAX_JOINTS}, fixed ones included"
        found.append(Finding("SIM120", message, hint="join links that are fixed to each other"))
    for name in massless_joints(robot):
        message = f"joint '{name}' moves nothing that has mass"
        hint = f"give link '{robot.joint(name).child}' an <inertial>, or use an engine without physics"
        found.append(Finding("SIM121", message, hint=hint))
    return tuple(found)


MEMBER = EngineMember(
    name="pybullet", physics="full", refuses=refuses, open=PybulletEngine, version=_version, prepare=_library
)
