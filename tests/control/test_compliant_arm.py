"""What the arm feels, and how it yields: against known wrenches on an arm that is moved by its equations of motion."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.compliant_arm import CONTACT, MASS, AdmittanceArm, ImpedanceArm
from manipcli.control.controller import BuildContext, JointState
from manipcli.control.felt_force import FeltForce
from manipcli.core.geometry import Transform, frozen
from manipcli.model.build_robot import build_robot
from manipcli.model.kinematics import Kinematics
from manipcli.plan.compliance import Compliance, Pressing
from manipcli.spec.load import load_robot

ROBOT = Path(__file__).parents[2] / "robots" / "arm7_hand3" / "robot.yaml"
JOINTS = tuple(f"joint_{k}" for k in range(1, 8))
BENT = np.array([0.2, 0.6, -0.3, -1.3, 0.4, 0.7, -0.2])
PERIOD = 1e-3


@cache
def robot():
    file = load_robot(ROBOT)
    return build_robot(file.spec, file=ROBOT, source=file.source)[0]


@cache
def model():
    return Kinematics(robot())


def columns():
    return robot().indices(JOINTS)


def full(values):
    q = np.zeros(len(robot().joint_names))
    q[columns()] = values
    return q


def tool(q):
    return model().pose_and_jacobian(full(q), robot().tool.link, robot().tool.X_LT)


def make_felt(**more):
    return FeltForce(
        name="felt_force", kinematics=model(), arm=JOINTS, link=robot().tool.link, offset=robot().tool.X_LT, **more
    )


def make(law, felt):
    context = BuildContext(robot(), model, None)
    return law("arm", JOINTS, felt, robot().tool.link, robot().tool.X_LT, context)


class Arm:
    """M a + C v + g + D v = u + J^T F, semi-implicit Euler; the hand's joints stay."""

    def __init__(self):
        self.q, self.v, self.u = BENT.copy(), np.zeros(7), np.zeros(7)

    def states(self):
        whole = [full(values) for values in (self.q, self.v, self.u)]
        return JointState(*whole), JointState(self.q.copy(), self.v.copy(), self.u.copy())

    def step(self, u, wrench):
        k, q, v = columns(), full(self.q), full(self.v)
        damping = np.array([joint.damping for joint in robot().moving_joints])[k]
        bias = model().inverse_dynamics(q, v, np.zeros(len(q)))[k] + damping * self.v
        mass = model().mass_matrix(q)[np.ix_(k, k)]
        push = tool(self.q)[2][:, k].T @ wrench
        self.u = np.array(u)
        self.v = self.v + PERIOD * np.linalg.solve(mass, self.u - bias + push)
        self.q = self.q + PERIOD * self.v


@pytest.mark.parametrize("wrench", [(6.0, -4.0, -12.0, 0, 0, 0), (0, 0, 5.0, 0.3, -0.2, 0.4)])
def test_the_observer_feels_the_wrench_of_a_moving_arm(wrench):
    """The environment pushes with F: the tool exerts -F, in its axes, whatever the arm does meanwhile."""
    arm, felt, pushing = Arm(), make_felt(), np.array(wrench)
    for tick in range(250):
        whole, _ = arm.states()
        felt.update(tick * PERIOD, PERIOD, whole)
        swing = 1.5 * np.sin(2.0 * np.pi * 2.0 * tick * PERIOD + np.arange(7))
        arm.step(model().gravity(full(arm.q))[columns()] + swing - 2.0 * arm.v, pushing)
    R = tool(arm.q)[0]
    expected = -(pushing.reshape(2, 3) @ R).reshape(6)
    assert np.abs(arm.v).max() > 0.05
    # The observer lags by 6 ms while the arm turns, and steps are 1 ms.
    np.testing.assert_allclose(felt.wrench, expected, atol=0.02 * np.abs(expected).max())


def test_a_tare_is_felt_as_zero_from_then_on():
    arm, felt = Arm(), make_felt()
    for tick in range(400):
        whole, _ = arm.states()
        if tick == 200:
            felt.tare()
        felt.update(tick * PERIOD, PERIOD, whole)
        load = np.array([0.0, 0.0, -3.0, 0, 0, 0])
        arm.step(model().gravity(full(arm.q))[columns()] - 2.0 * arm.v - tool(arm.q)[2][:, columns()].T @ load, load)
    np.testing.assert_allclose(felt.wrench, 0.0, atol=0.01)


def test_a_sensor_is_felt_about_the_tool():
    """f_T = R f_S, t_T = R (t_S - p x f_S) with T at p in S: a force at a lever has a torque."""
    X_ST = Transform.of(xyz=(0.0, 0.0, 0.1), rpy=(0.0, 0.0, np.pi / 2.0))
    felt = make_felt(sensor="wrist", X_ST=X_ST)
    # A push of 4 N along x at the origin of the tool: the link passes on the force, and its moment about S.
    felt.attach([np.array([4.0, 0.0, 0.0, 0.0, 0.4, 0.0])])
    whole, _ = Arm().states()
    felt.update(0.0, PERIOD, whole)
    np.testing.assert_allclose(felt.wrench, [0.0, 4.0, 0.0, 0.0, 0.0, 0.0], atol=1e-12)


class Still:
    """A felt force that is what the test sets."""

    def __init__(self, wrench):
        self.wrench, self.taring = np.array(wrench), False

    def tare(self):
        """It is zero already."""


def test_the_admittance_obeys_its_equation():
    """M x'' + D x' + K x = -f from rest, overdamped: two exponentials; the commanded tool is displaced by x."""
    felt = Still([3.0, 0.0, -6.0, 0.0, 0.0, 0.0])
    arm, state = make(AdmittanceArm, felt), JointState(BENT, np.zeros(7), np.zeros(7))
    stiffness = Compliance.of(along=400.0, across=800.0)
    R, p, _ = tool(BENT)
    arm.comply(stiffness)
    for tick in range(1200):
        output = arm.update(tick * PERIOD, PERIOD, state)
    found = R.T @ (tool(np.array(output.command))[1] - p)
    time, expected = 1200 * PERIOD, np.zeros(3)
    for k, spring in enumerate((800.0, 800.0, 400.0)):
        a, b = np.roots([MASS[k], 2.0 * np.sqrt(CONTACT[k] * MASS[k]), spring])
        grown = 1.0 + (b * np.exp(a * time) - a * np.exp(b * time)) / (a - b)
        expected[k] = -felt.wrench[k] / spring * grown
    np.testing.assert_allclose(found, expected, atol=2e-5)  # steps of 1 ms
    np.testing.assert_allclose(tool(np.array(output.command))[0], R, atol=1e-4)


def test_the_admittance_reaches_stiffness_times_depth_on_what_does_not_move():
    """With x = 0 the force that balances the equation is K s."""
    felt = Still(np.zeros(6))
    arm, state = make(AdmittanceArm, felt), JointState(BENT, np.zeros(7), np.zeros(7))
    arm.comply(Compliance.of(along=400.0, force=Pressing(frozen([0.0, 0.0, 1.0]), 10.0, 0.01, 0.02)))
    R, p, _ = tool(BENT)
    wall, depth, force = 0.002, 0.0, 0.0
    for tick in range(4000):  # a wall of 20 kN/m, 2 mm before the tool, on an arm that follows its commands
        command = np.array(arm.update(tick * PERIOD, PERIOD, state).command)
        depth = float(R[:, 2] @ (tool(command)[1] - p)) - wall
        force = max(0.0, 2e4 * depth)
        felt.wrench = np.array([0.0, 0.0, force, 0.0, 0.0, 0.0])
        if tick > 800:
            assert force < 11.0
    np.testing.assert_allclose(force, 10.0, atol=0.1)
    np.testing.assert_allclose(400.0 * (arm.pressing.shift - wall - depth), force, atol=0.1)


def test_a_new_compliance_makes_no_step_in_the_force():
    """K s is the same before and after the stiffness changes; without a force it is given up."""
    felt = Still([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    arm, state = make(ImpedanceArm, felt), JointState(BENT, np.zeros(7), np.zeros(7))
    force = Pressing(frozen([0.0, 0.0, 1.0]), 10.0, 0.01, 0.02)
    arm.comply(Compliance.of(along=400.0, force=force))
    for tick in range(300):
        before = np.array(arm.update(tick * PERIOD, PERIOD, state).command)
    arm.comply(Compliance.of(along=800.0, force=force))
    after = np.array(arm.update(0.3, PERIOD, state).command)
    step = np.linalg.lstsq(tool(BENT)[2][:, columns()].T, after - before, rcond=None)[0]
    assert np.abs(tool(BENT)[2][:, columns()].T @ step).max() < 0.05
    assert np.abs(before).max() > 0.5
    arm.comply(Compliance.of())
    for tick in range(301, 700):
        relaxed = np.array(arm.update(tick * PERIOD, PERIOD, state).command)
    np.testing.assert_allclose(relaxed, 0.0, atol=1e-9)
