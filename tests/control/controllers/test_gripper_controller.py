"""The gripper on a fake hand: springs for contacts, walls for stalls, nothing at all."""

import numpy as np
import pytest

from manipcli.control.action import ErrorCode
from manipcli.control.controller import BuildContext, JointState
from manipcli.control.controllers.gripper import GripperController, GripperGoal, GripperSpec, build
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import GainsSpec

JOINTS = ("thumb_1", "thumb_2", "finger_1", "finger_2")
FINGERS = ((0, 1), (2, 3))
PERIOD = 0.001
INERTIA = 1e-3


def make(**more):
    settings = {
        "gains": {j: GainsSpec(p=3.0, d=0.1) for j in JOINTS},
        "fingers": FINGERS,
        "speed": 2.0,
        "max_effort": 2.0,
        "goal_tolerance": 0.02,
    }
    return GripperController(name="hand", joints=JOINTS, **(settings | more))


class Hand:
    """Light joints; each has a wall (a stiff, damped spring) beyond which it presses. Contact force per joint."""

    def __init__(self, walls):
        self.q, self.v = np.zeros(4), np.zeros(4)
        self.walls = np.array(walls, dtype=float)
        self.time = 0.0
        self.references = []

    def run(self, controller, seconds):
        for _ in range(round(seconds / PERIOD)):
            depth = np.maximum(self.q - self.walls, 0.0)
            force = 500.0 * depth  # N, on a lever of 0.1 m
            measured = JointState(position=self.q.copy(), velocity=self.v.copy(), effort=np.zeros(4))
            output = controller.update(self.time, PERIOD, measured, contact_force=force)
            self.references.append(output.position.copy())
            torque = output.command - 0.1 * force - 0.02 * self.v * (depth > 0)
            self.v += PERIOD * torque / INERTIA
            self.q += PERIOD * self.v
            self.time += PERIOD
        return output


FREE = [9, 9, 9, 9]


@pytest.mark.parametrize("compat", [None, "ros1"])
def test_an_integral_gain_does_not_press_harder_and_harder(compat):
    """At 2 N requested; unfrozen, 3 s of the error of 0.05 rad that is left would add 6 N."""
    controller = make(gains={j: GainsSpec(p=3.0, i=4.0, d=0.1) for j in JOINTS}, compat=compat)
    hand = Hand([0.4, 9, 0.4, 9])
    handle = controller.send_goal(GripperGoal(target=np.ones(4), force=2.0))
    hand.run(controller, 0.6)
    assert handle.result.fingers == ("contact", "contact")
    pressed = 500.0 * (hand.q[[0, 2]] - 0.4)
    hand.run(controller, 3.0)
    assert 500.0 * (hand.q[[0, 2]] - 0.4) == pytest.approx(pressed, rel=0.05)
    assert (pressed > 1.0).all()
    controller.send_goal(GripperGoal(target=np.zeros(4)))
    hand.run(controller, 3.0)
    assert hand.q == pytest.approx(np.zeros(4), abs=0.02)


def test_nothing_in_the_hand_means_every_finger_reached():
    controller, hand = make(), Hand(FREE)
    handle = controller.send_goal(GripperGoal(target=np.array([1, 0.5, 1, 0.5]), force=2.0))
    hand.run(controller, 1.0)
    assert (handle.status, handle.result.code) == ("succeeded", ErrorCode.SUCCESSFUL)
    assert handle.result.fingers == ("reached", "reached")
    assert hand.q == pytest.approx([1, 0.5, 1, 0.5], abs=0.01)


def test_references_move_at_the_speed_and_never_past_the_target():
    controller, hand = make(), Hand(FREE)
    controller.send_goal(GripperGoal(target=np.array([1, 0.5, -0.3, 0.0])))
    hand.run(controller, 0.7)
    references = np.array(hand.references)
    assert np.abs(np.diff(references, axis=0)).max() <= 2.0 * PERIOD * (1 + 1e-9)
    assert references[249] == pytest.approx([0.5, 0.5, -0.3, 0.0], abs=1e-9)
    assert references[-1] == pytest.approx([1, 0.5, -0.3, 0.0], abs=1e-12)
    assert references[:, 1].max() <= 0.5 + 1e-12


def test_each_finger_stops_on_its_own_at_the_force_and_keeps_pressing():
    controller, hand = make(), Hand([0.3, 9, 0.6, 9])
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0.1, 1.5, 0.1]), force=3.0))
    output = hand.run(controller, 1.5)
    assert handle.result.fingers == ("contact", "contact")
    assert "thumb_1" in handle.result.text
    assert "contact at 3" in handle.result.text
    references = np.array(hand.references)
    stopped = [int(np.flatnonzero(np.diff(references[:, j]))[-1]) for j in (0, 2)]
    assert stopped[0] < stopped[1]
    force = 500.0 * np.maximum(hand.q - hand.walls, 0.0)
    assert force[[0, 2]] == pytest.approx([3.0, 3.0], rel=0.3)  # the frozen spring holds about what stopped it
    assert output.velocity.tolist() == [0, 0, 0, 0]


def test_the_knock_of_the_first_touch_is_no_grip():
    controller = make()
    still = JointState(position=np.zeros(4), velocity=np.ones(4), effort=np.zeros(4))
    handle = controller.send_goal(GripperGoal(target=np.ones(4), force=3.0))
    for k in range(60):
        knock = np.full(4, 20.0 if k == 10 else 0.0)
        controller.update(k * PERIOD, PERIOD, still, contact_force=knock)
    assert handle.active
    for k in range(60, 160):
        controller.update(k * PERIOD, PERIOD, still, contact_force=np.array([2.0, 2.0, 0.0, 5.0]))
    assert handle.result.fingers == ("contact", "contact")


def test_a_finger_that_is_blocked_stalls_and_its_effort_is_clamped():
    controller, hand = make(max_effort=0.5), Hand([0.3, 9, 9, 9])
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0.1, 1.5, 0.1])))
    output = hand.run(controller, 1.5)
    assert handle.result.fingers == ("stalled", "reached")
    assert output.command[0] == 0.5
    assert output.position[0] < 1.5  # frozen where it stalled or at the target's ramp, never beyond
    assert "stalled" in handle.result.text


def test_a_finger_that_cannot_press_as_hard_as_asked_says_what_it_felt():
    """0.5 N m on a lever of 0.1 m are 5 N."""
    controller, hand = make(max_effort=0.5), Hand([0.3, 9, 9, 9])
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0.1, 1.5, 0.1]), force=100.0))
    hand.run(controller, 1.5)
    assert handle.result.fingers == ("stalled", "reached")
    stalled, reached = handle.result.text.split("; ")[:2]
    felt, asked = stalled.rpartition(", with ")[2].split(" N of the requested ")
    assert float(felt) == pytest.approx(5.0, rel=0.02)
    assert asked == "100 N"
    assert "asked" not in reached


@pytest.mark.parametrize(
    ("settings", "at", "target", "stalls"),
    [
        ({"stall_time": 0.05, "max_effort": 0.2}, 0.0, 1.0, 0.05),
        ({"speed": 1.0, "max_effort": 0.2}, 0.3, 0.0, 0.2 + 0.1 / 3.0),
        ({"speed": 1.0, "max_effort": None}, 0.3, 0.0, 0.5),
        ({"speed": 1.0, "max_effort": None, "interface": "position", "gains": {}}, 0.3, 0.0, 0.5),
    ],
    ids=["closes with all it may", "opens with all it may", "opens by effort", "opens by position"],
)
def test_a_stall_takes_its_time(settings, at, target, stalls):
    """From when nothing pushes harder: at 0.2 N m, which the reference's speed asks for at once where that is 2 rad/s,
    and with the 0.1 / 3 rad of its way where it is 1 rad/s; else when the reference has gone all its way."""
    controller = make(**settings)
    stuck = JointState(position=np.full(4, at), velocity=np.zeros(4), effort=np.zeros(4))
    handle = controller.send_goal(GripperGoal(target=np.full(4, target)))
    ticks = round(stalls / PERIOD)
    for k in range(ticks - 3):
        controller.update(k * PERIOD, PERIOD, stuck)
    assert handle.active
    for k in range(ticks - 3, ticks + 3):
        controller.update(k * PERIOD, PERIOD, stuck)
    assert handle.result.fingers == ("stalled", "stalled")
    assert f"stalled {abs(target - at):g} rad before the target of '{JOINTS[0]}'" in handle.result.text


@pytest.mark.parametrize(("kind", "unit"), [("prismatic", "m"), ("revolute", "rad")])
def test_a_stall_is_told_in_the_unit_of_its_joint(kind, unit):
    spec = GripperSpec(type="gripper", joints=JOINTS, gains={joint: GainsSpec(p=1.0) for joint in JOINTS})
    controller = build("hand", spec, BuildContext(robot_of(kind), kinematics=None, compat=None))
    stuck = JointState(position=np.zeros(4), velocity=np.zeros(4), effort=np.zeros(4))
    handle = controller.send_goal(GripperGoal(target=0.5))
    for k in range(1000):
        controller.update(k * PERIOD, PERIOD, stuck)
    assert f"stalled 0.5 {unit} before the target of '{JOINTS[0]}'" in handle.result.text


def robot_of(kind):
    """A palm with one joint of this kind for each of `JOINTS`."""
    joints = tuple(
        Joint(name, kind, "palm", f"{name}_link", Transform.identity(), frozen([0, 0, 1]), JointLimits(0, 1, 1, 1))
        for name in JOINTS
    )
    links = tuple(Link(name, None, (), ()) for name in ("palm", *(joint.child for joint in joints)))
    return RobotModel("hand", "palm", links, joints, (), (), (), Transform.identity(), "")


def test_a_finger_has_not_stalled_as_long_as_its_reference_winds_it_up():
    """A reference of 0.5 rad/s raises the force by 3 N m/rad x 0.5 rad/s / 0.1 m: 10 N take three stall times."""
    controller, hand = make(speed=0.5), Hand([0.3, 9, 9, 9])
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0, 0, 0]), force=10.0))
    output = hand.run(controller, 1.6)
    assert handle.result.fingers == ("contact", "reached")
    assert output.command[0] == pytest.approx(1.0, rel=0.05)


def test_a_finger_that_pressed_opens_from_where_it_is():
    """What stalled at its maximum effort has a reference 2 / 3 rad inside the wall, four stall times of way back."""
    controller, hand = make(speed=0.8), Hand([0.3, 9, 9, 9])
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0, 0, 0])))
    ahead = hand.run(controller, 1.6).position[0] - hand.q[0]
    assert handle.result.fingers == ("stalled", "reached")
    assert ahead > 2.0 / 3.0
    handle = controller.send_goal(GripperGoal(target=np.zeros(4)))
    hand.run(controller, 0.5)  # 0.3 rad at 0.8 rad/s take 0.375 s
    assert handle.result.fingers == ("reached", "reached")
    assert hand.q == pytest.approx(np.zeros(4), abs=0.02)


def test_a_firmer_grip_goes_on_from_the_one_before():
    """No reference that pushes towards its target is taken back: what is held is not let go."""
    controller, hand = make(), Hand([0.3, 9, 9, 9])
    controller.send_goal(GripperGoal(target=np.array([1.5, 0, 0, 0]), force=3.0))
    before = hand.run(controller, 1.0).position[0]
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0, 0, 0]), force=6.0))
    first = len(hand.references)
    hand.run(controller, 1.0)
    assert handle.result.fingers == ("contact", "reached")
    assert min(reference[0] for reference in hand.references[first:]) >= before


def test_opening_ignores_contact():
    controller, hand = make(), Hand([0.3, 9, 9, 9])
    controller.send_goal(GripperGoal(target=np.array([1.0, 0, 1.0, 0]), force=2.0))
    hand.run(controller, 1.0)
    handle = controller.send_goal(GripperGoal(target=np.zeros(4)))
    hand.run(controller, 1.0)
    assert handle.result.fingers == ("reached", "reached")
    assert hand.q == pytest.approx(np.zeros(4), abs=0.01)


def test_effort_of_a_goal_replaces_the_controllers():
    """A finger that is pressed away pushes back with no more than that."""
    controller = make()
    still = JointState(position=np.zeros(4), velocity=np.zeros(4), effort=np.zeros(4))
    controller.update(0.0, PERIOD, still)
    pressed = JointState(position=np.array([1.0, -1.0, 1.0, 0.1]), velocity=np.zeros(4), effort=np.zeros(4))
    assert controller.update(PERIOD, PERIOD, pressed).command == pytest.approx([-2.0, 2.0, -2.0, -0.3])
    controller.send_goal(GripperGoal(target=np.zeros(4), max_effort=np.array([0.1, 0.2, 0.3, 0.4])))
    assert controller.update(2 * PERIOD, PERIOD, pressed).command == pytest.approx([-0.1, 0.2, -0.3, -0.3])


def test_a_goal_finds_its_fingers_in_the_goal_first():
    controller = make()
    still = JointState(position=np.zeros(4), velocity=np.zeros(4), effort=np.zeros(4))
    handle = controller.send_goal(GripperGoal(target=np.zeros(4), fingers=((0,), (1,), (2, 3))))
    controller.update(0.0, PERIOD, still)
    assert handle.result.fingers == ("reached",) * 3


def test_cancel_and_preemption_and_deactivation():
    controller, hand = make(), Hand(FREE)
    first = controller.send_goal(GripperGoal(target=np.ones(4)))
    hand.run(controller, 0.1)
    second = controller.send_goal(GripperGoal(target=np.ones(4)))
    assert (first.status, first.result.code) == ("aborted", ErrorCode.INVALID_GOAL)
    hand.run(controller, 0.1)
    second.cancel()
    assert second.status == "canceled"
    held = hand.run(controller, 0.1).position.copy()
    assert np.array_equal(held, hand.run(controller, 0.1).position)
    third = controller.send_goal(GripperGoal(target=np.ones(4)))
    controller.deactivate(hand.time)
    assert third.result.code is ErrorCode.INVALID_GOAL
    measured = hand.q.copy()
    assert np.array_equal(hand.run(controller, PERIOD).position, measured)


@pytest.mark.parametrize(
    "goal",
    [
        GripperGoal(target=np.zeros(3)),
        GripperGoal(target=np.full(4, np.nan)),
        GripperGoal(target=np.zeros(4), force=0.0),
        GripperGoal(target=np.zeros(4), max_effort=np.zeros(4)),
        GripperGoal(target=np.zeros(4), fingers=((0, 1), (1, 2, 3))),
        GripperGoal(target=np.zeros(4), fingers=((0, 1),)),
    ],
)
def test_goals_that_make_no_sense_are_refused(goal):
    with pytest.raises(InvalidArgument):
        make().send_goal(goal)


def test_gains_all_zero_are_refused():
    with pytest.raises(InvalidArgument, match="thumb_2"):
        make(gains={j: GainsSpec(p=1.0) for j in JOINTS if j != "thumb_2"})


def test_one_position_is_meant_for_all_joints_and_one_effort_too():
    controller, hand = make(), Hand(FREE)
    handle = controller.send_goal(GripperGoal(target=0.4, max_effort=1.5))
    output = hand.run(controller, 1.0)
    assert (handle.result.reached_goal, handle.result.stalled) == (True, False)
    assert output.position == pytest.approx([0.4] * 4, abs=1e-9)


def test_what_stalls_has_grasped_unless_it_must_not():
    """As in GripperCommand: stalled and not at the goal; a success only where stalling is allowed."""
    ends = []
    for allowed in (True, False):
        controller, hand = make(allow_stalling=allowed), Hand([0.3, 9, 9, 9])
        handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0.1, 1.5, 0.1])))
        hand.run(controller, 1.5)
        result = handle.result
        assert (result.stalled, result.reached_goal, result.fingers) == (True, False, ("stalled", "reached"))
        ends.append((result.status, int(result.code)))
    assert ends == [("succeeded", 0), ("aborted", -5)]
    assert "'thumb_1'" in result.text
    assert "stalling is not allowed" in result.text


def test_contact_is_allowed_where_stalling_is_not():
    controller, hand = make(allow_stalling=False), Hand([0.3, 9, 0.6, 9])
    handle = controller.send_goal(GripperGoal(target=np.array([1.5, 0.1, 1.5, 0.1]), force=3.0))
    hand.run(controller, 1.5)
    assert (handle.status, handle.result.stalled) == ("succeeded", True)


@pytest.mark.parametrize(
    ("interface", "asked", "expected"),
    [("effort", True, "gravity"), ("effort", False, "none"), ("position", True, "none"), ("position", False, "none")],
)
def test_gravity_is_asked_for_where_it_is_wanted_and_commanded_as_an_effort(interface, asked, expected):
    spec = GripperSpec(
        type="gripper", joints=JOINTS, command_interface=interface, gravity_compensation=asked,
        gains={joint: GainsSpec(p=1.0) for joint in JOINTS},
    )  # fmt: skip
    assert (
        build("hand", spec, BuildContext(robot_of("revolute"), kinematics=None, compat=None)).feed_forward == expected
    )


def test_on_the_position_interface_it_commands_its_reference():
    controller = make(interface="position", gains={}, max_effort=None)
    assert controller.interfaces == ("position",)
    at, speed = np.array([0.2, 0.0, 0.0, 0.0]), np.zeros(4)
    for k in range(2000):
        output = controller.update(k * PERIOD, PERIOD, JointState(at, speed, np.zeros(4)))
        assert np.array_equal(output.command, output.position)
        if k == 0:
            assert output.command.tolist() == [0.2, 0.0, 0.0, 0.0]
            handle = controller.send_goal(GripperGoal(target=np.array([1.0, 0.5, 1.0, 0.5])))
        at, speed = output.command.copy(), (output.command - at) / PERIOD
    assert handle.result.reached_goal
    assert at == pytest.approx([1.0, 0.5, 1.0, 0.5])


@pytest.mark.parametrize("effort", [2.0, np.array([1.0, 1.0, 1.0, np.inf])])
def test_positions_know_no_maximum_effort(effort):
    with pytest.raises(InvalidArgument, match="positions"):
        make(interface="position", gains={}, max_effort=effort)
    with pytest.raises(InvalidArgument, match="positions"):
        make(interface="position", gains={}, max_effort=None).send_goal(GripperGoal(target=0.1, max_effort=effort))


@pytest.mark.parametrize("what", ["position", "velocity"])
def test_a_measurement_that_is_no_number_is_refused_by_name(what):
    state = {"position": np.zeros(4), "velocity": np.zeros(4), "effort": np.zeros(4)}
    controller = make()
    controller.update(0.0, PERIOD, JointState(**state))
    state[what][2] = np.nan
    with pytest.raises(InvalidArgument, match=f"{what} of joint 'finger_1' is nan"):
        controller.update(PERIOD, PERIOD, JointState(**state))
