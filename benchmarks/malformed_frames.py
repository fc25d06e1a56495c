"""Frames that are not valid commands of the rosbridge protocol, for fuzzing the server of a live session."""

from __future__ import annotations

import json
import random
from collections.abc import Mapping
from typing import Any, Final

GOAL: Final = "/arm_controller/follow_joint_trajectory"
TRAJECTORY: Final = "/arm_controller/joint_trajectory"
JUNK: Final[tuple[Any, ...]] = (
    None, True, -1, 1e308, 2**70, "", "x" * 300, "\0", [], {}, [[]], {"a": [1]}, "NaN", "\ud800", "/tf\n", 10**400,
    "/" * 5000, ["a"] * 300, {"x": {"y": {}}},
)  # fmt: skip
OPS: Final = (
    "advertise", "unadvertise", "unsubscribe", "subscribe", "publish", "call_service", "send_action_goal",
    "cancel_action_goal", "set_level", "fragment", "png", "auth", "status", "action_result", "service_response",
)  # fmt: skip


def malformed(draw: random.Random, trajectory: Mapping[str, Any]) -> str | bytes:
    """A frame; `trajectory`: a valid message of `TRAJECTORY`, to be damaged."""
    text = json.dumps(_operation(draw, json.loads(json.dumps(trajectory))))
    match draw.randrange(10):
        case 0:
            return text[: draw.randrange(len(text))] + "{"
        case 1:
            return draw.choice(["[", '{"op":']) * draw.choice([40, 3000, 100_000])
        case 2:
            return draw.randbytes(draw.randrange(1, 200))
        case 3:
            number = draw.choice(["NaN", "-Infinity", "1e999", "0x10", "01", "1" * 5000])
            return f'{{"op":"publish","topic":"{TRAJECTORY}","msg":{{"points":[{{"positions":[{number}]}}]}}}}'
        case 4:
            return '{"op":"subscribe","topic":"/nothing","x":[' + "0," * draw.choice([10, 50_000]) + "0]}"
    return text


def _operation(draw: random.Random, trajectory: dict[str, Any]) -> object:
    def some() -> Any:
        return draw.choice(JUNK)

    point = trajectory["points"][0]
    point["positions"][draw.randrange(len(point["positions"]))] = draw.choice([None, True, "1", [], {}, 10**400])
    keys = ("topic", "service", "action", "type", "msg", "args", "id", "level", "throttle_rate", "x" * 300)
    choices: list[Any] = [
        some(),
        {"op": some()},
        {"op": draw.choice(OPS), **{key: some() for key in draw.sample(keys, draw.randrange(len(keys)))}},
        {"op": "advertise", "topic": TRAJECTORY, "type": draw.choice(["std_msgs/String", 1, [], "x" * 400])},
        {"op": "publish", "topic": some(), "msg": some()},
        {"op": "publish", "topic": TRAJECTORY, "msg": trajectory},
        {"op": "publish", "topic": TRAJECTORY, "msg": {"points": {"positions": [0]}, "joint_names": some()}},
        {"op": "publish", "topic": TRAJECTORY, "msg": {"joint_names": ["a"] * 200_100}},
        {"op": "subscribe", "topic": some(), "throttle_rate": some(), "queue_length": some()},
        {"op": "subscribe", "topic": "/tf", "throttle_rate": draw.choice([-1, "x", [], 1e308, None])},
        {"op": "call_service", "service": some(), "args": some(), "id": some()},
        {"op": "call_service", "service": "/rosapi/topic_type", "args": some(), "id": some()},
        {"op": "call_service", "service": "/controller_manager/switch_controller", "args": {"strictness": "x"}},
        {"op": "send_action_goal", "action": GOAL, "id": draw.choice([None, 1, "", [], "x" * 999]), "args": {}},
        {"op": "send_action_goal", "action": GOAL, "id": "z", "args": {"trajectory": some() or 0}},
        {"op": "cancel_action_goal", "action": some(), "id": some()},
        {"op": "set_level", "level": some()},
    ]
    return draw.choice(choices)
