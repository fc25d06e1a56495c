"""Numbers over time from any ROS 2 log: the same that rosbags reads, and bounds on what a log may ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.record.cdr import CdrError
from manipcli.record.decode import runs
from manipcli.record.definition import read_definition
from manipcli.record.faults import BadRecording
from manipcli.record.foreign.field_units import unit_of
from manipcli.record.foreign.repair import repair
from manipcli.record.foreign.series import Series, Wanted, leaves, read_series
from manipcli.record.foreign.topic_fields import FieldName, UnknownField, parse_field, ways
from manipcli.record.foreign.topics import open_topics
from manipcli.record.read.scan import Scan
from manipcli.record.records import CHUNK, MESSAGE_INDEX

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
MakeRun = Callable[[int], Any]


def series(path: Path, text: str, **between: float) -> dict[str, Series]:
    """The series of one field by their labels."""
    topics, name = open_topics(path), parse_field(text)
    topic = topics.all[name.topic]
    message = read_definition(topic.type, topic.definition)
    found = ways(message, name)
    assert len(found) == 1
    ((every),) = read_series(topics, [Wanted(topic.name, message, found[0])], **between)
    return {one.label: one for one in every}


def write(
    path: Path, messages: Iterable[tuple[int, str, str, Any]], *, chunked: bool = True, store: Any = STORE
) -> Path:
    """A log as another ROS 2 program writes it: (time [ns], topic, type, message or its bytes)."""
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=chunked, chunk_size=4096, compression=CompressionType.LZ4)
        writer.start(profile="ros2", library="somebody")
        channels: dict[str, int] = {}
        for ns, topic, kind, message in messages:
            if topic not in channels:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            data = message if isinstance(message, bytes) else bytes(store.serialize_cdr(message, kind))
            writer.add_message(channels[topic], ns, data, ns)
        writer.finish()
    return path


def header(ns: int) -> Any:
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id="base")


def joint_state(ns: int, names: list[str], position: list[float]) -> Any:
    none = np.zeros(0)
    kind = TYPES["sensor_msgs/msg/JointState"]
    return kind(header=header(ns), name=names, position=np.array(position), velocity=none, effort=none)


@pytest.fixture
def log(tmp_path: Path, make_run: MakeRun) -> Path:
    path: Path = make_run(703).write(tmp_path / "run.mcap")
    return path


def by_rosbags(path: Path, topic: str) -> list[tuple[float, Any]]:
    store = get_typestore(Stores.EMPTY)
    reader = McapReader(path)
    reader.open()
    mine = [one for one in reader.connections if one.topic == topic]
    store.register(get_types_from_msg(mine[0].msgdef.data, mine[0].msgtype))
    found = [(time / 1e9, store.deserialize_cdr(raw, c.msgtype)) for c, time, raw in reader.messages(mine)]
    reader.close()
    return found


def test_joints_are_the_numbers_that_rosbags_reads(log: Path) -> None:
    for field, take in (("position", lambda m: m.position), ("velocity", lambda m: m.velocity)):
        ours = series(log, f"joint_states.{field}")
        theirs = by_rosbags(log, "/joint_states")
        assert list(ours) == list(theirs[0][1].name)
        for k, one in enumerate(ours.values()):
            assert one.times.tolist() == [time for time, _ in theirs]
            assert one.values.tolist() == [take(message)[k] for _, message in theirs]


def test_names_of_joints_stand_above_the_points_of_a_controller(log: Path) -> None:
    ours = series(log, "arm/controller_state.reference.positions[slide]")
    theirs = by_rosbags(log, "/arm/controller_state")
    k = theirs[0][1].joint_names.index("slide")
    assert list(ours) == ["slide"]
    assert ours["slide"].values.tolist() == [message.reference.positions[k] for _, message in theirs]


def test_an_element_is_found_by_its_name_and_fields_below_it_without_their_way(log: Path) -> None:
    ours = series(log, "tf[cup].translation.z")
    theirs = [
        one.transform.translation.z
        for _, message in by_rosbags(log, "/tf")
        for one in message.transforms
        if one.child_frame_id == "cup"
    ]
    assert ours["cup"].values.tolist() == theirs
    assert series(log, "tf.transforms[cup].transform.translation.z")["cup"].values.tolist() == theirs
    assert series(log, "tf.translation.z[cup]")["cup"].values.tolist() == theirs


def test_who_touches_no_more_has_no_value(log: Path) -> None:
    ours = series(log, "contacts.force")
    theirs = by_rosbags(log, "/contacts")
    assert set(ours) == {"cup+robot/wheel", "cup+desk", "ball+cup"}
    for label, one in ours.items():
        expected = [
            next(
                (contact.force for contact in message.contacts if {contact.a, contact.b} == set(label.split("+"))), None
            )
            for _, message in theirs
        ]
        assert [None if np.isnan(value) else value for value in one.values.tolist()] == expected
        assert None in expected
    assert list(series(log, "contacts.force[cup+ball]")) == ["ball+cup"]
    assert set(series(log, "contacts[cup].force")) == set(ours)


@pytest.mark.parametrize("field", ["position.x", "normal.z", "force", "friction.y"])
def test_points_are_named_by_their_contact_and_number(log: Path, field: str) -> None:
    ours = series(log, f"contacts.points.{field}")
    theirs = by_rosbags(log, "/contacts")
    assert list(ours) == ["ball+cup 0", "cup+robot/wheel 0", "cup+robot/wheel 1", "cup+robot/wheel 2"]
    for label, one in ours.items():
        pair, k = label.split()
        expected = [
            next((attrgetter(field)(c.points[int(k)]) for c in message.contacts if f"{c.a}+{c.b}" == pair), np.nan)
            for _, message in theirs
        ]
        np.testing.assert_array_equal(one.values, expected)
    assert list(series(log, f"contacts[robot/wheel].points[1].{field}")) == ["cup+robot/wheel 1"]


@pytest.mark.parametrize("start", [0.0, 0.1, 0.15, 0.2, 0.25, 0.35])
def test_a_contact_that_holds_when_the_window_opens_is_in_it(log: Path, start: float) -> None:
    """What is known at each time of the window is what is known without it."""
    whole, part = series(log, "contacts.force"), series(log, "contacts.force", start=start, end=start + 0.12)
    for time in np.linspace(start, start + 0.12, 7):
        for label, one in whole.items():
            expected = one.values[np.searchsorted(one.times, time, side="right") - 1]
            mine = part.get(label)
            found = np.nan if mine is None else mine.values[np.searchsorted(mine.times, time, side="right") - 1]
            np.testing.assert_equal(found, expected)
    assert all(one.times[0] >= start for one in part.values())
    assert not series(log, "contacts.force", start=100.0)


def test_only_the_asked_time_is_read(log: Path) -> None:
    whole = series(log, "joint_states.position[spin]")["spin"]
    part = series(log, "joint_states.position[spin]", start=0.1, end=0.2)["spin"]
    inside = (whole.times >= 0.1) & (whole.times <= 0.2)
    assert part.values.tolist() == whole.values[inside].tolist()
    assert 0 < len(part.values) < len(whole.values)


def test_a_log_without_its_end_is_read_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    whole = series(log, "joint_states.position[spin]")["spin"]
    cut = tmp_path / "cut.mcap.partial"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size * 17 // 20])
    assert open_topics(cut).lost is not None
    part = series(cut, "joint_states.position[spin]")["spin"]
    assert 0 < len(part.values) < len(whole.values)
    assert part.values.tolist() == whole.values[: len(part.values)].tolist()


@pytest.mark.parametrize("chunked", [True, False])
def test_joints_that_come_in_another_order_each_time_keep_their_names(tmp_path: Path, chunked: bool) -> None:
    rng = np.random.default_rng(3)
    names = ["aa", "bb", "cc"]
    messages, expected = [], []
    for k in range(300):
        order = rng.permutation(3)
        values = rng.normal(size=3)
        # Same length, other names: only the letters say which number is whose.
        message = joint_state(k, [names[j] for j in order], [values[j] for j in order])
        messages.append((5 * 10**9 + k * 10**7, "/robot/joint_states", "sensor_msgs/msg/JointState", message))
        expected.append(values)
    path = write(tmp_path / "log.mcap", messages, chunked=chunked)
    ours = series(path, "robot/joint_states.position")
    assert set(ours) == set(names)
    for k, name in enumerate(names):
        assert ours[name].values.tolist() == [values[k] for values in expected]
        assert ours[name].times[:3].tolist() == [0.0, 0.01, 0.02]  # since the first message


def test_other_types_of_ros_are_read_by_their_schema_alone(tmp_path: Path) -> None:
    vector = TYPES["geometry_msgs/msg/Vector3"]
    wrench = TYPES["geometry_msgs/msg/Wrench"]
    kind = TYPES["geometry_msgs/msg/WrenchStamped"]
    image = TYPES["sensor_msgs/msg/Image"]
    messages = []
    for k in range(20):
        ns = 10**18 + k * 10**8
        sample = wrench(force=vector(x=k, y=-k, z=0.5), torque=vector(x=0.1 * k, y=0, z=1))
        messages.append((ns, "/wrench", "geometry_msgs/msg/WrenchStamped", kind(header=header(ns), wrench=sample)))
        pixels = np.arange(6000, dtype=np.uint8) + k
        shot = image(header=header(ns), height=60, width=100, encoding="mono8", is_bigendian=0, step=100, data=pixels)
        messages.append((ns, "/camera", "sensor_msgs/msg/Image", shot))
    path = write(tmp_path / "log.mcap", messages)
    assert series(path, "wrench.force.y")[""].values.tolist() == [-float(k) for k in range(20)]
    stamps = series(path, "wrench.header.stamp")[""].values
    assert stamps == pytest.approx(1e9 + 0.1 * np.arange(20))
    assert series(path, "camera.height")[""].values.tolist() == [60.0] * 20
    assert series(path, "camera.data[-1]")["5999"].values.tolist() == [(5999 + k) % 256 for k in range(20)]
    with pytest.raises(BadRecording, match="select some with brackets"):
        series(path, "camera.data")


def test_bytes_that_are_not_what_the_schema_says_are_refused(tmp_path: Path) -> None:
    good = bytes(STORE.serialize_cdr(joint_state(0, ["a"], [1.0]), "sensor_msgs/msg/JointState"))
    # Header: stamp 8, length 4, "base" and NUL 5, padding 3: the number of names is at 24.
    huge = good[:24] + (2**31).to_bytes(4, "little") + good[28:]
    for k, damaged in enumerate((good[:30], huge, b"\0\3\0\0" + good[4:], b"")):
        message = (0, "/joint_states", "sensor_msgs/msg/JointState", damaged)
        path = write(tmp_path / f"{k}.mcap", [message])
        with pytest.raises(BadRecording, match=r"/joint_states: a message of sensor_msgs/JointState"):
            series(path, "joint_states.position")


@pytest.mark.parametrize(("size", "lost"), [(4_000_000, False), (1 << 26, True)])
def test_an_image_of_one_colour_is_packed_well_and_not_damaged(tmp_path: Path, size: int, lost: bool) -> None:
    """Ten thousand times smaller; what is too large for the reader is told as that."""
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="somebody")
        text = b"uint8[] data\nfloat64 x"
        channel = writer.register_channel("/image", "cdr", writer.register_schema("p/msg/Image", "ros2msg", text))
        for k in range(2):
            writer.add_message(channel, k, b"\0\1\0\0" + size.to_bytes(4, "little") + bytes(size + 12), k)
        writer.finish()
    faults = open_topics(path, damaged=True).faults
    if not lost:
        assert not faults
        assert repair(path, tmp_path / "again.mcap").messages_lost == 0
        (found,) = series(path, "image.x").values()
        assert len(found.times) == 2
        return
    assert all(f"the limit is {size}" in one and "damaged" not in one for one in faults)
    assert len(faults) == 2
    with pytest.raises(BadRecording, match="the limit is"):
        series(path, "image.x")


def test_a_message_of_millions_of_parts_is_not_walked_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manipcli.record.decode.MAX_RUNS", 100_000)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("p/Nothing[] parts\nfloat64 x", "p/msg/Many"))
    store.register(get_types_from_msg("", "p/msg/Nothing"))
    data = b"\0\1\0\0" + (5_000_000).to_bytes(4, "little") + bytes(5_000_008)
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD, chunk_size=1 << 20)
        writer.start(profile="ros2", library="somebody")
        text = "p/Nothing[] parts\nfloat64 x\n" + "=" * 80 + "\nMSG: p/Nothing\n"
        channel = writer.register_channel(
            "/many", "cdr", writer.register_schema("p/msg/Many", "ros2msg", text.encode())
        )
        writer.add_message(channel, 0, data, 0)
        writer.finish()
    with pytest.raises(BadRecording, match=r"too many parts"):
        series(path, "many.x")


def test_messages_that_differ_each_time_are_walked_only_so_far(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("manipcli.record.foreign.series.MAX_DECODED", 200)
    messages = [
        (k, "/joint_states", "sensor_msgs/msg/JointState", joint_state(k, [f"j{k:03}"], [1.0])) for k in range(100)
    ]
    with pytest.raises(BadRecording, match="a different layout in too many messages"):
        series(write(tmp_path / "log.mcap", messages), "joint_states.position")


def test_a_message_with_any_bytes_changed_is_read_or_refused(log: Path) -> None:
    rng = np.random.default_rng(8)
    topics = open_topics(log)
    kept: dict[str, bytes] = {}
    for name, data, places in topics.messages(set(topics.all)):
        start = int(places.starts[0])
        kept.setdefault(name, data[start : start + int(places.lengths[0])])
    read = refused = 0
    for name, good in kept.items():
        message = read_definition(topics.all[name].type, topics.all[name].definition)
        try:
            found = ways(message, FieldName(name, name, None, ()))
        except UnknownField:
            continue
        for _ in range(40):
            bad = bytearray(good)
            for k in rng.integers(4, len(bad), 3):
                new = (b"\xff\xff\xff\x7f", bytes(4), rng.bytes(1), b"")[int(rng.integers(4))]
                bad[k : k + len(new)] = new
                del bad[k : k + (len(new) == 0)]
            try:
                result = leaves(runs(message, bytes(bad)), found[int(rng.integers(len(found)))])
            except CdrError:
                refused += 1
                continue
            assert all(leaf.offset + int(leaf.code[-1]) <= len(bad) for leaf in result)
            read += bool(result)
    assert read > 50 and refused > 50


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "says", "hint"),
    [
        ("joint_states.positon", "no field 'positon'", "did you mean 'position'?"),
        ("joint_states.position.x", "no field 'x'", "fields"),
        ("tf.z", "is in several fields", "translation.z"),
        ("task/events", "no number", "fields"),
        ("joint_states.header.stamp[a]", "'stamp' is not an array", None),
        ("", "is not a field", "TOPIC.FIELD"),
        ("tf[", "is not a field", "TOPIC.FIELD"),
        ("tf[].x", "is not a field", "TOPIC.FIELD"),
        ("tf..x", "is not a field", "TOPIC.FIELD"),
    ],
)
def test_a_field_that_is_not_there_is_told(log: Path, text: str, says: str, hint: str | None) -> None:
    with pytest.raises(UnknownField, match=says.replace("[", r"\[")) as told:
        series(log, text)
    assert (hint or "") in (told.value.hint or "")


def test_units_follow_the_joint_and_the_place(log: Path) -> None:
    topics = open_topics(log)
    joints = {"slide": "m", "spin": "rad"}

    def unit(text: str, label: str = "") -> str:
        name = parse_field(text)
        topic = topics.all[name.topic]
        return unit_of(ways(read_definition(topic.type, topic.definition), name)[0], label, joints)

    assert [unit("joint_states.position", one) for one in ("slide", "spin", "other")] == ["m", "rad", ""]
    assert [unit("joint_states.effort", one) for one in ("slide", "spin")] == ["N", "N m"]
    assert unit("arm/controller_state.reference.accelerations", "spin") == "rad/s²"
    assert unit("tf[cup].translation.x") == "m"
    assert unit("tf[cup].rotation.w") == ""
    assert unit("contacts.force") == "N"
    assert unit("contacts.points.force") == unit("contacts.points.friction.x") == "N"
    assert unit("contacts.points.position.x") == "m"
    assert unit("contacts.points.normal.x") == ""
    assert unit("joint_states.header.stamp") == "s"


def test_a_log_that_is_cut_within_the_indexes_of_a_chunk_keeps_all_messages_of_it(log: Path, tmp_path: Path) -> None:
    """Some of the indexes are there and say nothing of the topics whose index is lost."""
    records = list(Scan(log))
    first = max(k for k, record in enumerate(records) if record.opcode == CHUNK) + 1
    assert [record.opcode for record in records[first : first + 2]] == [MESSAGE_INDEX] * 2
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: records[first].end])
    kept = open_topics(cut).all["/joint_states"].count
    last = series(cut, "joint_states.position")["shoulder"]
    assert len(last.times) == kept == open_topics(log).all["/joint_states"].count
