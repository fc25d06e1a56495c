"""One client without a network: what it sends and gets, frame by frame, as roslibjs and roslibpy send them."""

from __future__ import annotations

import json
from collections import deque
from typing import Any

import numpy as np
import pytest

from manipcli.live.client import UNSUPPORTED, Client
from manipcli.live.command import Answer, Command
from manipcli.live.connection import Services
from manipcli.live.interface import Offer
from manipcli.live.outbox import Subscription
from manipcli.live.rosapi import Rosapi

FOLLOW = "control_msgs/action/FollowJointTrajectory"
OFFER = Offer(
    published={"/joint_states": "sensor_msgs/msg/JointState", "/rosout": "rcl_interfaces/msg/Log"},
    latched=frozenset(),
    received={"/arm/joint_trajectory": "trajectory_msgs/msg/JointTrajectory"},
    actions={"/arm/follow_joint_trajectory": FOLLOW},
    services={"/controller_manager/switch_controller": "controller_manager_msgs/srv/SwitchController"},
    readers=frozenset(),
)


class Peer:
    """A client, the commands that it gives, and what it is answered."""

    def __init__(self) -> None:
        self.commands: deque[Command] = deque()
        rosapi = Rosapi(OFFER, lambda: {"sec": 3, "nanosec": 5})

        def put(command: Command) -> bool:
            self.commands.append(command)
            return True

        services = Services(OFFER, lambda topic: None, rosapi, put, lambda call: call(), lambda: None)
        self.client = Client(1, commands=True, services=services)

    def send(self, **frame: Any) -> list[dict[str, Any]]:
        """The answers to an operation."""
        self.client.receive(json.dumps(frame))
        return self.taken()

    def taken(self) -> list[dict[str, Any]]:
        return [json.loads(text) for text in self.client.outbox.take()]

    def publish(self, topic: str) -> int:
        """How many messages a published one becomes."""
        self.client.outbox.publish(topic, json.dumps({"op": "publish", "topic": topic}), 100.0)
        return len(self.taken())


def test_two_subscriptions_of_a_topic_get_each_message_once_until_the_last_ends() -> None:
    peer = Peer()
    for id_ in ("subscribe:/joint_states:1", "subscribe:/joint_states:2"):
        assert peer.send(op="subscribe", topic="/joint_states", id=id_, type="sensor_msgs/JointState") == []
    assert peer.publish("/joint_states") == 1
    peer.send(op="unsubscribe", topic="/joint_states", id="subscribe:/joint_states:1")
    assert peer.publish("/joint_states") == 1
    peer.send(op="unsubscribe", topic="/joint_states", id="subscribe:/joint_states:2")
    assert peer.publish("/joint_states") == 0
    peer.send(op="unsubscribe", topic="/joint_states")
    peer.send(op="subscribe", topic="/joint_states", id="a")
    peer.send(op="subscribe", topic="/joint_states")
    peer.send(op="unsubscribe", topic="/joint_states")
    assert peer.publish("/joint_states") == 0


def test_a_message_has_the_name_under_which_its_topic_was_subscribed() -> None:
    peer = Peer()
    text = json.dumps({"op": "publish", "topic": "/joint_states", "msg": {}}, separators=(",", ":"))
    for id_, name in (("a", "joint_states"), ("b", "/joint_states")):
        peer.send(op="subscribe", topic=name, id=id_)
    peer.client.outbox.publish("/joint_states", text, 100.0)
    assert {each["topic"] for each in peer.taken()} == {"joint_states", "/joint_states"}


@pytest.mark.parametrize("op", UNSUPPORTED)
def test_an_operation_that_the_server_lacks_is_named_with_what_to_do(op: str) -> None:
    (status,) = Peer().send(op=op, id="7", service="/a", action="/a")
    assert (status["op"], status["level"], status["id"]) == ("status", "error", "7")
    assert status["msg"] == f"op '{op}' is not supported: {UNSUPPORTED[op]}"


def test_what_is_ignored_is_a_warning_for_a_client_that_wants_warnings() -> None:
    peer = Peer()
    frame = {"op": "subscribe", "topic": "/joint_states", "compression": "cbor", "fragment_size": 100, "id": "a"}
    assert peer.send(**frame) == []
    assert peer.send(op="set_level", level="warning", id=None) == []
    assert [each["level"] for each in peer.send(**frame)] == ["warning", "warning"]


def test_a_goal_that_is_refused_has_the_fields_of_rosbridge_and_the_code() -> None:
    peer = Peer()
    goal = {"op": "send_action_goal", "action": "/arm/follow_joint_trajectory", "action_type": FOLLOW, "args": {}}
    assert peer.send(**goal, id="a") == []
    peer.commands.pop().answer(Answer(False, {"error_code": -2, "error_string": "no"}, text="no", status=6))
    (result,) = peer.taken()
    assert result == {
        "op": "action_result", "action": "/arm/follow_joint_trajectory", "values": "INVALID_JOINTS (-2): no",
        "status": 0, "result": False, "error_code": -2, "id": "a",
    }  # fmt: skip
    (unknown,) = peer.send(**{**goal, "args": {"trajectry": {}}}, id="b")
    assert (unknown["status"], unknown["result"]) == (0, False)
    assert "did you mean 'trajectory'?" in unknown["values"]
    assert peer.send(**goal, id="a") == []  # its id is free again


def test_arguments_can_be_a_list_of_the_values_of_the_fields() -> None:
    peer = Peer()
    switch = {"op": "call_service", "service": "controller_manager/switch_controller", "id": "a"}
    assert peer.send(**switch, args=[["arm"], ["hand"], 2]) == []
    request = json.loads(peer.commands.pop().json)
    assert (request["activate_controllers"], request["deactivate_controllers"], request["strictness"]) == (
        ["arm"], ["hand"], 2,
    )  # fmt: skip
    assert "9 args" in peer.send(**switch, args=[0] * 9)[0]["values"]
    (time,) = peer.send(op="call_service", service="rosapi/get_time", id="b")
    assert time["values"] == {"time": {"sec": 3, "nanosec": 5, "secs": 3, "nsecs": 5}}


def test_dropped_messages_are_counted_on_rosout_and_in_a_status() -> None:
    peer = Peer()
    peer.send(op="set_level", level="warning")
    peer.send(op="subscribe", topic="/joint_states", queue_length=2)
    for _ in range(5):
        peer.client.outbox.publish("/joint_states", "{}", 100.0)
    (line,) = peer.client.report_drops()
    message = json.loads(line)
    assert (message["topic"], message["msg"]["level"], message["msg"]["stamp"]) == (
        "/rosout",
        30,
        {"sec": 3, "nanosec": 5},
    )
    assert message["msg"]["msg"] == "client 1: /joint_states: 3 messages were dropped; read faster or throttle"
    assert [each["msg"] for each in peer.taken() if each.get("op") == "status"] == [
        "/joint_states: 3 messages were dropped; read faster or throttle"
    ]
    assert peer.client.report_drops() == []


def test_a_throttled_topic_has_at_most_two_messages_more_than_its_rate_allows() -> None:
    times = np.cumsum(np.random.default_rng(1).exponential(0.007, 2000))
    subscription = Subscription("/a", 0.02, deque(maxlen=1))
    sent = times[[subscription.offer("", now) for now in times]]
    assert len(sent) > 0.9 * times[-1] / 0.02
    for n in range(3, 100):
        assert np.min(sent[n:] - sent[:-n]) > 0.02 * (n - 2)


def test_every_service_that_is_listed_has_a_type_with_a_request_and_a_response() -> None:
    peer = Peer()

    def call(word: str, **args: Any) -> Any:
        (answer,) = peer.send(op="call_service", service=f"/rosapi/{word}", id="a", args=args)
        assert answer["result"] is True, answer
        return answer["values"]

    names = call("services")["services"]
    assert len(names) > 20
    for name in names:
        kind = call("service_type", service=name)["type"]
        assert kind.count("/srv/") == 1, name
        assert name in call("services_for_type", type=kind)["services"]
        for half in ("request", "response"):
            assert call(f"service_{half}_details", type=kind)["typedefs"], name
    for half in ("goal", "feedback", "result"):
        assert call(f"action_{half}_details", type=FOLLOW)["typedefs"][0]["fieldnames"]
    raw = call("topics_and_raw_types")
    assert raw["topics"] == [*OFFER.topics]
    assert raw["typedefs_full_text"][0].startswith("std_msgs/Header header\n")
    described = call("message_details", type="control_msgs/FollowJointTrajectory_Result")["typedefs"][0]
    assert dict(zip(described["constnames"], described["constvalues"], strict=True))["INVALID_JOINTS"] == "-2"
