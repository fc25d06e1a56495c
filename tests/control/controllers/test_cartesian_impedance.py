"""The tool is a mass on a spring: statics, energy and singularities, on a robot moved by its equations of motion."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.cartesian_impedance import CartesianImpedanceSpec, check
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.impedance_controller import CartesianImpedanceController
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Transform, matrix_from_axis_angle
from manipcli.model.build_robot import build_robot
from manipcli.model.kinematics import Kinematics
from manipcli.plan.pose_error import rotation_vector
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.impedance import PostureSpec, TaskSpaceSpec
from manipcli.spec.load import load_robot

ROBOT = Path(__file__).parents[3] / "robots" / "arm7_hand3" / "robot.yaml"
JOINTS = tuple(f"joint_{k}" for k in range(1, 8))
BENT = np.array([0.2, 0.6, -0.3, -1.3, 0.4, 0.7, -0.2])
STIFFNESS = np.array([900.0, 500.0, 700.0, 40.0, 30.0, 50.0])


@cache
def robot():
    file = load_robot(ROBOT)
    return build_robot(file.spec, file=ROBOT, source=file.source)[0]


@cache
def kinematics():
    return Kinematics(robot())


def make(**more):
    settings = {"stiffness": STIFFNESS, "link": robot().tool.link, "offset": robot().tool.X_LT}
    return CartesianImpedanceController(name="arm", joints=JOINTS, kinematics=kinematics(), **(settings | more))


class Arm:
    """M a + C v + g = u + g + J^T F: gravity is what the manager adds to the command; the hand's joints stay."""

    def __init__(self, q, period):
        self.model = Kinematics(robot())
        self.columns = robot().indices(JOINTS)
        self.q, self.v = np.zeros((2, len(robot().joint_names)))
        self.q[self.columns] = q
        self.period, self.time = period, 0.0

    @property
    def state(self):
        return JointState(self.q[self.columns].copy(), self.v[self.columns].copy(), np.zeros(7))

    def tool(self):
        return self.model.pose_and_jacobian(self.q, robot().tool.link, robot().tool.X_LT)

    def step(self, controller, wrench=None):
        command = np.array(controller.update(self.time, self.period, self.state).command)
        assert np.isfinite(command).all()
        rest = np.zeros(len(self.q))
        bias = self.model.inverse_dynamics(self.q, self.v, rest) - self.model.gravity(self.q)
        effort = command - bias[self.columns]
        if wrench is not None:
            effort += self.tool()[2][:, self.columns].T @ wrench
        mass = self.model.mass_matrix(self.q)[np.ix_(self.columns, self.columns)]
        self.v[self.columns] += self.period * np.linalg.solve(mass, effort)
        self.q += self.period * self.v
        self.time += self.period

    def kinetic_energy(self):
        return 0.5 * self.v @ self.model.mass_matrix(self.q) @ self.v


def off(before, now):
    """(6) how far the tool has moved and turned, in world axes."""
    return np.concatenate([now[1] - before[1], rotation_vector(now[0] @ before[0].T)])


@pytest.mark.slow
@pytest.mark.parametrize("wrench", [(8.0, 0, 0, 0, 0, 0), (0, -6.0, 4.0, 0, 0, 0), (0, 0, 0, 0.4, -0.3, 0.5)])
def test_a_force_displaces_the_tool_by_its_share_of_the_stiffness(wrench):
    """At rest J^T (F + K e) + N (...) = 0, and N is orthogonal to J^T: e = -K^-1 F, whatever the posture wants."""
    arm, controller = Arm(BENT, 2e-3), make(posture_stiffness=40.0)
    before = arm.tool()
    for _ in range(1600):
        arm.step(controller, np.array(wrench))
    moved = off(before, arm.tool())
    # After 3.2 s the posture still creeps, which moves the tool by a percent of what the force does.
    np.testing.assert_allclose(moved, np.array(wrench) / STIFFNESS, atol=2e-4)
    np.testing.assert_allclose(controller.error, -moved, atol=1e-6)


@pytest.mark.slow
def test_axes_of_the_tool_turn_with_it():
    arm, controller = Arm(BENT, 2e-3), make(axes="tool", posture_stiffness=40.0)
    before = arm.tool()
    force = before[0] @ np.array([9.0, 0.0, 0.0])  # along the tool's own x
    for _ in range(1200):
        arm.step(controller, np.concatenate([force, np.zeros(3)]))
    moved = before[0].T @ (arm.tool()[1] - before[1])
    np.testing.assert_allclose(moved, [9.0 / 900.0, 0.0, 0.0], atol=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("posture", [0.0, 10.0])
@pytest.mark.parametrize("damping", [None, (60.0, 60.0, 60.0, 2.0, 2.0, 2.0)])
def test_energy_does_not_grow(posture, damping):
    """Kinetic energy and that of the spring, which is isotropic and so has one, from a start 6 cm and 0.3 rad off."""
    stiff = np.array([600.0] * 3 + [30.0] * 3)
    controller = make(stiffness=stiff, damping=damping, posture_stiffness=posture)
    arm = Arm(BENT, 5e-4)
    R, p, _ = arm.tool()
    turn = matrix_from_axis_angle(np.array([0.6, 0.0, 0.8]), 0.3)
    controller.set_pose(Transform(R=turn @ R, p=p + np.array([0.05, -0.02, 0.03])))
    energies = []
    for _ in range(1200):
        moving = arm.kinetic_energy()
        arm.step(controller)
        energies.append(moving + 0.5 * stiff @ controller.error**2)
    # Through N the posture's spring has no energy of its own; what work it does, damping takes more.
    assert np.diff(energies).max() <= 0.0
    assert energies[-1] < 0.25 * energies[0]


@pytest.mark.slow
@pytest.mark.parametrize("q", [np.zeros(7), np.array([0.3, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0])])
def test_a_stretched_arm_stays_finite_and_comes_to_rest(q):
    """Straight up the Jacobian has lost a direction; the pose asked for lies out of reach along it."""
    arm, controller = Arm(q, 1e-3), make()
    J = arm.tool()[2][:, arm.columns]
    assert np.linalg.svd(J, compute_uv=False)[-1] < 1e-6
    R, p, _ = arm.tool()
    controller.set_pose(Transform(R=R, p=p + np.array([0.0, 0.0, 0.05])))
    largest = 0.0
    for _ in range(2000):
        arm.step(controller)
        largest = max(largest, float(np.abs(controller.output.command).max()))
    assert largest < 200.0
    assert arm.kinetic_energy() < 1e-3  # of 1 J that the spring held


def test_a_turn_by_half_a_circle_is_finite():
    arm, controller = Arm(BENT, 1e-3), make()
    R, p, _ = arm.tool()
    controller.set_pose(Transform(R=matrix_from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi) @ R, p=p))
    controller.update(0.0, 1e-3, arm.state)
    assert np.linalg.norm(controller.error[3:]) == pytest.approx(np.pi, abs=1e-6)
    assert np.isfinite(controller.output.command).all()


def line(goal):
    return JointTrajectory(JOINTS, [TrajectoryPoint(tuple(BENT), 0.0), TrajectoryPoint(tuple(goal), 1.0)])


def test_a_trajectory_of_joints_leads_the_tool_to_its_end():
    """Its reference pose is where the joints' reference would put the tool."""
    arm, controller = Arm(BENT, 2e-3), make()
    goal = BENT + np.array([0.1, 0.1, -0.1, 0.1, 0.05, -0.1, 0.1])
    handle = controller.send_goal(line(goal))
    for _ in range(1250):
        arm.step(controller)
    assert handle.status == "succeeded"
    np.testing.assert_allclose(arm.q[arm.columns], goal, atol=5e-3)  # the posture resolves what the tool leaves open
    moved = Arm(goal, 1e-3).tool()
    np.testing.assert_allclose(off(moved, arm.tool()), 0.0, atol=1e-3)


def test_a_pose_preempts_a_trajectory_and_a_trajectory_a_pose():
    arm, controller = Arm(BENT, 1e-3), make()
    first = controller.send_goal(line(BENT + 0.1))
    for _ in range(300):
        arm.step(controller)
    R, p, _ = arm.tool()
    controller.set_pose(Transform(R=R, p=p))
    assert (first.status, first.result.text) == ("aborted", "preempted by a pose")
    held = arm.q[arm.columns].copy()
    arm.step(controller)
    np.testing.assert_allclose(controller.output.position, held)
    second = controller.send_goal(line(BENT))
    for _ in range(1500):
        arm.step(controller)
    assert second.status == "succeeded"


def test_a_pose_is_forgotten_when_the_controller_is_deactivated():
    """Displaced meanwhile, it holds where it is then; the pose before would pull with 90 N and more."""
    arm, controller = Arm(BENT, 1e-3), make()
    R, p, _ = arm.tool()
    controller.set_pose(Transform(R=R, p=p))
    arm.step(controller)
    controller.deactivate(arm.time)
    moved = BENT + 0.2
    arm.q[arm.columns] = moved
    output = controller.update(arm.time, 1e-3, arm.state)
    np.testing.assert_allclose(output.command, 0.0, atol=1e-9)
    np.testing.assert_allclose(output.position, moved)
    # Neither the pose nor the posture that was held with it, which a new pose would hold again.
    R, p, _ = arm.tool()
    controller.set_pose(Transform(R=R, p=p))
    np.testing.assert_allclose(controller.update(arm.time, 1e-3, arm.state).command, 0.0, atol=1e-9)


def test_a_goal_that_a_pose_preempts_ends_at_the_time_of_the_pose():
    arm, controller = Arm(BENT, 1e-3), make()
    handle = controller.send_goal(line(BENT + 0.1))
    for _ in range(8):
        arm.step(controller)
    controller.set_pose(Transform.identity())
    assert handle.result.time == pytest.approx(0.007)


def test_at_the_end_it_holds_as_the_joint_trajectory_controller_would():
    """References are the same, tick by tick."""
    arm, controller = Arm(BENT, 1e-3), make()
    same = JointTrajectoryController(name="arm", joints=JOINTS, command_interfaces=("position",))
    for follower in (controller, same):
        follower.send_goal(line(BENT + 0.05))
    for _ in range(50):
        wanted = same.update(arm.time, 1e-3, arm.state).rows[:3].copy()
        arm.step(controller)
        np.testing.assert_array_equal(controller.output.rows[:3], wanted)


@pytest.mark.parametrize(
    "wrong",
    [
        {"stiffness": np.ones(3)},
        {"stiffness": -np.ones(6)},
        {"damping": [np.nan] * 6},
        {"damping_ratio": -1.0},
        {"stiffness": np.zeros(6), "posture_stiffness": 0.0},
    ],
)
def test_what_would_not_work_is_refused(wrong):
    with pytest.raises(InvalidArgument, match="arm"):
        make(**wrong)


def spec(**more):
    settings = {"type": "cartesian_impedance", "joints": JOINTS, "stiffness": {"translation": 500, "rotation": 20}}
    return CartesianImpedanceSpec.model_validate(settings | more)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({}, []),
        ({"joints": JOINTS[:6]}, ["joint_7 moves link 'tool', too"]),
        ({"joints": (*JOINTS, "finger_1_distal")}, ["joint 'finger_1_distal' does not move link 'tool'"]),
        ({"link": "plam"}, ["link 'plam' is not in robot 'arm7_hand3'"]),
        (
            {"constraints": {"joints": {"elbow": {"goal": 0.1}}}},
            ["'elbow' has tolerances, but is not a joint of the controller"],
        ),
        (
            {"stiffness": TaskSpaceSpec(translation=0, rotation=0), "posture": PostureSpec(stiffness=0)},
            ["all stiffnesses are 0; it would not move"],
        ),
    ],
)
def test_what_does_not_fit_the_robot_is_told(more, told):
    assert [problem.message for problem in check(spec(**more), robot())] == told
