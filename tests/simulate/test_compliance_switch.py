"""Controllers change without a step: trajectories begin where the arm is, and end as planned."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from manipcli.control.compliant_arm import complies, replaced
from manipcli.core.errors import NotPlannable
from manipcli.live.interfaces.controller_manager import list_controllers
from manipcli.plan.compliance import Beyond, Compliance, Pressing, compliant
from manipcli.plan.motion import Motion
from manipcli.plan.trajectory import JointTrajectory
from manipcli.run.execute import build_manager
from manipcli.simulate.compliance_switch import TOO_LONG, ComplianceSwitch
from manipcli.task.load_task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "press.yaml"
PERIOD = 1e-3
ARM = tuple(f"panda_joint{k}" for k in range(1, 8))


@cache
def task():
    return load_task(TASK)


@pytest.fixture
def session():
    q = np.zeros(len(task().robot.joint_names))
    q[3] = -1.5
    return SimpleNamespace(
        manager=build_manager(task()), robot=task().robot, engine=SimpleNamespace(ideal=False), period=PERIOD, time=0.0,
        state=SimpleNamespace(position=q, velocity=np.zeros_like(q), effort=np.zeros_like(q)),
    )  # fmt: skip


def planned(start, **more):
    """A motion of all joints by minimum jerk, 1 s long, from `start` (7)."""
    u = np.linspace(0.0, 1.0, 1001)[:, None]
    goal = np.full(7, 0.1)
    curves = u**3 * (10 - 15 * u + 6 * u**2), 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u)
    q, v, a = (goal * curve for curve in curves)
    return Motion("move", JointTrajectory.of_arrays(ARM, u[:, 0], q + start, v, a), None, 1.0, **more)


def active(session):
    return [own.name for own in session.manager.controllers if session.manager.is_active(own.name)]


def test_the_arm_is_switched_for_a_compliant_motion_and_back_for_the_next(session):
    switch, start = ComplianceSwitch(session), session.state.position[list(session.robot.indices(ARM))]
    before = active(session)
    assert "felt_force" in before
    switch.before(planned(start, compliance=Compliance.of()))
    assert "arm_controller_compliant" in active(session)
    assert "arm_controller" not in active(session)
    switch.before(Motion("wait", None, None, 1.0))  # the arm does not move: it stays compliant
    assert "arm_controller_compliant" in active(session)
    switch.before(planned(start))
    assert active(session) == before


def test_another_executor_of_the_session_also_switches_back(session):
    """A step of a client after one of the task; what it may plan with is what returns."""
    start, before = session.state.position[list(session.robot.indices(ARM))], active(session)
    ComplianceSwitch(session).before(planned(start, compliance=Compliance.of()))
    assert replaced(session.manager.controllers) == ("arm_controller",)
    ComplianceSwitch(session).before(planned(start))
    assert active(session) == before
    assert replaced(session.manager.controllers) == ()


def test_the_controllers_of_compliant_steps_are_listed_to_clients(session):
    robot = SimpleNamespace(manager=session.manager, task=task())
    listed = list_controllers(robot, None, {})["controller"]
    types = {one["name"]: one["type"] for one in listed}
    assert types["felt_force"] == "manipcli/felt_force"
    assert types["arm_controller_compliant"] == "manipcli/compliant_arm"


def test_a_motion_ends_when_more_is_felt_than_it_may_press_with(session):
    """For longer than an impact lasts: it has then failed for the reason that it gives."""
    switch, (arm,) = ComplianceSwitch(session), [own for own in session.manager.controllers if complies(own)]
    until = Beyond(np.array([0.0, 0.0, 1.0]), 100.0, most=20.0, otherwise="it is stuck")
    motion = Motion("push", None, None, 1.0, compliance=replace(Compliance.of(), until=until))
    switch.before(motion)
    session.manager.update(0.0, session.state)
    arm.felt[:3] = 0.0, 12.0, 15.0
    assert not switch.passed(motion)
    impact = round(TOO_LONG / session.period) - 1
    for force in (*[17.0] * impact, 15.0, *[17.0] * impact):  # 20.8 N, then 19.2 N
        arm.felt[2] = force
        assert not switch.passed(motion)
    ended = [switch.passed(motion) for _ in range(3)]
    assert ended[-1]
    assert switch.result(motion) == ("", "it is stuck")


def test_a_stop_gives_up_the_force(session):
    """A canceled press does not go on to look for its contact, and its reference returns without a step."""
    switch, (arm,) = ComplianceSwitch(session), [own for own in session.manager.controllers if complies(own)]
    force = Pressing(np.array([0.0, 0.0, 1.0]), 10.0, speed=0.05, reach=0.1)
    switch.before(Motion("press", None, None, 1.0, compliance=Compliance.of(force=force)))

    def shifts(ticks):
        for k in range(ticks):
            session.manager.update(k * PERIOD, session.state)
            yield arm.pressing.shift if arm.pressing is not None else arm._shift[2]

    before = list(shifts(400))[-1]
    assert before > 0.01
    switch.relax()
    after = [before, *shifts(400)]
    assert arm.pressing is None
    assert after[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(np.diff(after)).max() < 2.0 * before / 0.3 * PERIOD  # 1.875 is that of a minimum jerk


def test_a_refused_plan_leaves_its_builder_as_it_was():
    builder = SimpleNamespace(compliance=None)
    with pytest.raises(NotPlannable), compliant(builder, Compliance.of()):
        raise NotPlannable("out of reach")
    assert builder.compliance is None


def test_a_trajectory_begins_where_the_arm_is_and_joins_its_plan(session):
    """Also its derivatives are those of its positions, by central differences."""
    switch, k = ComplianceSwitch(session), list(session.robot.indices(ARM))
    off = np.linspace(-0.02, 0.02, 7)
    motion = planned(session.state.position[k] - off, compliance=Compliance.of())
    joined = switch.before(motion)
    np.testing.assert_allclose(joined.positions[0], session.state.position[k], atol=1e-12)
    np.testing.assert_allclose(joined.velocities[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(joined.positions[500:], motion.trajectory.positions[500:], atol=1e-12)
    rates = (joined.positions[2:] - joined.positions[:-2]) / (2 * PERIOD)
    np.testing.assert_allclose(joined.velocities[1:-1], rates, atol=1e-5)
    curvature = np.diff(joined.positions, 2, axis=0) / PERIOD**2
    # Where it joins, the jerk of 5 rad/s^3 begins within a tick.
    np.testing.assert_allclose(joined.accelerations[1:-1], curvature, atol=3e-3)


def test_a_compliant_motion_goes_on_from_the_reference_of_the_one_before(session):
    switch, k = ComplianceSwitch(session), list(session.robot.indices(ARM))
    start = session.state.position[k].copy()
    switch.before(planned(start, compliance=Compliance.of()))
    (arm,) = [own for own in session.manager.controllers if complies(own)]
    session.manager.update(0.0, session.state)
    session.state.position = session.state.position + 0.01  # a contact has displaced the arm
    joined = switch.before(planned(start, compliance=Compliance.of(along=100.0)))
    np.testing.assert_allclose(joined.positions[0], arm.output.position, atol=1e-12)
    np.testing.assert_allclose(joined.positions[0], start, atol=1e-12)
