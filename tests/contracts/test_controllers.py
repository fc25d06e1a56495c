"""What every type of controllers promises, over the registry; each on the example of its own docstring."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.control_loop import NoLoop, PidLoop
from manipcli.control.controller import BuildContext, Controller, ControllerMember, JointState
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.factory import build_controllers, controller_findings
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Array
from manipcli.model.build_robot import build_robot
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.plan.claimed_joints import Claims, unfollowed
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.load import load_controllers_text, load_robot
from manipcli.task.vocabulary import controllers_spec

PERIOD = 1e-3
ROBOT = Path(__file__).parents[2] / "robots" / "arm7_hand3" / "robot.yaml"
every_controller = pytest.mark.parametrize("member", list(CONTROLLERS), ids=lambda member: member.name)


@cache
def robot() -> RobotModel:
    file = load_robot(ROBOT)
    return build_robot(file.spec, file=ROBOT, source=file.source)[0]


@cache
def kinematics() -> Kinematics:
    return Kinematics(robot())


def example(member: ControllerMember[ControllerSpec]) -> ControllersSpec:
    """The file in the docstring of the member's module."""
    text = sys.modules[member.build.__module__].__doc__ or ""
    lines = text[text.index("    controllers:") :].split("\n\n")[0].splitlines()
    located = load_controllers_text("\n".join(line[4:] for line in lines), "example.yaml", model=controllers_spec())
    assert located.findings == ()
    return located.spec


def built(member: ControllerMember[ControllerSpec]) -> Controller:
    ((name, spec),) = example(member).controllers.items()
    return CONTROLLERS[spec.type].build(name, spec, BuildContext(robot(), kinematics, "ros2"))


def resting(controller: Controller, offset: float = 0.2) -> JointState:
    n = len(controller.joints)
    return JointState(np.full(n, offset), np.zeros(n), np.zeros(n))


def manager_of(member: ControllerMember[ControllerSpec]) -> ControllerManager:
    return build_controllers(example(member), robot(), PERIOD, kinematics=kinematics())


def world(q: Array) -> WorldState:
    none = np.zeros((0, 3))
    return WorldState(np.zeros(()), q, np.zeros_like(q), np.zeros_like(q), none, np.zeros((0, 4)), none, none)


@every_controller
def test_its_docstring_shows_a_file_that_it_accepts(member: ControllerMember[ControllerSpec]) -> None:
    spec = example(member)
    assert [one.type for one in spec.controllers.values()] == [member.name]
    errors = [f for f in controller_findings(spec, robot(), PERIOD) if f.severity == "error"]
    assert errors == []


@every_controller
def test_it_claims_what_its_spec_says(member: ControllerMember[ControllerSpec]) -> None:
    (spec,) = example(member).controllers.values()
    controller = built(member)
    assert controller.interfaces == spec.interfaces
    assert controller.role == spec.role
    if spec.joints:
        assert controller.joints == spec.joints


@every_controller
def test_at_rest_it_holds(member: ControllerMember[ControllerSpec]) -> None:
    """Without a goal, no error: no velocity and no effort of its own, and the position that was measured."""
    controller = built(member)
    measured = resting(controller)
    for k in range(3):
        output = controller.update(k * PERIOD, PERIOD, measured)
        for interface, command in zip(controller.interfaces, output.commands, strict=True):
            wanted = measured.position if interface == "position" else np.zeros(len(controller.joints))
            np.testing.assert_allclose(command, wanted, atol=1e-9)
        if controller.interfaces:
            np.testing.assert_allclose(output.position, measured.position, atol=1e-12)
            np.testing.assert_allclose(output.wanted_acceleration, 0.0, atol=1e-9)


@every_controller
def test_it_writes_in_place_and_changes_nothing_that_it_is_given(member: ControllerMember[ControllerSpec]) -> None:
    controller = built(member)
    output, rows = controller.output, controller.output.rows
    rng = np.random.default_rng(3)
    for k in range(20):
        measured = JointState(*(rng.normal(scale=0.1, size=len(controller.joints)) for _ in range(3)))
        for array in (measured.position, measured.velocity, measured.effort):
            array.flags.writeable = False
        assert controller.update(k * PERIOD, PERIOD, measured) is output
        assert controller.output.rows is rows
        assert np.isfinite(rows).all()


@every_controller
def test_it_forgets_when_it_is_deactivated(member: ControllerMember[ControllerSpec]) -> None:
    """It holds where it is activated again, as if it were new."""
    controller = built(member)
    controller.update(0.0, PERIOD, resting(controller))
    controller.deactivate(PERIOD)
    again = np.array(controller.update(2 * PERIOD, PERIOD, resting(controller, -0.3)).rows)
    np.testing.assert_allclose(again, built(member).update(0.0, PERIOD, resting(controller, -0.3)).rows, atol=1e-12)


@every_controller
def test_the_manager_loads_lists_and_switches_it(member: ControllerMember[ControllerSpec]) -> None:
    manager = manager_of(member)
    (info,) = manager.list()
    assert info.state == "active"
    q = np.full(len(manager.joints), 0.1)
    command = manager.update(0.0, world(q))
    assert all(np.isfinite(row).all() for row in (command.position, command.velocity, command.effort))
    assert manager.switch(deactivate=[info.name]).ok
    assert set(manager.command.modes) == {"brake"}
    assert manager.switch(activate=[info.name]).ok
    assert manager.faults == ()


@every_controller
def test_a_joint_that_nobody_leads_is_told_which_types_do(member: ControllerMember[ControllerSpec]) -> None:
    """The hint of steps names every type that follows trajectories, and none that does not."""
    (problem,) = unfollowed(Claims.of(controllers_spec()(controllers={})), ["joint_1"], ())
    assert problem.hint is not None
    assert (f"`{member.name}`" in problem.hint) == (member.spec.role == "follower")


@every_controller
def test_it_says_what_limits_it_if_it_is_a_hand_and_only_then(member: ControllerMember[ControllerSpec]) -> None:
    assert (member.hand is not None) == (member.spec.role == "hand")


@every_controller
def test_a_pid_loop_is_of_the_gains_in_its_file_on_one_interface(member: ControllerMember[ControllerSpec]) -> None:
    """So that a finding about gains has a place, and the units of the gains are known."""
    (spec,) = example(member).controllers.values()
    loop = member.loop(spec)
    if isinstance(loop, PidLoop):
        assert len(spec.interfaces) == 1
        assert set(loop.gains) == set(spec.joints)
        assert "gains" in type(spec).model_fields
    if isinstance(loop, NoLoop):
        assert loop.reason


@every_controller
def test_it_asks_for_wrenches_at_links_that_there_are(member: ControllerMember[ControllerSpec]) -> None:
    for request in built(member).sensors:
        assert robot().joint(request.joint).child == request.frame
