"""JSON of messages: what is read back from CDR is what was written; complete messages stay; bad fields are named."""

from __future__ import annotations

import json
import math

import pytest

from manipcli.record.cdr import CdrWriter
from manipcli.record.json_message import BadMessage, definition, from_json, to_json
from manipcli.record.schemas import DEFINITIONS

POINT = definition("trajectory_msgs/JointTrajectoryPoint")


@pytest.mark.parametrize("name", sorted(DEFINITIONS))
def test_the_empty_message_of_every_type_is_complete_and_json(name: str) -> None:
    kind = definition(name)
    empty = from_json(kind, {})
    assert from_json(kind, json.loads(json.dumps(empty))) == empty


def test_a_joint_state_in_cdr_is_its_json() -> None:
    writer = CdrWriter()
    writer.header(1_500_000_000, "base")
    writer.texts(["a", "b"])
    writer.u32(2)
    writer.f64s([0.1, math.nan])
    writer.u32(0)
    writer.u32(0)
    found = to_json(definition("sensor_msgs/msg/JointState"), writer.data)
    assert found == {
        "header": {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "base"},
        "name": ["a", "b"], "position": [0.1, None], "velocity": [], "effort": [],
    }  # fmt: skip


def test_octets_are_base64_or_a_list() -> None:
    kind = definition("unique_identifier_msgs/UUID")
    octets = [*range(16)]
    assert from_json(kind, {"uuid": "AAECAwQFBgcICQoLDA0ODw=="}) == from_json(kind, {"uuid": octets})
    writer = CdrWriter()
    writer.octets(bytes(octets))
    assert to_json(kind, writer.data) == {"uuid": "AAECAwQFBgcICQoLDA0ODw=="}


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ([], "is a list; expected an object"),
        ({"position": [1]}, "no field 'position'; did you mean 'positions'?"),
        ({"positions": 1}, "positions is 1; expected a list"),
        ({"positions": [0, "1"]}, r"positions\[1\] is '1'; expected a number"),
        ({"positions": [True]}, r"positions\[0\] is true"),
        ({"positions": [None]}, r"positions\[0\] is null"),
        ({"positions": [1e999]}, "finite"),
        ({"positions": [10**400]}, "finite"),
        ({"time_from_start": {"sec": 1.5}}, "time_from_start.sec is 1.5; expected a whole number"),
        ({"time_from_start": {"sec": 2**31}}, "expected a whole number"),
        ({"positions": [0] * 200_001}, "more than 200000 values"),
    ],
)
def test_a_bad_field_is_named(value: object, words: str) -> None:
    with pytest.raises(BadMessage, match=words):
        from_json(POINT, value)


def test_times_of_ros_1_are_times() -> None:
    assert from_json(POINT, {"time_from_start": {"secs": 2, "nsecs": 5}})["time_from_start"] == {"sec": 2, "nanosec": 5}
