"""How fast, and how hard: the inertia and the leverage of an arm at its tool, by energy, work and inverse dynamics."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.model.motor_limits import EffortLimits
from manipcli.plan.arm_force import refuse_too_strong, strongest
from manipcli.plan.contact_line import (
    approach_speed,
    effective_mass,
    gap,
    hover,
)
from manipcli.plan.motion import PlanningState
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

TASK = Path(__file__).parents[2] / "tasks" / "press.yaml"
DOWN = np.array([0.0, 0.0, -1.0])


@cache
def scene():
    task = load_task(TASK)
    planner = Planner(
        task.robot, task.scene, period=1e-3, rng=np.random.default_rng(3),
        gripper_joints=("panda_finger_joint1",), gripper_speed=0.05,
    )  # fmt: skip
    q = np.array(start_position(task))
    q[list(task.robot.indices(("panda_finger_joint1", "panda_finger_joint2")))] = 0.0
    return planner, PlanningState(q, tuple(body.X_WO for body in task.scene.movable))


def height(planner, q, joint, step):
    moved = np.array(q)
    moved[joint] += step
    return planner.solver.forward(moved).p @ DOWN


def leverage(planner, q):
    """d(tool along the axis) / dq by central differences."""
    return np.array([
        (height(planner, q, k, 1e-6) - height(planner, q, k, -1e-6)) / 2e-6 for k in planner.solver.columns
    ])  # fmt: skip


def test_the_effective_mass_is_that_of_the_energy_of_an_impulse():
    """An impulse P at the tool gives v_q = M^-1 J^T P; its energy is P^2 / 2 m."""
    planner, state = scene()
    k = list(planner.solver.columns)
    mass = planner.kinematics.mass_matrix(state.position)[np.ix_(k, k)]
    rates = np.linalg.solve(mass, leverage(planner, state.position) * 3.0)
    energy = 0.5 * rates @ mass @ rates
    np.testing.assert_allclose(effective_mass(planner, state.position, DOWN), 9.0 / (2.0 * energy), rtol=1e-6)


def test_the_strongest_force_brings_one_joint_to_its_limit_and_no_other_beyond():
    """By virtual work: the effort at rest is g + F dz/dq."""
    planner, state = scene()
    most = strongest(planner, state.position, np.append(DOWN, np.zeros(3)))
    k = list(planner.solver.columns)
    limits = EffortLimits.of(planner.robot).least[k]
    effort = np.array(planner.kinematics.gravity(state.position))[k] + most.share * leverage(planner, state.position)
    share = np.abs(effort) / limits
    np.testing.assert_allclose(share.max(), 1.0, rtol=1e-6)
    assert planner.solver.joints[int(np.argmax(share))] == most.joint
    refuse_too_strong(planner, state.position, DOWN, 0.99 * most.share)
    with pytest.raises(NotPlannable, match=rf"'{most.joint}' reaches its limit of {most.effort:g} N m"):
        refuse_too_strong(planner, state.position, DOWN, 1.01 * most.share)


def test_an_impact_of_one_period_has_the_force():
    np.testing.assert_allclose(5.0 * approach_speed(10.0, 5.0, 1e-3) / 1e-3, 10.0)


def test_the_tool_stops_at_the_gap_with_its_axis_along_the_force():
    planner, state = scene()
    builder = MotionBuilder(planner, state, verb="press")
    point = planner.frame("button/top", state).p
    X_WH = hover(builder, planner, "button", point, DOWN, speed=0.5)
    np.testing.assert_allclose(X_WH.R[:, 2], DOWN, atol=2e-3)
    np.testing.assert_allclose(X_WH.p[:2], point[:2], atol=2e-4)
    np.testing.assert_allclose(gap(planner, builder.now, "button"), 0.005, atol=3e-4)


def test_a_point_out_of_reach_is_refused_with_what_the_step_has():
    planner, state = scene()
    builder = MotionBuilder(planner, state, verb="press")
    with pytest.raises(NotPlannable) as caught:
        hover(builder, planner, "button", np.array([1.1, 0.0, 0.3]), DOWN, speed=0.5)
    assert caught.value.hint == "move 'button' nearer, or press in another `direction`"
