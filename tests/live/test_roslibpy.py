"""A session driven by roslibpy, a client that people use: names, states, goals, cancel, switching; then verified.

All laws of a robot share one session. Twisted's reactor runs in a thread of the process and is never stopped: it could
not be started again.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import roslibpy

from manipcli import pipeline
from manipcli.live.source import recorded_commands
from manipcli.record.read.reading import read_recording
from tests.live.sessions import ROOT, serving, trajectory

ARM = "/arm_controller"
FOLLOW = "control_msgs/action/FollowJointTrajectory"
PATIENCE = 30.0
"""[s] Of wall time: only so that a failure ends."""


class Messages:
    """The messages of a topic."""

    def __init__(self, ros: roslibpy.Ros, name: str, kind: str, **options: Any) -> None:
        self.topic = roslibpy.Topic(ros, name, kind, **options)
        self.all: list[dict[str, Any]] = []
        self._arrived = threading.Condition()
        self.topic.subscribe(self._take)

    def _take(self, message: dict[str, Any]) -> None:
        with self._arrived:
            self.all.append(message)
            self._arrived.notify_all()

    def until(self, holds: Callable[[list[dict[str, Any]]], bool]) -> list[dict[str, Any]]:
        """All messages, as soon as they fulfil a condition."""
        with self._arrived:
            assert self._arrived.wait_for(lambda: holds(self.all), PATIENCE), self.topic.name
            return [*self.all]


class Goal:
    """A goal of the arm, and what came of it."""

    def __init__(self, ros: roslibpy.Ros, joints: list[str], positions: list[float], seconds: float) -> None:
        self.feedback: list[dict[str, Any]] = []
        self.result: dict[str, Any] = {}
        self.refused: dict[str, Any] = {}
        self._client = roslibpy.ActionClient(ros, f"{ARM}/follow_joint_trajectory", FOLLOW)
        goal = roslibpy.Goal({"trajectory": trajectory(joints, positions, seconds)})
        self._id = self._client.send_goal(goal, self.result.update, self.feedback.append, self.refused.update)

    def wait(self) -> roslibpy.GoalStatus:
        """Its status at its end."""
        self._client.wait_goal(self._id, PATIENCE)
        until(lambda: bool(self.result or self.refused))  # roslibpy sets the event before it calls back
        return (self.result or self.refused)["status"]

    def cancel(self) -> None:
        self._client.cancel_goal(self._id)


def until(holds: Callable[[], bool]) -> None:
    """Wait for another thread."""
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.005)


def names_and_types(ros: roslibpy.Ros) -> None:
    types = {name: ros.get_topic_type(name) for name in ("/joint_states", f"{ARM}/joint_trajectory", "/clock")}
    assert types == {
        "/joint_states": "sensor_msgs/msg/JointState",
        f"{ARM}/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
        "/clock": "rosgraph_msgs/msg/Clock",
    }
    assert types.keys() <= set(ros.get_topics())
    assert "/joint_states" in ros.get_topics_for_type("sensor_msgs/JointState")
    switch = "/controller_manager/switch_controller"
    assert switch in ros.get_services()
    kind = ros.get_service_type(switch)
    assert ros.get_services_for_type(kind) == [switch]
    request, response = ros.get_service_request_details(kind), ros.get_service_response_details(kind)
    assert request["typedefs"][0]["fieldnames"][:3] == ["activate_controllers", "deactivate_controllers", "strictness"]
    assert "STRICT" in request["typedefs"][0]["constnames"]
    assert response["typedefs"][0]["fieldtypes"] == ["bool", "string"]
    described = {each["type"]: each for each in ros.get_message_details("trajectory_msgs/JointTrajectory")["typedefs"]}
    assert {"std_msgs/Header", "builtin_interfaces/Duration"} < described.keys()
    assert described["trajectory_msgs/JointTrajectory"]["fieldarraylen"] == [-1, 0, 0]
    assert ros.get_nodes() == ["/manipcli"]
    details = ros.get_node_details("/manipcli")
    assert f"{ARM}/joint_trajectory" in details["subscribing"]
    assert "/tf" in details["publishing"]
    first, second = ros.get_time(), ros.get_time()
    assert 0.0 < first.to_sec() <= second.to_sec()
    assert isinstance(ros.get_params(), list)
    servers: list[str] = []
    ros.get_action_servers(lambda answer: servers.extend(answer["action_servers"]))
    until(lambda: bool(servers))
    assert f"{ARM}/follow_joint_trajectory" in servers


def states_at_a_throttled_rate(ros: roslibpy.Ros, every: Messages) -> None:
    """In the same simulated time come more messages of a topic that is not throttled, `every`."""
    states = Messages(ros, "/joint_states", "sensor_msgs/JointState", throttle_rate=100)
    throttled = stamps(states.until(lambda found: len(found) >= 8))
    taken = stamps(every.until(lambda found: bool(stamps(found[-1:])[0] >= throttled[-1])))
    assert np.sum((taken >= throttled[0]) & (taken <= throttled[-1])) > 2 * len(throttled)
    second = Messages(ros, "/joint_states", "sensor_msgs/msg/JointState", compression="png")
    second.until(lambda found: len(found) >= 1)
    second.topic.unsubscribe()  # roslibpy removes the callbacks of both; the server goes on for the first
    heard = Messages(ros, "/joint_states", "sensor_msgs/JointState")
    heard.until(lambda found: len(found) >= 2)
    heard.topic.unsubscribe()
    states.topic.unsubscribe()


def stamps(messages: list[dict[str, Any]]) -> np.ndarray:
    """[s] Their stamps."""
    return np.array([each["header"]["stamp"]["sec"] + 1e-9 * each["header"]["stamp"]["nanosec"] for each in messages])


def switching(ros: roslibpy.Ros) -> None:
    service = roslibpy.Service(
        ros, "/controller_manager/switch_controller", "controller_manager_msgs/srv/SwitchController"
    )
    for key in ("deactivate_controllers", "activate_controllers"):
        request = roslibpy.ServiceRequest({key: ["arm_controller"], "strictness": 2})
        assert service.call(request, timeout=PATIENCE)["ok"] is True
        listed = roslibpy.Service(ros, "/controller_manager/list_controllers", "").call(roslibpy.ServiceRequest())
        states = {each["name"]: each["state"] for each in listed["controller"]}
        assert states["arm_controller"] == ("active" if key == "activate_controllers" else "inactive")
    with pytest.raises(roslibpy.core.ServiceException, match="did you mean"):
        service.call(roslibpy.ServiceRequest({"activate": []}), timeout=PATIENCE)


def parameters(ros: roslibpy.Ros) -> None:
    names = ros.get_params()
    (name, *_) = (each for each in names if each.startswith("/arm_controller:gains.") and each.endswith(".p"))
    bound = name.removesuffix(".p") + ".u_clamp_max"
    before = ros.get_param(name)
    ros.set_param(name, before * 1.01)
    assert ros.get_param(name) == before * 1.01
    ros.set_param(bound, 1e6)
    ros.delete_param(bound)
    assert ros.get_param(bound) is None
    with pytest.raises(roslibpy.core.ServiceException, match="parameter"):
        ros.get_param("/arm_controller:gain")


def drive(url: str) -> dict[str, float]:
    """All laws; the arm begins and ends at home: returns its joints there."""
    ros = roslibpy.Ros(url)
    ros.run(PATIENCE)
    try:
        reference = Messages(ros, f"{ARM}/controller_state", "control_msgs/msg/JointTrajectoryControllerState")
        state = reference.until(bool)[0]
        joints, home = state["joint_names"], state["reference"]["positions"]
        near = [value + 0.1 for value in home]
        names_and_types(ros)
        states_at_a_throttled_rate(ros, reference)
        parameters(ros)

        done = Goal(ros, joints, near, 0.5)
        assert done.wait() is roslibpy.GoalStatus.SUCCEEDED
        assert done.result["values"]["error_code"] == 0
        assert done.feedback[0]["joint_names"] == joints
        assert np.diff(stamps(done.feedback)) == pytest.approx(0.05, abs=1e-6)

        first, second = Goal(ros, joints, home, 20.0), Goal(ros, joints, near, 20.0)
        assert first.wait() is roslibpy.GoalStatus.ABORTED
        assert first.result["values"]["error_string"] == "preempted by a new goal"
        second.cancel()
        assert second.wait() is roslibpy.GoalStatus.CANCELED

        for wrong, code in ((["elbow", *joints[1:]], "INVALID_JOINTS (-2)"), (joints[1:], "INVALID_JOINTS (-2)")):
            refused = Goal(ros, wrong, near[: len(wrong)], 1.0)
            assert refused.wait() is roslibpy.GoalStatus.UNKNOWN
            assert refused.refused["values"].startswith(code), refused.refused

        switching(ros)

        topic = roslibpy.Topic(ros, f"{ARM}/joint_trajectory", "trajectory_msgs/JointTrajectory")
        topic.publish(roslibpy.Message(trajectory(joints, home, 3.0)))
        reference.until(lambda found: found[-1:] != [] and found[-1]["reference"]["positions"] == home)
        settled = stamps(reference.all)[-1] + 0.2
        reference.until(lambda found: bool(stamps(found[-1:])[0] > settled))
        return dict(zip(joints, home, strict=True))
    finally:
        ros.close()


@pytest.mark.parametrize("task", ["pour", "pour_iiwa"])
def test_roslibpy_commands_the_arm_and_the_session_simulates_the_same(task: str, tmp_path: Path) -> None:
    home: dict[str, float] = {}
    roslibpy.set_rosapi_timeout(PATIENCE)

    async def use(url: str) -> None:
        home.update(await asyncio.to_thread(drive, url))

    log = serving(tmp_path, use, task=ROOT / f"tasks/{task}.yaml", speed=4.0)

    recording = read_recording(log)
    schedule = recorded_commands(log, recording.period, failed=True)
    ticks = [tick for tick in range(len(recording.states.time)) for each in schedule.take(tick) if each.op == "publish"]
    assert len(ticks) == 1
    at = recording.states.time - ticks[0] * recording.period
    columns = [recording.joint_names.index(name) for name in home]
    away = recording.states.position[:, columns] - [*home.values()]
    moving = (at > 1.0) & (at < 2.8)  # on a straight line, which the measured positions give
    for joint in away.T:
        slope, offset = np.polyfit(at[moving], joint[moving], 1)
        assert -offset / slope == pytest.approx(3.0, abs=0.02)
    assert np.abs(away[at > 3.02]).max() < 5e-3
    assert pipeline.verify_log(log, package_path=[ROOT / "robots"]).identical
