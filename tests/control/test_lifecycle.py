"""The manager's lifecycle and switching, by the cases of ros2_control's own tests (numbers in brackets), and what
happens to a controller that fails."""

import math

import numpy as np
import pytest

from manipcli.control.controller import ControllerOutput
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.controllers.gripper import GripperController, GripperGoal
from manipcli.control.lifecycle import ticks_between
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument, InvalidInput
from manipcli.spec.controllers import GainsSpec

PERIOD = 0.001
JOINTS = ("a", "b", "c")


class Spring:
    """Commands a number on one interface of its joints, and notes when; raises what it is told to."""

    senses_contact = False
    sensors = ()

    def __init__(self, name, joints=JOINTS, *interfaces, value=1.0, feed_forward="none"):
        self.name, self.joints, self.interfaces = name, tuple(joints), interfaces or ("effort",)
        self.feed_forward = feed_forward
        self.value = value
        self.output = ControllerOutput.of(len(self.joints), len(self.interfaces))
        self.updates, self.periods, self.reasons = [], [], []
        self.error = None

    def update(self, time, period, measured, *, contact_force=None):
        self.updates.append(round(time / PERIOD))
        self.periods.append(period)
        if self.error is not None:
            raise self.error
        for command in self.output.commands:
            command[:] = self.value
        return self.output

    def deactivate(self, time, reason="deactivated"):
        self.reasons.append(reason)


class World:
    def __init__(self, n=3):
        self.position, self.velocity, self.effort = np.linspace(0.1, 0.3, n), np.zeros(n), np.zeros(n)


def manager_of(*controllers, active=()):
    manager = ControllerManager(joints=JOINTS, period=PERIOD)
    for controller in controllers:
        manager.load(controller)
        manager.configure(controller.name)
    assert manager.switch(active).ok
    return manager


def states(manager):
    return {info.name: info.state for info in manager.list()}


@pytest.mark.parametrize("strictness", ["strict", "best_effort"])
def test_an_empty_request_is_done_whatever_the_strictness(strictness):  # [55]
    manager = manager_of(Spring("one"), active=["one"])
    result = manager.switch([], [], strictness=strictness)
    assert (result.ok, result.messages, states(manager)) == (True, (), {"one": "active"})


@pytest.mark.parametrize(
    ("activate", "deactivate", "strict", "best_effort"),
    [
        (["nobody"], [], False, False),
        ([], ["nobody"], False, False),
        (["two", "nobody"], ["one"], False, True),
        (["two"], ["one", "nobody"], False, True),
        (["nobody"], ["one"], False, False),  # nothing of one list is left
        (["one"], [], False, True),  # active already: left out
        ([], ["two"], False, True),  # not active: left out
        (["raw"], [], False, True),  # not configured: left out
    ],
)
def test_names_that_cannot_be_switched(activate, deactivate, strict, best_effort):  # [55]
    for strictness, ok in (("strict", strict), ("best_effort", best_effort)):
        manager = manager_of(Spring("one"), Spring("two"), active=["one"])
        manager.load(Spring("raw", "a"))
        before = states(manager)
        result = manager.switch(activate, deactivate, strictness=strictness)
        assert result.ok == ok, strictness
        assert result.messages
        if not ok:
            assert states(manager) == before, "nothing of a refused switch is done"
        if ok and "two" in activate:
            assert states(manager) == {"one": "inactive", "two": "active", "raw": "unconfigured"}


def test_a_name_that_is_nearly_right_is_answered_with_the_right_one():
    result = manager_of(Spring("position_arm")).switch(["postion_arm"])
    assert result.messages == (
        "cannot activate 'postion_arm': no such controller is loaded; did you mean 'position_arm'?",
    )


def test_what_each_state_allows():  # [56]
    manager = manager_of(Spring("one"), active=["one"])
    for forbidden in (manager.configure, manager.unload, manager.cleanup):
        with pytest.raises(InvalidArgument, match="'one' is active"):
            forbidden("one")
    assert manager.switch(deactivate=["one"]).ok
    manager.configure("one")  # an inactive one may be configured again
    manager.cleanup("one")
    with pytest.raises(InvalidArgument, match="'one' is unconfigured"):
        manager.cleanup("one")
    assert not manager.switch(["one"]).ok
    manager.unload("one")
    assert manager.list() == ()
    for absent in (manager.configure, manager.unload, manager.cleanup):
        with pytest.raises(InvalidArgument, match="controller 'one' is not loaded"):
            absent("one")
    assert not manager.switch(["one"]).ok


def test_an_unknown_type_and_a_second_of_the_same_name_are_not_loaded():  # [56]
    with pytest.raises(KeyError, match="joint_trajectory"):
        CONTROLLERS["joint_trajectry"]
    manager = manager_of(Spring("one"))
    with pytest.raises(InvalidArgument, match="duplicate controller name 'one'"):
        manager.load(Spring("one"))
    with pytest.raises(InvalidInput, match="is not a moving joint"):
        manager.load(Spring("two", ["x"]))
    assert states(manager) == {"one": "inactive"}


def test_an_interface_has_one_owner():  # [57]
    manager = manager_of(Spring("one"), Spring("two"), active=["one"])
    refused = manager.switch(["two"])
    assert not refused.ok
    assert refused.messages == ("controllers 'one' and 'two' both claim a/effort, b/effort, c/effort",)
    assert states(manager) == {"one": "active", "two": "inactive"}
    assert manager.switch(["two"], ["one"]).ok
    assert states(manager) == {"one": "inactive", "two": "active"}
    one, two = manager.list()
    assert (one.claimed, two.claimed) == ((), ("a/effort", "b/effort", "c/effort"))
    assert one.interfaces == two.interfaces


def test_with_best_effort_who_claims_what_is_taken_is_left_out():  # [57]
    manager = manager_of(Spring("one"), Spring("two"), Spring("three", "c", "position"), active=["one"])
    clash = "cannot activate 'two': controllers 'one' and 'two' both claim a/effort, b/effort, c/effort"
    left = manager.switch(["two", "three"], strictness="best_effort")
    assert (left.ok, left.activated, left.messages) == (True, ("three",), (clash,))
    assert states(manager) == {"one": "active", "two": "inactive", "three": "active"}
    both = manager.switch(["one", "two"], ["one", "three"], strictness="best_effort")  # who is named first has it
    assert (both.ok, both.activated, both.messages) == (True, ("one",), (clash,))
    assert states(manager) == {"one": "active", "two": "inactive", "three": "inactive"}


def test_interfaces_of_one_joint_go_to_two_controllers_only_where_a_joint_obeys_both():  # [57]
    manager = manager_of(
        Spring("p", JOINTS, "position"), Spring("e", JOINTS, "effort"), Spring("v", JOINTS, "velocity"), active=["p"]
    )
    assert manager.switch(["e"]).ok
    assert not manager.switch(["v"]).ok
    assert manager.switch(["v"], ["e"]).ok
    assert manager.update(0.0, World()).modes == ("position",) * 3


def test_a_name_on_both_lists_restarts():  # [57]
    one = Spring("one")
    manager = manager_of(one, active=["one"])
    manager.update(0.0, World())
    result = manager.switch(["one"], ["one"])
    assert (result.ok, result.activated, result.deactivated) == (True, ("one",), ("one",))
    assert len(one.reasons) == 1
    assert states(manager) == {"one": "active"}


def test_a_switch_takes_effect_whole_at_the_next_update():  # [59]: without a clock that could run out
    one, two = Spring("one", JOINTS, "effort", value=1.0), Spring("two", JOINTS, "position", value=0.2)
    manager = manager_of(one, two, active=["one"])
    command = manager.update(0.0, World())
    assert (command.modes, command.effort.tolist()) == (("effort",) * 3, [1.0] * 3)
    manager.switch(["two"], ["one"])
    assert manager.update(PERIOD, World()) is command
    assert (command.modes, command.effort.tolist()) == (("position",) * 3, [0.0] * 3)
    assert command.position.tolist() == [0.2] * 3
    assert (one.updates, two.updates) == ([0], [1])
    assert manager.outputs == (None, two.output)


def test_to_deactivates_who_is_in_the_way_and_nobody_else():
    manager = manager_of(
        Spring("arm", "ab"), Spring("hand", "c"), Spring("left", "a", "position"), Spring("right", "b", "position"),
        Spring("add", "a", "effort"), active=["arm", "hand"],
    )  # fmt: skip
    result = manager.switch_to(["left", "right"])
    assert (result.activated, result.deactivated) == (("left", "right"), ("arm",))
    assert states(manager)["hand"] == "active"
    # Position and effort of a joint may go together, but nobody asked for that here.
    assert manager.switch_to(["add"]).deactivated == ("left",)
    together = manager.switch_to(["add", "left"])
    assert (together.activated, together.deactivated) == (("left",), ())
    again = manager.switch_to(["add", "left"])
    assert (again.ok, again.activated, again.deactivated) == (True, (), ())
    before = states(manager)
    assert not manager.switch_to(["arm", "add"]).ok  # they exclude each other
    assert not manager.switch_to(["lft"]).ok
    assert states(manager) == before


@pytest.mark.parametrize("activated_at", [0, 3])
def test_a_slow_controller_is_updated_at_its_own_rate_from_its_activation_on(activated_at):  # [59]
    slow = Spring("slow")
    manager = ControllerManager(joints=JOINTS, period=PERIOD)
    manager.load(slow, update_rate=250.0)
    manager.configure("slow")
    for tick in range(20):
        if tick == activated_at:
            manager.switch(["slow"])
        command = manager.update(tick * PERIOD, World())
        assert command.effort.tolist() == ([1.0] * 3 if tick >= activated_at else [0.0] * 3), "no gap at the start"
    assert slow.updates == list(range(activated_at, 20, 4))
    assert slow.periods == pytest.approx([4 * PERIOD] * len(slow.updates))


@pytest.mark.parametrize(("rate", "ticks"), [(1000.0, 1), (500.0, 2), (100.0, 10), (1.0, 1000)])
def test_an_update_rate_is_a_whole_fraction_of_the_control_rate(rate, ticks):
    assert ticks_between(rate, PERIOD) == ticks


@pytest.mark.parametrize("rate", [300.0, 2000.0, 1001.0])
def test_an_update_rate_that_does_not_divide_the_control_rate_is_an_error_and_no_log_line(rate):  # [63]
    with pytest.raises(InvalidArgument, match=f"{rate:g} Hz does not divide the control rate of 1000 Hz"):
        ControllerManager(joints=JOINTS, period=PERIOD).load(Spring("one"), update_rate=rate)


@pytest.mark.parametrize(("rate", "period", "ticks"), [(170.0, 0.001, 6), (900.0, 0.00166667, 1), (44.0, 0.001, 23)])
def test_the_rate_that_the_hint_names_is_taken(rate, period, ticks):
    with pytest.raises(InvalidArgument) as refused:
        ticks_between(rate, period)
    hint = refused.value.findings[0].hint
    assert ticks_between(float(hint.removeprefix("use ").removesuffix(" Hz")), period) == ticks


@pytest.mark.parametrize("wrong", [0.0, -5.0, math.nan, math.inf])
def test_a_rate_or_period_that_is_not_above_zero_is_refused(wrong):
    with pytest.raises(InvalidArgument, match="expected a rate above 0"):
        ControllerManager(joints=JOINTS, period=PERIOD).load(Spring("one"), update_rate=wrong)
    with pytest.raises(InvalidArgument, match="expected a time above 0"):
        ControllerManager(joints=JOINTS, period=wrong)


def test_a_strictness_is_read_in_any_case_and_never_guessed():
    manager = manager_of(Spring("one"))
    assert not manager.switch(["one", "nobody"], strictness="STRICT").ok
    with pytest.raises(InvalidArgument, match="unknown strictness 'AUTO'; expected strict or best_effort"):
        manager.switch("one", strictness="AUTO")
    assert manager.switch(["one", "nobody"], strictness="BEST_EFFORT").activated == ("one",)


def test_one_name_need_not_stand_in_a_list():
    manager = manager_of(Spring("one"), Spring("two"))
    assert manager.switch("one").activated == ("one",)
    assert manager.switch("two", "one").activated == ("two",)
    assert manager.switch_to("one").deactivated == ("two",)


@pytest.mark.parametrize("wrong", [np.zeros(2), [0.0, 0.0, 0.0], None])
def test_measured_vectors_are_arrays_of_one_number_a_joint(wrong):
    manager = manager_of(Spring("one"), active=["one"])
    world = World()
    world.velocity = wrong
    with pytest.raises(InvalidArgument, match=r"measured velocity is .*; expected an array of 3 numbers"):
        manager.update(0.0, world)
    assert manager.faults == ()


class OwnError(Exception):
    pass


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (InvalidArgument("CTRL105", "a period of 0 s"), "a period of 0 s"),
        (OwnError("a bug"), "OwnError: a bug"),
        (ZeroDivisionError("by zero"), "ZeroDivisionError: by zero"),
    ],
)
def test_a_controller_that_raises_is_named_and_braked_and_the_others_go_on(error, text):
    bad, good = Spring("bad", "ac", value=7.0), Spring("good", "b", value=2.0)
    manager = manager_of(bad, good, active=["bad", "good"])
    manager.update(0.0, World())
    bad.error = error
    command = manager.update(PERIOD, World())
    assert command.modes == ("brake", "effort", "brake")
    assert command.effort.tolist() == [0.0, 2.0, 0.0]
    (fault,) = manager.faults
    assert f"controller 'bad' failed in its update: {text}" in fault.message
    assert fault.message in bad.reasons[0]
    assert states(manager) == {"bad": "inactive", "good": "active"}
    for k in range(2, 5):
        manager.update(k * PERIOD, World())
    assert (bad.updates, good.updates) == ([0, 1], [0, 1, 2, 3, 4])
    bad.error = None
    assert manager.switch(["bad"]).ok  # it may be tried again


def test_the_goal_of_a_controller_that_raises_ends_with_the_cause():
    class Breaks(GripperController):
        def update(self, time, period, measured, *, contact_force=None):
            raise OwnError("a bug")

    hand = Breaks(name="hand", joints=["a"], gains={"a": GainsSpec(p=1.0)})
    manager = manager_of(hand, active=["hand"])
    handle = hand.send_goal(GripperGoal(target=np.zeros(1)))
    manager.update(0.0, World())
    assert handle.status == "aborted"
    assert "controller 'hand' failed in its update: OwnError: a bug" in handle.result.text


@pytest.mark.parametrize("interface", ["effort", "position", "velocity"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_who_commands_no_finite_number_is_stopped_and_nobody_else(interface, value):
    bad, good = Spring("bad", "ac", interface), Spring("good", "b", interface, value=0.2)
    manager = manager_of(bad, good, active=["bad", "good"])
    manager.update(0.0, World())
    manager.stop_non_finite(0.0)
    assert manager.faults == ()
    bad.value = value
    manager.update(PERIOD, World())
    manager.stop_non_finite(PERIOD)
    (fault,) = manager.faults
    assert fault.message == f"controller 'bad' failed in its update: its command for a/{interface} is {value}"
    command = manager.update(2 * PERIOD, World())
    assert command.modes == ("brake", interface, "brake")
    assert np.isfinite([command.effort, command.position, command.velocity]).all()
