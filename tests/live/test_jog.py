"""Jogging and the emergency stop in a session: what moves, what is refused, and the same again from the log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from manipcli import pipeline
from manipcli.live.command import CALL_SERVICE, END, PUBLISH, SEND_GOAL, Answer, Command
from manipcli.live.interface import endpoints_of
from manipcli.model.kinematics import Kinematics
from manipcli.record.json_message import definition, from_json
from manipcli.record.read.reading import read_recording
from manipcli.run.execute import build_manager
from tests.live.sessions import HOME, ROOT, SMALL, simulated, trajectory

ARM = [f"joint_{k}" for k in range(1, 8)]
TYPES = {
    "jog": "geometry_msgs/TwistStamped",
    "jog_joints": "control_msgs/JointJog",
    "follow_joint_trajectory": "control_msgs/FollowJointTrajectory_Goal",
    "gripper_cmd": "control_msgs/ParallelGripperCommand_Goal",
}
GOAL, JOG, JOINTS, STOP, AGAIN, REFUSED, RELEASE, LAST = 10, 200, 900, 1300, 1310, 1320, 1500, 1800


def up(speed: float, frame: str = "") -> dict[str, Any]:
    return {"header": {"frame_id": frame}, "twist": {"linear": {"z": speed}}}


def test_a_session_with_a_jog_and_an_emergency_stop(tmp_path: Path) -> None:
    answers: list[tuple[str, Answer]] = []
    commands: dict[int, list[Command]] = {LAST: [Command(END, "")]}

    def send(tick: int, op: str, name: str, message: dict[str, Any], label: str = "") -> None:
        kind = TYPES.get(name.rpartition("/")[2])
        whole = message if kind is None else from_json(definition(kind), message)
        answer = lambda found: answers.append((label, found))  # noqa: E731
        commands.setdefault(tick, []).append(Command(op, name, id=label, json=json.dumps(whole), answer=answer))

    goal = {"trajectory": trajectory(ARM, [value + 0.3 for value in HOME], 2.0)}
    send(GOAL, SEND_GOAL, "/arm_controller/follow_joint_trajectory", goal, "first")
    for tick in range(JOG, JOG + 300, 50):
        send(tick, PUBLISH, "/arm_controller/jog", up(-0.05))
    send(JOG, PUBLISH, "/arm_controller/jog", up(0.05, "camera"), "frame")
    joints = {"joint_names": ["joint_1"], "velocities": [0.4], "duration": 1.0}
    send(JOINTS, PUBLISH, "/arm_controller/jog_joints", joints)
    for label, wrong in (
        ("unknown", {"joint_names": ["joint_9"], "velocities": [0.1]}),
        ("counts", {"joint_names": ["joint_1"], "velocities": []}),
        ("twice", {"joint_names": ["joint_1", "joint_1"], "velocities": [0.1, 0.1]}),
        ("displacements", {"joint_names": ["joint_1"], "displacements": [0.1]}),
        ("long", {**joints, "duration": 2.0}),
        ("fast", {"joint_names": ["joint_1"], "velocities": [1e9]}),
    ):
        send(JOINTS + 1, PUBLISH, "/arm_controller/jog_joints", wrong, label)
    send(STOP, CALL_SERVICE, "/emergency_stop", {}, "stop")
    send(AGAIN, CALL_SERVICE, "/emergency_stop", {}, "again")
    activate = {"activate_controllers": ["arm_controller"], "deactivate_controllers": [], "strictness": 2}
    send(REFUSED, CALL_SERVICE, "/controller_manager/switch_controller", activate, "activate")
    send(REFUSED, SEND_GOAL, "/arm_controller/follow_joint_trajectory", goal, "arm")
    send(REFUSED, SEND_GOAL, "/hand_controller/gripper_cmd", {"command": {"position": [0.3]}}, "hand")
    send(REFUSED, PUBLISH, "/arm_controller/jog", up(0.05), "jog")
    send(RELEASE, CALL_SERVICE, "/emergency_stop_release", {}, "release")
    send(RELEASE + 1, CALL_SERVICE, "/emergency_stop_release", {}, "nothing")
    send(RELEASE + 1, PUBLISH, "/arm_controller/jog_joints", joints)
    send(RELEASE + 1, SEND_GOAL, "/hand_controller/gripper_cmd", {"command": {"position": [0.0]}}, "open")

    path, log = tmp_path / "small.yaml", tmp_path / "session.mcap"
    path.write_text(SMALL)
    simulated(path, commands, log)

    last = dict(answers)
    assert last["first"].values["error_string"] == "preempted by jogging"
    refusals = {
        "frame": "frame 'camera' is not a link", "unknown": "'joint_9' is not a joint",
        "counts": "0 velocities for 1", "twice": "more than once", "displacements": "not supported",
        "long": "2 s; expected 0 to 1", "fast": "1e+09; expected at most 100", "arm": "release it with",
        "hand": "release it with", "jog": "release it with",
    }  # fmt: skip
    for label, text in refusals.items():
        assert not last[label].ok, label
        assert text in last[label].text
    assert last["stop"].values["success"] is last["again"].values["success"] is True
    assert "arm_controller deactivated" in str(last["stop"].values["message"])
    assert last["activate"].values["ok"] is False
    assert "emergency stop is active" in str(last["activate"].values["message"])
    assert last["release"].values["message"] == "emergency stop released: arm_controller activated"
    assert last["nothing"].values["success"] is False
    assert last["open"].ok

    recording = read_recording(log)
    (trace,) = [trace for trace in recording.controllers if trace.name == "arm_controller"]
    robot = pipeline.load_task(path).robot
    kinematics = Kinematics(robot)
    assert robot.tool is not None

    def height(tick: int) -> float:
        q = np.zeros(len(robot.joint_names))
        q[robot.indices(trace.joints)] = trace.reference_position[tick]
        return float(kinematics.forward(q, robot.tool.link).p[2])  # type: ignore[union-attr]

    middle = height(JOG + 400) - height(JOG + 300)
    assert abs(middle + 0.05 * 0.1) < 1e-5
    still = trace.reference_position[JOG + 250 + 200 + 200 : JOINTS]  # 0.2 s after the last message, and its stop
    assert np.ptp(still, axis=0).max() == 0.0
    assert abs(trace.reference_velocity[STOP - 1][0] - 0.4) < 1e-9
    measured = recording.states.position[:, robot.indices(tuple(ARM))]
    braked = measured[STOP + 100 : RELEASE]
    assert np.ptp(braked, axis=0).max() < 1e-4
    assert np.isnan(trace.reference_position[STOP:RELEASE]).all()
    assert np.abs(trace.reference_position[RELEASE] - measured[RELEASE]).max() < 1e-9
    assert trace.reference_position[-1][0] > measured[RELEASE][0] + 0.05
    kinds = [event.kind for event in recording.events]
    assert kinds.index("emergency_stop") < kinds.index("emergency_stop_released")
    assert pipeline.verify_log(log).identical


def test_a_jog_of_the_tool_is_offered_where_the_joints_move_the_tool() -> None:
    task = pipeline.load_task(ROOT / "tasks/home.yaml")
    names = [each.name for each in endpoints_of(task, build_manager(task).controllers) if "jog" in each.name]
    assert names == ["/arm_controller/jog_joints", "/arm_controller/jog"]
