"""Laws of a change of gains: from the next update on, the controller is one that was built with them."""

import numpy as np
import pytest

from manipcli.control.action import GripperGoal
from manipcli.control.controller import JointState
from manipcli.control.controllers.computed_torque import ComputedTorqueController
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.controllers.pid import PidController, PidGainsSpec
from manipcli.control.gripper_controller import GripperController
from manipcli.control.tunable_gains import gains_in
from manipcli.core.errors import InvalidArgument
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import GainsSpec

NAMES = ("a", "b")
OLD, NEW = {"p": 30.0, "d": 2.0, "u_clamp_max": 4.0}, {"p": 55.0, "d": 7.0, "u_clamp_max": 9.0}


def follower(spec):
    gains = {joint: GainsSpec(**spec, ff_velocity_scale=0.1 * spec["p"]) for joint in NAMES}
    return JointTrajectoryController(name="c", joints=NAMES, gains=gains)


def torque(spec):
    return ComputedTorqueController(name="c", joints=NAMES, gains={joint: GainsSpec(**spec) for joint in NAMES})


def hand(spec):
    return GripperController(name="c", joints=NAMES, gains={joint: GainsSpec(**spec) for joint in NAMES})


def pid(spec):
    gains = {joint: PidGainsSpec(**spec, feedforward_gain=spec["p"]) for joint in NAMES}
    return PidController(name="c", joints=NAMES, gains=gains, led=("position", "velocity"))


def ticks(controller, count, *, change=None):
    """The outputs of a motion of joints that lag behind; `change` of gains in its middle."""
    random = np.random.default_rng(7)
    rows = []
    for k in range(count):
        if k == 1 and controller.role == "follower":
            goal = JointTrajectory(NAMES, [TrajectoryPoint([1.0, -1.0], 0.2, [0.0, 0.0])])
            controller.send_goal(goal)
        if k == 1 and controller.role == "hand":
            controller.send_goal(GripperGoal(0.8))
        if k == count // 2 and change:
            gains_in(controller).change(change)
        state = JointState(random.uniform(-0.01, 0.01, 2), random.uniform(-0.1, 0.1, 2), np.zeros(2))
        output = controller.update(0.01 * k, 0.01, state)
        rows.append(np.concatenate([output.rows.ravel(), output.wanted_acceleration]))
    return np.array(rows)


@pytest.mark.parametrize("build", [follower, torque, hand, pid])
def test_from_the_next_update_on_it_is_a_controller_with_these_gains(build):
    word = {"follower": "ff_velocity_scale", "pid": "feedforward_gain"}.get(build.__name__)
    factor = {"follower": 0.1, "pid": 1.0}.get(build.__name__, 0.0)
    more = {word: factor * NEW["p"]} if word else {}
    values = {(joint, gain): value for joint in NAMES for gain, value in (NEW | more).items()}
    old, new, changed = ticks(build(OLD), 20), ticks(build(NEW), 20), ticks(build(OLD), 20, change=values)
    np.testing.assert_array_equal(changed[:10], old[:10])
    np.testing.assert_allclose(changed[10:], new[10:], rtol=1e-12, atol=1e-12)
    assert (abs(new - old)[10:].max(axis=0) > 1e-3).any()


def test_a_change_of_gain_makes_no_step_of_the_integral_term():
    """With i = 20 and an error of 0.5 for 0.1 s the term is 1; with i = 40 it then grows twice as fast."""
    controller = PidController(name="c", joints=("a",), gains={"a": PidGainsSpec(i=20.0)})
    controller.set_reference([0.5])
    state = JointState(np.zeros(1), np.zeros(1), np.zeros(1))
    commands = []
    for k in range(30):
        if k == 11:
            controller.gains.change({("a", "i"): 40.0})
        commands.append(float(controller.update(0.01 * k, 0.01, state).command[0]))
    np.testing.assert_allclose(np.diff(commands), [0.1] * 11 + [0.2] * 18, atol=1e-12)


@pytest.mark.parametrize(
    ("gain", "value", "text"),
    [
        ("p", -1.0, "p -1.0"), ("p", float("nan"), "p nan"), ("d", None, "d None"),
        ("u_clamp_max", -9.0, "u_clamp_min"),
        ("antiwindup_strategy", "none", "cannot change while it is loaded"), ("i_clamp_min", 1.0, "i_clamp_min 1.0"),
    ],
)  # fmt: skip
def test_a_value_that_the_file_may_not_have_changes_nothing(gain, value, text):
    controller = follower(OLD | {"u_clamp_min": -4.0})
    before = dict(controller.gains.now)
    with pytest.raises(InvalidArgument, match=text):
        controller.gains.change({("a", "p"): 1.0, ("b", gain): value})
    assert controller.gains.now == before


def test_gains_that_are_all_zero_are_refused_and_a_reset_gives_those_of_the_file():
    controller = follower(OLD)
    with pytest.raises(InvalidArgument, match="all zero"):
        controller.gains.change({("a", gain): 0.0 for gain in ("p", "i", "d", "ff_velocity_scale")})
    controller.gains.change({("a", "p"): 1.0, ("a", "u_clamp_max"): None})
    assert controller.gains.now["a"].u_clamp_max is None
    controller.gains.reset()
    assert controller.gains.now["a"].p == OLD["p"]
    np.testing.assert_array_equal(ticks(controller, 20), ticks(follower(OLD), 20))
    assert gains_in(JointTrajectoryController(name="c", joints=NAMES, command_interfaces=("position",))) is None
