"""Kinematics and dynamics against plain products, differences, and PyBullet."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.core.units import EARTH_GRAVITY
from manipcli.model.batch_kinematics import forward_batch, relative_batch, tool_poses
from manipcli.model.build_robot import build_robot
from manipcli.model.kinematics import Kinematics
from manipcli.model.normalised_urdf import engine_urdf
from manipcli.model.robot import RobotModel, Tool
from manipcli.spec.robot import AttachSpec, PoseSpec, RobotSpec

ROBOTS = Path(__file__).parents[2] / "robots"
MOUNT = PoseSpec(xyz=(0.1, -0.2, 0.3), rpy=(0.2, -0.1, 0.4))
SPECS = {
    "arm7_hand3": RobotSpec(robot="arm7_hand3", description="urdf/arm7_hand3.urdf.xacro", mount=MOUNT),
    "panda": RobotSpec(robot="panda", description="package://pybullet_data/franka_panda/panda.urdf", mount=MOUNT),
    "iiwa7": RobotSpec(
        robot="iiwa7",
        description="package://pybullet_data/kuka_iiwa/model.urdf",
        attach=(
            AttachSpec(
                description="../arm7_hand3/urdf/hand3.urdf.xacro",
                parent="lbr_iiwa_link_7",
                pose=PoseSpec(xyz=(0, 0, 0.045), rpy=(0.1, 0.2, 0.3)),
            ),
        ),
    ),
}
CONTINUOUS = """<robot name="c"><link name="a"/><link name="b">
<inertial><origin xyz="0.1 0 0.2" rpy="0.3 0 0"/><mass value="1.5"/>
<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
<link name="c"><inertial><mass value="0.5"/><inertia ixx="0.02" iyy="0.02" izz="0.04" ixy="0" ixz="0" iyz="0"/>
</inertial></link>
<joint name="spin" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0.6 0 0.8"/>
<limit velocity="1" effort="2"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0 0 0.1" rpy="0.5 0 0"/>
<axis xyz="0 0.6 0.8"/><limit lower="-1" upper="1" velocity="1" effort="2"/></joint></robot>"""


SINGLE = """<robot name="s"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.2 0.1 -0.05"/><mass value="2"/>
  <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0.1 0.3" rpy="0.2 0.4 0"/>
  <axis xyz="0 0.6 0.8"/><limit lower="-2" upper="2" effort="50" velocity="3"/></joint></robot>"""


@pytest.fixture(scope="module", params=[*SPECS, "continuous", "single"])
def robot(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    if request.param in ("continuous", "single"):
        folder = tmp_path_factory.mktemp("continuous")
        (folder / "c.urdf").write_text(CONTINUOUS if request.param == "continuous" else SINGLE)
        return build_robot(RobotSpec(robot="c", description="c.urdf", mount=MOUNT), file=folder / "robot.yaml")[0]
    return build_robot(SPECS[request.param], file=ROBOTS / request.param / "robot.yaml")[0]


@pytest.fixture
def q(robot: RobotModel) -> Array:
    """Well inside of the limits, so that an engine's limit does not push."""
    rng = np.random.default_rng(1)
    share = rng.uniform(0.2, 0.8, len(robot.moving_joints))
    lower = np.array([-3.0 if joint.limits.lower is None else joint.limits.lower for joint in robot.moving_joints])
    upper = np.array([3.0 if joint.limits.upper is None else joint.limits.upper for joint in robot.moving_joints])
    return np.asarray(lower + share * (upper - lower))


def chain_product(robot: RobotModel, q: Array) -> dict[str, Transform]:
    """X_WL of every link, by multiplying along the tree."""
    value = dict(zip(robot.joint_names, q, strict=True))
    poses = {robot.root: robot.X_WB}
    for joint in robot.joints:
        motion = Transform.identity()
        if joint.type == "prismatic":
            motion = Transform.of(xyz=joint.axis * value[joint.name])
        elif joint.moves:
            motion = Transform.of(R=matrix_from_axis_angle(joint.axis, value[joint.name]))
        poses[joint.child] = poses[joint.parent] @ joint.X_PJ @ motion
    return poses


def test_forward_is_the_product_along_the_chain(robot: RobotModel, q: Array) -> None:
    kinematics = Kinematics(robot)
    for link, X in chain_product(robot, q).items():
        np.testing.assert_allclose(kinematics.forward(q, link).matrix, X.matrix, atol=1e-13)


def test_the_batch_agrees_with_the_chain_at_every_instant(robot: RobotModel, q: Array) -> None:
    times = np.linspace(-1.0, 1.0, 4)[:, None] * q
    p, quat = forward_batch(robot, times)
    p_rel, quat_rel = relative_batch(robot, times)
    for t, at in enumerate(times):
        poses = chain_product(robot, at)
        for k, joint in enumerate(robot.moving_joints):
            X = Transform.of(xyz=p[t, k], quat_xyzw=quat[t, k])
            np.testing.assert_allclose(X.matrix, poses[joint.child].matrix, atol=1e-13)
            X = poses[joint.parent] @ Transform.of(xyz=p_rel[t, k], quat_xyzw=quat_rel[t, k])
            np.testing.assert_allclose(X.matrix, poses[joint.child].matrix, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(quat, axis=-1), 1.0, atol=1e-14)


def test_the_tool_is_placed_in_any_link_also_in_one_that_nothing_moves(robot: RobotModel, q: Array) -> None:
    X_LT, times = Transform.of(xyz=(0.1, -0.2, 0.3), rpy=(0.4, 0.5, 0.6)), np.stack([q, -q])
    for link in (robot.root, robot.links[-1].name):
        p, quat = tool_poses(dataclasses.replace(robot, tool=Tool(link, X_LT)), times)
        for t, at in enumerate(times):
            X_WT = chain_product(robot, at)[link] @ X_LT
            np.testing.assert_allclose(Transform.of(xyz=p[t], quat_xyzw=quat[t]).matrix, X_WT.matrix, atol=1e-13)


def test_the_jacobian_is_the_derivative_of_the_pose(robot: RobotModel, q: Array) -> None:
    kinematics = Kinematics(robot)
    link = robot.links[-1].name
    offset = Transform.of(xyz=(0.1, -0.2, 0.3), rpy=(0.3, 0.2, 0.1))
    R, p, J = kinematics.pose_and_jacobian(q, link, offset)
    X = kinematics.forward(q, link) @ offset
    np.testing.assert_allclose(R, X.R, atol=1e-14)
    np.testing.assert_allclose(p, X.p, atol=1e-14)
    np.testing.assert_array_equal(J, kinematics.jacobian(q, link, offset))
    h = 1e-6
    for k in range(len(q)):
        step = np.zeros(len(q))
        step[k] = h
        plus, minus = (kinematics.forward(q + sign * step, link) @ offset for sign in (1, -1))
        np.testing.assert_allclose(J[:3, k], (plus.p - minus.p) / (2 * h), atol=1e-8)  # h^2, and 1e-16 / h
        S = (plus.R - minus.R) / (2 * h) @ R.T  # skew matrix of the angular velocity
        np.testing.assert_allclose(J[3:, k], (S[2, 1], S[0, 2], S[1, 0]), atol=1e-8)


def test_the_jacobian_does_not_depend_on_what_was_asked_before(robot: RobotModel, q: Array) -> None:
    fresh, used = Kinematics(robot), Kinematics(robot)
    link = robot.links[-1].name
    used.jacobian(0.5 * q, link)
    used.gravity(0.3 * q)
    np.testing.assert_array_equal(used.jacobian(q, link), fresh.jacobian(q, link))
    np.testing.assert_array_equal(used.forward(q, link).matrix, fresh.forward(q, link).matrix)


def potential(robot: RobotModel, q: Array) -> float:
    """Sum of m g h [J] over the links."""
    poses = chain_product(robot, q)
    return sum(
        -link.inertial.mass * EARTH_GRAVITY[2] * float((poses[link.name] @ link.inertial.X_LI).p[2])
        for link in robot.links
        if link.inertial is not None
    )


def test_gravity_is_the_slope_of_the_potential(robot: RobotModel, q: Array) -> None:
    g = Kinematics(robot).gravity(q).copy()
    h = 1e-5
    slope = [(potential(robot, q + h * e) - potential(robot, q - h * e)) / (2 * h) for e in np.eye(len(q))]
    np.testing.assert_allclose(g, slope, atol=1e-7)


def test_inverse_dynamics_is_mass_times_acceleration_plus_the_rest(robot: RobotModel, q: Array) -> None:
    kinematics = Kinematics(robot)
    rng = np.random.default_rng(2)
    v, a = rng.normal(size=(2, len(q)))
    M = kinematics.mass_matrix(q)
    np.testing.assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(M)[0] > 0.0
    rest = kinematics.inverse_dynamics(q, v, np.zeros(len(q))).copy()
    np.testing.assert_allclose(kinematics.inverse_dynamics(q, v, a), M @ a + rest, atol=1e-10)
    still = np.zeros(len(q))
    np.testing.assert_allclose(kinematics.inverse_dynamics(q, still, still), kinematics.gravity(q), atol=1e-12)


class World:
    """The robot's engine text in PyBullet, read back."""

    def __init__(self, robot: RobotModel, folder: Path) -> None:
        import pybullet as p

        self.p = p
        self.client = p.connect(p.DIRECT)
        file = folder / "r.urdf"
        file.write_text(engine_urdf(robot, folder))
        self.body = p.loadURDF(
            str(file),
            list(robot.X_WB.p),
            list(robot.X_WB.quat_xyzw),
            useFixedBase=True,
            flags=p.URDF_USE_INERTIA_FROM_FILE | p.URDF_IGNORE_VISUAL_SHAPES,
            physicsClientId=self.client,
        )
        count = p.getNumJoints(self.body, physicsClientId=self.client)
        self.infos = [p.getJointInfo(self.body, k, physicsClientId=self.client) for k in range(count)]
        self.links = {info[12].decode(): k for k, info in enumerate(self.infos)}
        joints = {info[1].decode(): k for k, info in enumerate(self.infos)}
        self.joints = [joints[name] for name in robot.joint_names]
        moving = [info[1].decode() for info in self.infos if info[2] != p.JOINT_FIXED]
        self.order = [robot.joint_names.index(name) for name in moving]

    def place(self, q: Array) -> None:
        for k, value in zip(self.joints, q, strict=True):
            self.p.resetJointState(self.body, k, float(value), physicsClientId=self.client)


@pytest.fixture
def world(robot: RobotModel, tmp_path: Path) -> Iterator[World]:
    world = World(robot, tmp_path)
    yield world
    world.p.disconnect(world.client)


def test_masses_inertias_limits_and_shapes_read_back_from_the_engine(robot: RobotModel, world: World) -> None:
    for link in robot.links[1:]:  # a fixed base has no mass in Bullet
        info = world.p.getDynamicsInfo(world.body, world.links[link.name], physicsClientId=world.client)
        mass = link.inertial.mass if link.inertial is not None else 0.0
        principal = np.linalg.eigvalsh(link.inertial.inertia) if link.inertial is not None else np.zeros(3)
        assert info[0] == mass
        np.testing.assert_allclose(sorted(info[2]), principal, rtol=3e-6)  # the triangle inequality's nudge
    for k, joint in zip(world.joints, robot.moving_joints, strict=True):
        limits = joint.limits
        if limits.lower is not None:
            assert world.infos[k][8:10] == (limits.lower, limits.upper)
        assert world.infos[k][10:12] == (limits.effort, limits.velocity)


def test_the_engine_puts_links_where_we_do(robot: RobotModel, world: World, q: Array) -> None:
    world.place(q)
    kinematics = Kinematics(robot)
    for link, k in world.links.items():
        state = world.p.getLinkState(world.body, k, computeForwardKinematics=1, physicsClientId=world.client)
        X = kinematics.forward(q, link)
        np.testing.assert_allclose(state[4], X.p, atol=1e-6)  # PyBullet hands out poses of single precision
        assert abs(np.dot(state[5], X.quat_xyzw)) == pytest.approx(1.0, abs=1e-6)


def test_the_engine_s_inverse_dynamics_agree(robot: RobotModel, world: World, q: Array) -> None:
    rng = np.random.default_rng(3)
    v, a = rng.normal(size=(2, len(q)))
    world.p.setGravity(*EARTH_GRAVITY, physicsClientId=world.client)
    order = world.order
    tau = world.p.calculateInverseDynamics(
        world.body, list(q[order]), list(v[order]), list(a[order]), physicsClientId=world.client
    )
    own = Kinematics(robot).inverse_dynamics(q, v, a)[order]
    # PyBullet leaves damping of the file out here too; the mount turns gravity, which it takes in the base frame.
    if robot.X_WB.p.any():
        g = robot.X_WB.R @ np.array(EARTH_GRAVITY)
        own = Kinematics(robot, gravity=g).inverse_dynamics(q, v, a)[order]
    np.testing.assert_allclose(tau, own, atol=1e-10)


def test_the_engine_s_free_motion_agrees(robot: RobotModel, world: World, q: Array) -> None:
    p, body, client = world.p, world.body, world.client
    p.setGravity(*EARTH_GRAVITY, physicsClientId=client)
    for k in range(-1, len(world.infos)):
        p.changeDynamics(body, k, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client)
    for k in world.joints:
        p.setJointMotorControl2(body, k, p.VELOCITY_CONTROL, force=0, physicsClientId=client)
    world.place(q)
    h = 1e-5
    p.setTimeStep(h, physicsClientId=client)
    p.stepSimulation(physicsClientId=client)
    measured = [p.getJointState(body, k, physicsClientId=client)[1] / h for k in world.joints]
    kinematics = Kinematics(robot)
    expected = np.linalg.solve(kinematics.mass_matrix(q), -kinematics.gravity(q))
    np.testing.assert_allclose(measured, expected, rtol=1e-6, atol=1e-6)
