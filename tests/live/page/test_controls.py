"""What sliders and poses of the page send, without a browser. Oracle: a cubic, and the controllers themselves."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Array
from manipcli.live.command import Answer, Command
from manipcli.live.goals import gripper_goal, topic_goal
from manipcli.live.interface import endpoints_of, offer_of
from manipcli.live.offer import Offer
from manipcli.live.page.controls import PERIOD, Controls
from manipcli.live.page.drive import RISE, Drive, drives_of
from manipcli.live.page.service_calls import PAUSE, RESET, failure, press, switch
from manipcli.live.page.snapshot import ENDED, RESETTING, Snapshot
from manipcli.model.state import WorldState
from manipcli.run.execute import build_manager
from manipcli.run.run_log import recorded
from manipcli.task.task import Task
from tests.live.sessions import HOME, SMALL


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Task, ControllerManager, Offer]:
    """A robot with an arm and a hand, whose controllers are active."""
    path = tmp_path_factory.mktemp("page") / "small.yaml"
    path.write_text(SMALL)
    task = pipeline.load_task(path)
    manager = build_manager(task, pipeline.plan_task(task).planner.kinematics)
    channels = [recorded(controller) for controller in manager.controllers]
    return task, manager, offer_of(endpoints_of(task, manager.controllers), channels)


@pytest.fixture
def drives(loaded: tuple[Task, ControllerManager, Offer]) -> tuple[Drive, ...]:
    task, manager, offer = loaded
    return drives_of(task.robot, [recorded(each) for each in manager.controllers], offer)


def at(task: Task, time: float = 1.0, arm: tuple[float, ...] = HOME) -> Snapshot:
    """The robot at rest, with its arm at these positions."""
    state = WorldState.room(len(task.robot.moving_joints), len(task.true.scene.movable))
    state.position[task.robot.indices(task.robot.group("arm").joints)] = arm
    return Snapshot(time, state)


def cubic(here: Array, velocity: Array, target: Array, duration: float) -> tuple[Array, Array]:
    """Velocities (T, n) and accelerations (T, n) of the cubics from `here` with a velocity to rest at `target`."""
    t = np.linspace(0.0, duration, 400)[:, None]
    c2 = 3.0 * (target - here) / duration**2 - 2.0 * velocity / duration
    c3 = -2.0 * (target - here) / duration**3 + velocity / duration**2
    return velocity + 2.0 * c2 * t + 3.0 * c3 * t**2, 2.0 * c2 + 6.0 * c3 * t


def test_a_motion_from_rest_keeps_speed_and_acceleration(drives: tuple[Drive, ...]) -> None:
    arm, draw = drives[0], np.random.default_rng(1)
    for _ in range(200):
        here, target = (draw.uniform(arm.lower, arm.upper) for _ in range(2))
        target = here + draw.choice([1e-3, 0.1, 1.0]) * (target - here)
        rest = np.zeros(len(here))
        velocity, acceleration = cubic(here, rest, target, arm.duration(here, rest, target))
        assert (np.abs(velocity) <= arm.speed * (1.0 + 1e-9)).all()
        assert (np.abs(acceleration) <= arm.speed / RISE * (1.0 + 1e-9)).all()


def test_the_controllers_accept_what_is_sent_wherever_a_slider_is(
    loaded: tuple[Task, ControllerManager, Offer], drives: tuple[Drive, ...]
) -> None:
    task, manager, offer = loaded
    draw = np.random.default_rng(2)
    for k in range(40):
        for drive in drives:
            here, _ = at(task).reference(drive)
            joint = drive.joints[draw.integers(len(drive.joints))]
            target = drive.target(here, {joint: draw.uniform(-9.0, 9.0)})  # also far beyond its limits
            seconds = drive.duration(here, np.zeros(len(here)), target)
            message = json.loads(drive.command(target, seconds, offer, id_=f"page.{k}").json)
            goal = gripper_goal(message, drive.joints) if drive.hand else topic_goal(message, 0.0)
            handle = manager[drive.controller].send_goal(goal)  # type: ignore[attr-defined]
            assert handle.active
            assert [each for each, q, p in zip(drive.joints, here, target, strict=True) if q != p] in ([joint], [])


def test_a_dragged_slider_sends_its_last_value_at_a_limited_rate(
    loaded: tuple[Task, ControllerManager, Offer], drives: tuple[Drive, ...]
) -> None:
    task, _, offer = loaded
    sent: list[Command] = []
    controls = Controls(task.robot, drives, offer, lambda command: not sent.append(command), lambda name, answer: None)
    arm, snapshot = drives[0], at(task)
    assert controls.follows(arm, snapshot, 0.0)
    for k in range(101):  # a second of dragging, of which the page looks at every 20 ms
        controls.slide(arm, "joint_1", 0.01 * k, now=0.01 * k)
        if k % 2 == 0:
            controls.send(replace(snapshot, time=1.0 + 0.01 * k), 0.01 * k)
        assert not controls.follows(arm, snapshot, 0.01 * k)
    controls.send(replace(snapshot, time=2.2), 1.2)
    assert 9 <= len(sent) <= 1.0 / PERIOD + 2
    last = json.loads(sent[-1].json)["points"][0]
    assert last["positions"] == pytest.approx([1.0, *HOME[1:]])
    assert last["velocities"] == [0.0] * 7
    end = 2.2 + last["time_from_start"]["sec"] + 1e-9 * last["time_from_start"]["nanosec"]
    assert not controls.follows(arm, replace(snapshot, time=end), 5.0)
    assert controls.follows(arm, replace(snapshot, time=end + 0.4), 5.0)
    assert controls.follows(arm, replace(snapshot, time=0.1), 5.0), "after a reset"
    controls.slide(arm, "joint_1", float("nan"), now=6.0)
    controls.send(snapshot, 6.0)
    assert 9 <= len(sent) <= 12


def test_a_pose_moves_all_drives_that_it_names_or_none(
    loaded: tuple[Task, ControllerManager, Offer], drives: tuple[Drive, ...]
) -> None:
    task, _, offer = loaded
    sent: list[Command] = []
    why: list[tuple[str, str]] = []
    controls = Controls(
        task.robot,
        drives,
        offer,
        lambda command: not sent.append(command),
        lambda name, answer: why.append((name, answer.text)),
    )
    assert controls.poses == {"robot": ["zero", "home"], "hand": ["open", "wrap"]}
    controls.go("wrap")
    controls.send(at(task), 0.0)
    (command,) = sent
    assert command.name == "/hand_controller/gripper_cmd"
    assert json.loads(command.json)["command"]["position"] == [0.6] * 6
    off = {"controllers": {"arm_controller": "inactive", "hand_controller": "active"}}
    release = 'the emergency stop is active; press "Release emergency stop": not moved'
    for obstacle, expected in (
        (off, "arm_controller is not active: not moved"),
        ({"stopped": True}, release),
        ({"stopped": True, **off}, release),
        ({"phase": RESETTING}, "the simulation is reset: not moved"),
        ({"phase": ENDED}, "the session has ended: not moved"),
    ):
        controls.go("zero")
        controls.send(replace(at(task), **obstacle), 1.0)
        assert why.pop() == ("zero", expected)
        controls.slide(drives[0], "joint_1", 0.5, now=1.0)
        controls.send(replace(at(task), **obstacle), 1.0)
        assert why.pop() == ("arm_controller", expected)
        assert controls.follows(drives[0], at(task), 9.0), "it shows where the robot is"
    controls.send(at(task), 2.0)
    assert len(sent) == 1, "what could not be moved is dropped"
    assert why == []
    controls.go("zero")
    controls.send(at(task), 3.0)
    assert [each.name for each in sent[1:]] == ["/arm_controller/joint_trajectory", "/hand_controller/gripper_cmd"]


def test_services_that_the_offer_lacks_have_no_command(loaded: tuple[Task, ControllerManager, Offer]) -> None:
    _, _, offer = loaded
    command = switch(offer, "arm_controller", active=False)
    assert command is not None
    assert json.loads(command.json)["deactivate_controllers"] == ["arm_controller"]
    without = replace(offer, services={})
    assert switch(without, "arm_controller", active=True) is None
    assert press(without, PAUSE, 0.001) is None
    assert press(without, RESET, 0.001) is None


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (Answer(True, {}), None),
        (Answer(False, {}, text="no"), "no"),
        (Answer(True, {"ok": False, "message": "claimed"}), "claimed"),
        (Answer(True, {"success": False, "message": "none"}), "none"),
        (Answer(True, {"result": {"result": 4, "error_message": "playing"}}), "playing"),
        (Answer(True, {"result": {"result": 1, "error_message": ""}}), None),
        (Answer(True, {"stalled": True}, status=4), None),
        (Answer(True, {"error_string": "preempted"}, status=6), "preempted"),
    ],
)
def test_an_answer_fails_also_in_its_own_fields(answer: Answer, expected: str | None) -> None:
    assert failure(answer) == expected
