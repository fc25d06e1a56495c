"""Claims, index maps and the factory: who commands which joint, and what is said when nobody or two do."""

from dataclasses import replace

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.gripper import GripperController, GripperGoal
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.factory import build_controllers, controller_findings
from manipcli.control.limiter import JointLimiter
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument, InvalidInput, Place
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link, Mimic
from manipcli.model.robot import RobotModel
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import GainsSpec
from manipcli.task.vocabulary import controllers_spec


def joint(name, parent, child, kind="revolute", mimic=None, effort=10.0):
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        X_PJ=Transform.identity(),
        axis=frozen([0, 0, 1]),
        limits=JointLimits(-1.0, 1.0, 2.0, effort),
        mimic=mimic,
    )


def robot():
    joints = (
        joint("shoulder", "base", "upper"),
        joint("elbow", "upper", "hand"),
        joint("mount", "hand", "palm", "fixed"),
        joint("left_1", "palm", "left_a", effort=0.5),
        joint("left_2", "left_a", "left_b"),
        joint("right_1", "palm", "right_a"),
        joint("follower", "palm", "other", mimic=Mimic("left_1", -1.0)),
    )
    names = ("base", *(j.child for j in joints))
    links = tuple(Link(name=name, inertial=None, visuals=(), collisions=()) for name in names)
    return RobotModel(
        name="toy",
        root="base",
        links=links,
        joints=joints,
        groups=(),
        poses=(),
        transmissions=(),
        X_WB=Transform.identity(),
        urdf="",
    )


HAND = ("left_1", "left_2", "right_1")


def gains(names, **changes):
    return {name: {"p": 2.0, "d": 0.1, **changes} for name in names}


def spec(**controllers):
    arm = {"type": "joint_trajectory", "joints": ["elbow", "shoulder"], "gains": gains(["shoulder", "elbow"])}
    hand = {"type": "gripper", "joints": list(HAND), "gains": gains(HAND), "max_effort": 1.0}
    default = {"arm": arm, "hand": hand}
    for name, changes in controllers.items():
        default[name] = default.get(name, {}) | changes
    return controllers_spec().model_validate({"controllers": default})


class World:
    def __init__(self, n=6):
        self.position, self.velocity, self.effort = np.linspace(0.1, 0.6, n), np.zeros(n), np.zeros(n)


def findings(controllers_spec, place=None):
    with pytest.raises(InvalidInput) as caught:
        build_controllers(controllers_spec, robot(), 0.001, *([place] if place else []))
    return caught.value.findings


class Dynamics:
    """A robot whose gravity is known; of the 0.5 N m of left_1 its follower, by -1, takes a half."""

    def gravity(self, q):
        return np.array([1.0, 2.0, 0.5, 0.2, 0.3, 0.25])


CARRIED = [0.25, 0.2, 0.3]
"""What holds the hand's joints."""


def test_each_joint_gets_its_own_values_and_a_mimic_joint_none():
    manager = build_controllers(spec(), robot(), 0.001, kinematics=Dynamics())
    assert manager.joints == ("shoulder", "elbow", "left_1", "left_2", "right_1", "follower")
    assert manager.command.modes == ("effort",) * 5 + ("free",)
    assert [controller.feed_forward for controller in manager.controllers] == ["none", "gravity"]
    world = World()
    assert manager.update(0.0, world).effort.tolist() == [0.0, 0.0, *CARRIED, 0.0]
    world.position = world.position - np.array([0.1, 0.2, 0, 0, 0.05, 0])
    assert manager.update(0.001, world).effort == pytest.approx([0.2, 0.4, 0.25, 0.2, 0.4, 0.0])
    arm, hand = manager.outputs
    assert arm.position == pytest.approx([0.2, 0.1])  # in the order of the controller's joints
    assert hand.position == pytest.approx([0.3, 0.4, 0.5])


def test_vectors_that_are_written_anew_in_place_are_seen():
    manager = build_controllers(spec(), robot(), 0.001, kinematics=Dynamics())
    world = World()
    manager.update(0.0, world)
    world.position[:] -= np.array([0.1, 0.2, 0, 0, 0.05, 0])
    assert manager.update(0.001, world).effort == pytest.approx([0.2, 0.4, 0.25, 0.2, 0.4, 0.0])


def test_what_is_measured_is_not_touched():
    manager = build_controllers(spec(), robot(), 0.001, kinematics=Dynamics())
    world, contact = World(), np.ones(6)
    manager.update(0.0, world, contact)
    assert np.array_equal(world.position, World().position)
    assert not world.velocity.any()
    assert contact.tolist() == [1.0] * 6


def test_contact_reaches_the_finger_that_it_belongs_to():
    manager = build_controllers(spec(hand={"goal_tolerance": 0.01}), robot(), 0.001)
    hand = manager["hand"]
    assert isinstance(hand, GripperController)
    handle = hand.send_goal(GripperGoal(target=np.full(3, 0.9), force=1.0))
    world = World()
    world.velocity = np.ones(6)
    for k in range(150):
        manager.update(k * 0.001, world, contact_force=np.array([9, 9, 0.7, 0.7, 0.0, 9.0]))
    assert handle.active
    for k in range(150, 300):
        manager.update(k * 0.001, world, contact_force=np.array([9, 9, 0.0, 0.0, 1.4, 9.0]))
    assert handle.result.fingers == ("contact", "contact")


def test_a_sliding_finger_that_a_thing_stops_two_centimetres_before_its_target_has_not_arrived():
    sliding = ("left_1", "left_2", "right_1")
    model = robot()
    model = replace(model, joints=tuple(replace(j, type="prismatic") if j.name in sliding else j for j in model.joints))
    manager = build_controllers(spec(hand={"speed": 0.05}), model, 0.001)
    hand = manager["hand"]
    assert isinstance(hand, GripperController)
    world = World()
    world.position = np.full(6, 0.02)
    handle = hand.send_goal(GripperGoal(target=np.zeros(3), force=10.0))
    for k in range(1000):
        manager.update(k * 0.001, world, contact_force=np.full(6, 4.0))
    assert handle.result.fingers == ("stalled", "stalled")


def test_effort_is_limited_by_the_gripper_and_by_the_joint():
    manager = build_controllers(spec(), robot(), 0.001, kinematics=Dynamics())
    world = World()
    manager.update(0.0, world)
    world.position = world.position - 0.9
    hand = manager.update(0.001, world).effort[2:5] - CARRIED
    assert hand == pytest.approx([0.5, 1.0, 1.0])  # the joint's limit, and twice the gripper's
    limiter = JointLimiter([j.limits for j in robot().moving_joints])
    manager.command.effort[:] = 99.0
    limiter.apply(manager.command, World().position, world.velocity, 0.001)
    assert manager.command.effort.tolist() == [10, 10, 0.5, 10, 10, 99]


def test_serving_and_lookup():
    manager = build_controllers(spec(), robot(), 0.001)
    assert manager.serving(["elbow"]).name == "arm"
    with pytest.raises(InvalidArgument, match="elbow, left_1"):
        manager.serving(["elbow", "left_1"])
    with pytest.raises(InvalidArgument, match="controller 'leg' is not loaded"):
        manager["leg"]


def test_two_controllers_on_one_joint_are_refused_with_both_names():
    def controller(name, interface):
        gains = {"a": GainsSpec(p=1.0)}
        return JointTrajectoryController(name=name, joints=["a"], command_interfaces=(interface,), gains=gains)

    with pytest.raises(InvalidInput, match=r"a/effort \(one\), a/velocity \(two\)"):
        ControllerManager([controller("one", "effort"), controller("two", "velocity")], joints=["a"], period=0.001)
    with pytest.raises(InvalidInput, match="'one' and 'two' both claim a/effort"):
        ControllerManager([controller("one", "effort"), controller("two", "effort")], joints=["a"], period=0.001)
    with pytest.raises(InvalidInput, match="is not a moving joint"):
        ControllerManager([controller("one", "effort")], joints=["b", "c"], period=0.001)
    with pytest.raises(InvalidInput, match="mimics another joint"):
        ControllerManager([controller("one", "effort")], joints=["a"], period=0.001, following=["a"])


def test_two_that_follow_with_one_joint_are_a_warning_and_a_feed_forward_is_none():
    both = ["shoulder", "elbow"]
    arm = {"type": "joint_trajectory", "joints": both, "command_interface": "position"}
    push = {"type": "joint_trajectory", "joints": both, "command_interface": "effort", "gains": gains(both)}
    add = {"type": "forward_command", "joints": both, "command_interface": "effort"}

    def warned(**controllers):
        found = controller_findings(controllers_spec().model_validate({"controllers": controllers}), robot(), 0.001)
        return [f.message for f in found if f.code == "CTRL149"]

    (text,) = warned(arm=arm, push=push)
    assert text.startswith("controllers 'arm' and 'push' are both active on elbow, shoulder: a joint tracks positions")
    assert warned(arm=arm, push=push | {"active": False}) == warned(arm=arm, add=add) == []


@pytest.mark.parametrize(
    ("interface", "rate", "told"),
    [("position", 100, True), ("position", 1000, False), ("effort", 100, False), ("velocity", 100, False)],
)
def test_positions_in_steps_that_the_limits_of_accelerations_cut_are_a_warning(interface, rate, told):
    model = robot()
    quick = tuple(replace(j, limits=replace(j.limits, acceleration=5.0)) for j in model.joints)
    both = ["shoulder", "elbow"]
    arm = {"type": "joint_trajectory", "joints": both, "command_interface": interface, "update_rate": rate}
    arm |= {} if interface == "position" else {"gains": gains(both)}
    written = controllers_spec().model_validate({"controllers": {"arm": arm}})
    for joints, expected in ((quick, told), (model.joints, False)):
        found = controller_findings(written, replace(model, joints=joints), 0.001)
        texts = [f.message for f in found if (f.code, f.severity) == ("CTRL170", "warning")]
        assert [("every 10 control ticks" in text, "shoulder" in text) for text in texts] == [(True, True)] * expected


def test_all_findings_of_a_file_come_at_once_each_with_its_place():
    asked = []

    def place(path):
        asked.append(path)
        return Place("c.yaml", len(asked), 1)

    bad = spec(
        arm={"joints": ["shoulder", "elbwo", "mount", "follower"], "gains": gains(["shoulder", "left_1"])},
        hand={"joints": ["left_1", "left_2"], "gains": gains(["left_1"])},
    )
    found = findings(bad, place)
    assert all(finding.place is not None for finding in found)
    texts = "\n".join(f"{finding} | {finding.hint}" for finding in found)
    for part in (
        "joint 'elbwo' is not in robot 'toy' | did you mean 'elbow'?",
        "joint 'mount' is fixed",
        "joint 'follower' mimics 'left_1'",
        "'left_1' has gains, but is not a joint of the controller",
        "joint 'elbow' has no gains",
        "joint 'left_2' has no gains",
    ):
        assert part in texts
    assert ("controllers", "arm", "joints", 1) in asked
    assert ("controllers", "arm", "gains", "left_1") in asked


def test_a_joint_that_nobody_commands_is_a_warning_and_braked():
    idle = spec(hand={"joints": ["left_1", "left_2"], "gains": gains(["left_1", "left_2"])})
    (finding,) = controller_findings(idle, robot(), 0.001)
    assert finding.severity == "warning"
    assert "no controller commands 'right_1' of robot 'toy'" in finding.message
    manager = build_controllers(idle, robot(), 0.001, kinematics=Dynamics())
    assert manager.command.modes == ("effort", "effort", "effort", "effort", "brake", "free")


def test_gains_of_no_joint_of_the_controller_point_to_a_joint_without_gains():
    misspelt = spec(hand={"joints": ["left_1", "left_2"], "gains": gains(["lfet_1", "left_2"])})
    hints = {finding.code: finding.hint for finding in findings(misspelt)}
    assert hints["CTRL102"] == "did you mean 'left_1'?"
    spare = spec(hand={"joints": ["left_2"], "gains": gains(["left_1", "left_2"])})
    hints = {finding.code: finding.hint for finding in findings(spare)}
    assert hints["CTRL102"] == "remove them, or add 'left_1' to `joints`"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"command_interface": "velocity", "gains": {}}, "on the velocity interface it would not move"),
        (
            {"command_interface": "position", "gravity_compensation": True},
            "gravity_compensation needs the effort interface",
        ),
        ({"constraints": {"joints": {"sholder": {"goal": 0.1}}}}, "'sholder' has tolerances"),
        (
            {"joints": ["shoulder", "elbow", "left_1"], "gains": gains(["shoulder", "elbow", "left_1"])},
            "'arm' and 'hand'",
        ),
    ],
)
def test_what_a_file_cannot_mean(changes, text):
    assert text in "\n".join(str(finding) for finding in findings(spec(arm=changes)))


def test_gains_may_be_absent_on_a_position_interface():
    manager = build_controllers(spec(arm={"command_interface": "position", "gains": {}}), robot(), 0.001)
    command = manager.update(0.0, World())
    assert command.modes[:2] == ("position", "position")
    assert command.position[:2] == pytest.approx([0.1, 0.2])


def test_deactivation_reaches_every_controller():
    manager = build_controllers(spec(), robot(), 0.001)
    hand = manager["hand"]
    handle = hand.send_goal(GripperGoal(target=np.zeros(3)))
    manager.update(0.0, World())
    manager.deactivate(0.001)
    assert handle.status == "aborted"


def test_a_controller_cannot_change_what_was_measured():
    class Spy(JointTrajectoryController):
        def update(self, time, period, measured, *, contact_force=None):
            assert isinstance(measured, JointState)
            measured.position[:] = -1.0
            return super().update(time, period, measured, contact_force=contact_force)

    for joints in (["a", "b"], ["b", "a"]):
        spy = Spy(name="spy", joints=joints, command_interfaces=("position",))
        manager = ControllerManager([spy], joints=["a", "b"], period=0.001)
        world = World(2)
        manager.update(0.0, world)
        assert "read-only" in manager.faults[0].message
        assert world.position.tolist() == World(2).position.tolist()
        with pytest.raises(InvalidArgument) as refused:
            manager.serving(["a"])
        (finding,) = refused.value.findings
        assert finding.message.endswith("(no controller is active)") and finding.hint == manager.faults[0].message


def test_a_position_controller_is_not_told_the_velocity_and_effort_of_the_one_before():
    """The joint obeys positions before and after; what nobody says any more is 0."""

    def made(name, *interfaces):
        return JointTrajectoryController(name=name, joints=("a",), command_interfaces=interfaces)

    manager = ControllerManager([made("swift", "position", "velocity")], joints=("a",), period=0.001)
    for name, interfaces in (("plain", ("position",)), ("strong", ("position", "effort"))):
        manager.load(made(name, *interfaces))
        manager.configure(name)
    world = World(1)
    manager.update(0.0, world)
    manager["swift"].send_goal(JointTrajectory(["a"], [TrajectoryPoint([1.0], 1.0, [0.0])]))
    for k in range(1, 500):
        command = manager.update(k * 0.001, world)
    assert command.velocity[0] > 1.0
    manager.switch_to(["plain"], time=0.5)
    assert manager.update(0.5, world).velocity[0] == 0.0
    manager.switch_to(["strong"], time=0.6)
    ahead = TrajectoryPoint([1.0], 1.0, [0.0], effort=[7.0])
    manager["strong"].send_goal(JointTrajectory(["a"], [ahead]))
    for k in range(600, 1500):
        command = manager.update(k * 0.001, world)
    assert command.effort[0] > 1.0
    manager.switch_to(["plain"], time=1.5)
    assert manager.update(1.5, world).effort[0] == 0.0
    assert command.modes == ("position",)


@pytest.mark.parametrize(
    ("arm", "code", "hint"),
    [
        ({"joints": ["shoulder", "elbwo"], "gains": gains(["shoulder", "elbow"])}, "CTRL144", "did you mean 'elbow'?"),
        ({"joints": ["shoulder", "elbwo"], "gains": gains(["shoulder", "elbwo"])}, "CTRL144", "did you mean 'elbow'?"),
        ({"joints": ["shoulder", "j2"], "gains": gains(["shoulder", "elbow"])}, "CTRL144", "did you mean 'elbow'?"),
        ({"joints": ["shoulder", "elbow"], "gains": gains(["shoulder", "elbwo"])}, "CTRL102", "did you mean 'elbow'?"),
    ],
)
def test_one_misspelt_joint_is_one_error(arm, code, hint):
    hand = {"joints": ["left_1", "left_2", "right_1"], "gains": gains(["left_1", "left_2", "right_1"])}
    found = [finding for finding in findings(spec(arm=arm, hand=hand)) if finding.severity == "error"]
    assert [(finding.code, finding.hint) for finding in found] == [(code, hint)]
