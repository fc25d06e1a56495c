"""Bounds on the timing of a path: against closed forms on a carriage, and against TOPP-RA and Pinocchio on arms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from benchmarks.timing import TASKS, Arm, measure
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.collision import Carried
from manipcli.model.robot import RobotModel, Tool
from manipcli.plan.motion import PlanningState
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.retimer import retime
from manipcli.plan.timing_bound import TimingBound
from manipcli.plan.timing_bounds.slosh import SloshBound
from manipcli.plan.timing_bounds.tool_motion import ToolAcceleration, ToolSpeed
from manipcli.plan.timing_bounds.torque import TorqueBound
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import backwards, stretched
from manipcli.scene.scene import Scene
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

PERIOD = 1e-3
MASS, EFFORT, FRICTION = 4.0, 10.0, 3.0
GRAVITY = np.array([0.0, 0.0, -9.81])
D = 0.8


def one_joint(kind: Literal["revolute", "prismatic"], *, friction: float = 0.0, damping: float = 0.0) -> RobotModel:
    """A carriage along x, or an arm of 0.5 m about the vertical, with a mass of 4 kg at its origin."""
    inertia = Inertial(mass=MASS, X_LI=Transform.identity(), inertia=frozen(0.1 * np.eye(3)))
    links = [Link("base", None, (), ()), Link("cart", inertia, (), ())]
    joint = Joint(
        name="slide", type=kind, parent="base", child="cart", X_PJ=Transform.identity(),
        axis=frozen((1, 0, 0) if kind == "prismatic" else (0, 0, 1)),
        limits=JointLimits(-5.0, 5.0, 50.0, EFFORT, 500.0, None), friction=friction, damping=damping,
    )  # fmt: skip
    return RobotModel(
        name="cart", root="base", links=tuple(links), joints=(joint,), groups=(), poses=(), transmissions=(),
        X_WB=Transform.identity(), urdf="", tool=Tool("cart", Transform.of(xyz=(0.5, 0.0, 0.0))),
    )  # fmt: skip


def setup(robot: RobotModel) -> tuple[PathDynamics, MotionLimits]:
    planner = Planner(
        robot, Scene((), (), GRAVITY), period=PERIOD, rng=np.random.default_rng(0), gripper_joints=(), gripper_speed=1.0
    )
    state = PlanningState(np.zeros(1), ())
    return PathDynamics(planner, state, ("slide",)), MotionLimits.of(robot, ("slide",))


def moved(limits: MotionLimits, bound: TimingBound, *, waypoints: int = 2) -> JointTrajectory:
    points = np.linspace(0.0, D, waypoints)[:, None]
    return retime(points, limits, period=PERIOD, bounds=[bound])


def test_dry_friction_helps_to_brake() -> None:
    """Bang-bang with a1 = (F - f) / m and a2 = (F + f) / m: T^2 = 2 d (a1 + a2) / (a1 a2)."""
    robot = one_joint("prismatic", friction=FRICTION)
    dynamics, limits = setup(robot)
    motion = moved(limits, TorqueBound(robot, dynamics, ("slide",), np.zeros((2, 1))))
    a1, a2 = (EFFORT - FRICTION) / MASS, (EFFORT + FRICTION) / MASS
    assert motion.duration == pytest.approx(np.sqrt(2.0 * D * (a1 + a2) / (a1 * a2)), rel=0.005)


def test_backwards_friction_acts_the_other_way() -> None:
    """What used all the effort forwards needs more backwards, and is slowed down."""
    robot = one_joint("prismatic", friction=FRICTION)
    dynamics, limits = setup(robot)
    bound = TorqueBound(robot, dynamics, ("slide",), np.zeros((2, 1)))
    back = backwards(moved(limits, bound))
    slower = stretched(back, [bound], PERIOD)

    def most(motion: JointTrajectory) -> float:
        assert motion.velocities is not None and motion.accelerations is not None
        return float(bound.values(motion.positions, motion.velocities, motion.accelerations).max())

    assert most(back) > 1.5
    assert 0.99 < most(slower) <= 1.005
    np.testing.assert_allclose(slower.positions[[0, -1]], back.positions[[0, -1]], atol=1e-9)


def test_viscous_friction_is_overcome_and_costs_little_more_than_it_must() -> None:
    """The oracle integrates m v' = +-F - b v with the best moment to brake."""
    b = 4.0
    robot = one_joint("prismatic", damping=b)
    dynamics, limits = setup(robot)
    motion = moved(limits, TorqueBound(robot, dynamics, ("slide",), np.zeros((2, 1))))
    assert motion.velocities is not None and motion.accelerations is not None
    needed = MASS * motion.accelerations[:, 0] + b * motion.velocities[:, 0]
    assert np.max(np.abs(needed)) <= 1.005 * EFFORT

    def stops(push: float) -> tuple[float, float]:
        """The distance after pushing for this time, and braking to rest; and the whole time."""
        v = EFFORT / b * (1.0 - np.exp(-b / MASS * push))
        x = EFFORT / b * push - MASS / b * v
        brake = MASS / b * np.log(1.0 + b * v / EFFORT)
        return float(x + MASS / b * v - EFFORT / b * brake), float(push + brake)

    low, high = 0.0, 10.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stops(middle)[0] < D else (low, middle)
    assert stops(low)[1] <= motion.duration <= 1.05 * stops(low)[1]


def test_apparent_gravity_stays_in_its_cone() -> None:
    """An upright cup on a carriage: |a| <= g tan(angle), bang-bang, T = 2 sqrt(d / a)."""
    angle = np.radians(10.0)
    dynamics, limits = setup(one_joint("prismatic"))
    motion = moved(limits, SloshBound(dynamics, "cart", Transform.identity(), GRAVITY, angle))
    best = 2.0 * np.sqrt(D / (9.81 * np.tan(angle)))
    assert best <= motion.duration <= 1.01 * best
    assert motion.accelerations is not None
    assert np.max(np.abs(motion.accelerations)) <= 9.81 * np.tan(1.005 * angle)


def test_a_cup_that_is_tilted_too_much_has_no_timing() -> None:
    dynamics, limits = setup(one_joint("prismatic"))
    bound = SloshBound(dynamics, "cart", Transform.of(rpy=(0.4, 0.0, 0.0)), GRAVITY, 0.2)
    with pytest.raises(NotPlannable, match=r"22.9 deg from the cup's axis, beyond `slosh: 11.4.* deg` even at rest"):
        moved(limits, bound)


def test_the_tool_keeps_its_speed() -> None:
    """An arm of 0.5 m at 0.2 m/s: 0.4 rad/s, and hardly any time to accelerate."""
    dynamics, limits = setup(one_joint("revolute"))
    motion = moved(limits, ToolSpeed(dynamics, "cart", Transform.of(xyz=(0.5, 0.0, 0.0)), 0.2), waypoints=12)
    assert motion.duration == pytest.approx(D / 0.4, rel=0.005)
    tip = 0.5 * np.column_stack((np.cos(motion.positions), np.sin(motion.positions)))
    assert np.linalg.norm(np.diff(tip, axis=0), axis=1).max() / PERIOD <= 0.2 * 1.0025


def test_the_tool_keeps_its_acceleration_along_and_across() -> None:
    """Difference quotients of the tip; across its path it accelerates with v^2 / r."""
    dynamics, limits = setup(one_joint("revolute"))
    motion = moved(limits, ToolAcceleration(dynamics, "cart", Transform.of(xyz=(0.5, 0.0, 0.0)), 0.5), waypoints=12)
    tip = 0.5 * np.column_stack((np.cos(motion.positions), np.sin(motion.positions)))
    acceleration = np.linalg.norm(np.diff(tip, 2, axis=0), axis=1) / PERIOD**2
    assert acceleration.max() <= 0.5 * 1.005
    assert np.median(acceleration) > 0.97 * 0.5  # time-optimal: nearly always at the bound


def test_loads_in_the_hand_count() -> None:
    """Holding them at rest takes J^T m g more in every joint, with the point Jacobian of the mass."""
    task = load_task(Path(__file__).parents[2] / "tasks/pour.yaml")
    planner = Planner(
        task.robot, task.scene, period=PERIOD, rng=np.random.default_rng(0), gripper_joints=(), gripper_speed=1.0
    )
    empty = PlanningState(start_position(task), tuple(body.X_WO for body in task.scene.movable))
    names, link = planner.solver.joints, planner.tool_link
    X_LO = planner.kinematics.forward(empty.position, link).inverse() @ planner.body_pose(empty, "cup")
    full = replace(empty, carried=Carried(body="cup", link=link, X_LO=X_LO))
    q, zero = empty.position[planner.robot.indices(names)][None], np.zeros((1, len(names)))
    more = PathDynamics(planner, full, names).torques(q, zero, zero) - PathDynamics(planner, empty, names).torques(
        q, zero, zero
    )
    expected: Array = np.zeros(len(names))
    for name in ("cup", "ball"):
        body = task.scene.body(name)
        X_LI = planner.kinematics.forward(empty.position, link).inverse() @ planner.body_pose(empty, name) @ body.X_OI
        J = planner.kinematics.jacobian(empty.position, link, X_LI)[:3, planner.robot.indices(names)]
        expected += -body.mass * J.T @ task.scene.gravity
    np.testing.assert_allclose(more[0], expected, atol=1e-9)


@pytest.mark.parametrize("task", TASKS)
def test_random_paths_keep_every_limit_and_take_the_least_time(task: str) -> None:
    found = measure(Arm(task), np.random.default_rng(11))
    assert found.binds
    assert max(found.velocity, found.acceleration, found.torque) <= 1.005
    assert found.duration <= 1.01 * found.optimal


def test_a_joint_that_cannot_be_held_is_left_to_the_checks() -> None:
    """With gravity along its axis the carriage weighs 39 N; 10 N cannot hold it, at any speed."""
    robot = one_joint("prismatic")
    planner = Planner(
        robot, Scene((), (), np.array([9.81, 0.0, 0.0])), period=PERIOD, rng=np.random.default_rng(0),
        gripper_joints=(), gripper_speed=1.0,
    )  # fmt: skip
    dynamics = PathDynamics(planner, PlanningState(np.zeros(1), ()), ("slide",))
    assert not TorqueBound(robot, dynamics, ("slide",), np.zeros((2, 1))).applies


def test_a_motion_that_keeps_the_bounds_is_the_one_without() -> None:
    dynamics, limits = setup(one_joint("prismatic"))
    points = np.linspace(0.0, D, 5)[:, None]
    free = retime(points, limits, period=PERIOD)
    loose = retime(points, limits, period=PERIOD, bounds=[ToolSpeed(dynamics, "cart", Transform.identity(), 1e3)])
    np.testing.assert_array_equal(loose.positions, free.positions)
