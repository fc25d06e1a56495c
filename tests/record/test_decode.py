"""Messages of any type taken apart: every value where rosbags, which shares no code with us, finds it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.record.cdr import CdrError, CdrWriter
from manipcli.record.decode import runs
from manipcli.record.definition import read_definition
from manipcli.record.foreign.distance import Near, first_difference


def _at(message: Any, path: str) -> Any:
    """What stands at `points[0].positions` of a message of rosbags."""
    value = message
    for word in re.findall(r"\w+", path):
        value = value[int(word)] if word.isdecimal() else getattr(value, word)
    return value


def _messages(path: Path) -> Iterator[tuple[str, str, bytes, Any]]:
    """(type, definition, bytes, what rosbags makes of them) of some messages, and of all contacts."""
    reader = McapReader(path)
    reader.open()
    store = get_typestore(Stores.EMPTY)
    types: dict[str, Any] = {}
    for connection in reader.connections:
        types.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    store.register(types)
    for k, (connection, _, raw) in enumerate(reader.messages(reader.connections)):
        if k < 40 or k % 31 == 0 or connection.topic == "/contacts":
            kind = connection.msgtype
            yield kind, connection.msgdef.data, bytes(raw), store.deserialize_cdr(raw, kind)
    reader.close()


def test_every_value_is_the_one_that_rosbags_finds(make_run: Callable[[int], Any], tmp_path: Path) -> None:
    path = make_run(300).write(tmp_path / "run.mcap")
    kinds = set()
    for kind, text, raw, message in _messages(path):
        kinds.add(kind)
        covered = 0
        for run in runs(read_definition(kind, text), raw):
            value = _at(message, run.path.removesuffix(".#"))
            if run.code == "#":
                assert run.count == len(value)
            elif run.array:
                assert [run.value(raw, k) for k in range(run.count)] == list(value)
            else:
                assert run.value(raw, 0) == value
            covered += run.size
        assert covered > 0.5 * len(raw), "little of a message is anything but values"
    assert len(kinds) >= 7


def test_elements_are_called_by_the_names_beside_them(make_run: Callable[[int], Any], tmp_path: Path) -> None:
    path = make_run(200).write(tmp_path / "run.mcap")
    names: dict[str, set[str]] = {}
    for kind, text, raw, _ in _messages(path):
        found = runs(read_definition(kind, text), raw)
        names[kind] = {run.name(k) for run in found for k in range(run.count if run.array else 1)} | names.get(
            kind, set()
        )
    assert "position[slide]" in names["sensor_msgs/msg/JointState"]
    assert "transforms[cup].transform.rotation.w" in names["tf2_msgs/msg/TFMessage"]
    assert "reference.positions[shoulder]" in names["control_msgs/msg/JointTrajectoryControllerState"]
    assert "contacts[ball+cup].force" in names["manipcli_msgs/msg/Contacts"]
    assert "contacts[cup+robot/wheel].points[2].normal.z" in names["manipcli_msgs/msg/Contacts"]


TEXT = "string[] name\nfloat64[] position\nint32 count\nfloat32[2] pair\n"


def _message(names: list[str], position: list[float], count: int, pair: tuple[float, float]) -> bytes:
    writer = CdrWriter()
    writer.texts(names)
    writer.float64s(np.array(position))
    writer.i32(count)
    for value in pair:
        writer.f32(value)
    return writer.data


def test_the_first_difference_is_the_first_field_that_differs() -> None:
    message = read_definition("a/msg/B", TEXT)
    given = _message(["x", "yy"], [1.0, 2.0], 7, (0.5, 0.25))
    for other, expected in (
        (_message(["x", "zz"], [1.0, 2.0], 7, (0.5, 0.25)), ("name[1]", "yy", "zz")),
        (_message(["x", "yy"], [1.0, 2.5], 8, (0.5, 0.25)), ("position[yy]", 2.0, 2.5)),
        (_message(["x", "yy"], [1.0], 7, (0.5, 0.25)), ("number of position", 2, 1)),
        (_message(["x", "yy"], [1.0, 2.0], 8, (0.5, 0.5)), ("count", 7, 8)),
        (_message(["x", "yy"], [1.0, 2.0], 7, (0.5, -0.25)), ("pair[yy]", 0.25, -0.25)),
        (given, None),
    ):
        assert first_difference(message, given, other) == expected


def test_zeros_of_either_sign_differ_and_nan_is_itself() -> None:
    message = read_definition("a/msg/B", TEXT)
    one, other = (_message([], [zero, np.nan], 0, (np.nan, 0.0)) for zero in (0.0, -0.0))
    assert first_difference(message, one, one) is None
    assert first_difference(message, one, other) == ("position[0]", 0.0, -0.0)
    assert first_difference(message, one, other, tolerance=1e-300) is None


def test_within_a_tolerance_means_numbers_alone_and_by_no_more() -> None:
    """Against the closed form: |a - b| <= tolerance for every number, and all else the same."""
    rng = np.random.default_rng(1)
    near = Near(read_definition("a/msg/B", TEXT), 0.1)
    rows: tuple[list[bytes], list[bytes]] = ([], [])
    expected = []
    for k in range(200):
        names = [["x", "yy"], ["u", "vv"]][k % 2]
        position, shift = rng.normal(size=2), rng.choice([0.0, 0.05, 0.2], size=2, p=[0.6, 0.3, 0.1])
        count, other_count = 3, int(rng.choice([3, 4], p=[0.9, 0.1]))
        other_names = names if rng.random() < 0.9 else ["x", "zz"]
        rows[0].append(_message(names, position.tolist(), count, (1.0, 2.0)))
        rows[1].append(_message(other_names, (position + shift).tolist(), other_count, (1.0, 2.0)))
        expected.append(bool((shift <= 0.1).all()) and other_count == count and other_names == names)
    a, b = (np.frombuffer(b"".join(side), np.uint8).reshape(200, -1) for side in rows)
    assert near.within(a, b).tolist() == expected
    assert 20 < sum(expected) < 180


def test_a_message_that_lies_about_its_length_is_refused() -> None:
    message = read_definition("a/msg/B", TEXT)
    given = bytearray(_message(["x"], [1.0], 7, (0.5, 0.25)))
    for size in (5, 9, len(given) - 1):
        with pytest.raises(CdrError):
            runs(message, bytes(given[:size]))
    given[4:8] = (2**31).to_bytes(4, "little")
    with pytest.raises(CdrError):
        runs(message, bytes(given))
