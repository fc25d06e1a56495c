"""Folders of rosbag2: written ones are read by rosbags, split ones are read whole, hostile ones are refused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.writer import Writer
from rosbags.rosbag2 import Reader

from manipcli.core.errors import InvalidInput
from manipcli.record.channels import TRANSIENT_LOCAL
from manipcli.record.foreign.bag import MAX_FILES, bag_files, write_bag
from manipcli.record.foreign.join import join
from manipcli.record.foreign.topics import open_topics
from manipcli.record.read.chunk import singly

RunCli = Callable[..., Any]
TEXT = {"std_msgs/msg/String": b"string data\n", "std_msgs/msg/Bool": b"bool data\n"}
Sent = tuple[str, int, str]
"""Topic, time [ns], text."""
FIRST: list[Sent] = [("/a", 5, "one"), ("/b", 7, "two"), ("/a", 9, "three")]
SECOND: list[Sent] = [("/b", 11, "four"), ("/c", 12, "five"), ("/a", 13, "six")]


def _cdr(text: str) -> bytes:
    data = text.encode() + b"\0"
    return b"\0\1\0\0" + len(data).to_bytes(4, "little") + data


def _log(path: Path, messages: Sequence[Sent], topics: Sequence[str]) -> Path:
    """A log that declares its topics in this order."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        kind = writer.register_schema("std_msgs/msg/String", "ros2msg", TEXT["std_msgs/msg/String"])
        ids = {
            topic: writer.register_channel(topic, "cdr", kind, {"offered_qos_profiles": TRANSIENT_LOCAL})
            for topic in topics
        }
        for k, (topic, time, text) in enumerate(messages):
            writer.add_message(ids[topic], time, _cdr(text), time, k)
        writer.finish()
    return path


def _sent(path: Path) -> list[Sent]:
    topics = open_topics(path)
    return sorted(
        ((topic, ns, reader.text()) for topic, data, places in topics.messages(topics.all)
         for ns, reader in singly(data, places)),
        key=lambda sent: sent[1],
    )  # fmt: skip


@pytest.fixture
def split(tmp_path: Path) -> Path:
    """A bag of two parts that number their topics differently."""
    bag = tmp_path / "bag"
    bag.mkdir()
    _log(bag / "bag_0.mcap", FIRST, ["/a", "/b"])
    _log(bag / "bag_1.mcap", SECOND, ["/c", "/b", "/a"])
    _describe(bag, ["bag_0.mcap", "bag_1.mcap"])
    return bag


def _describe(bag: Path, files: object, **more: object) -> None:
    top = {"version": 5, "storage_identifier": "mcap", "relative_file_paths": files, **more}
    (bag / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": top}))


def test_a_written_bag_is_read_by_rosbags(tmp_path: Path) -> None:
    log = _log(tmp_path / "run.mcap", FIRST, ["/a", "/b", "/silent"])
    write_bag(log, tmp_path / "bag")
    with Reader(tmp_path / "bag") as reader:
        assert (reader.start_time, reader.end_time - 1, reader.message_count) == (5, 9, 3)
        assert {name: (topic.msgtype, topic.msgcount) for name, topic in reader.topics.items()} == {
            "/a": ("std_msgs/msg/String", 2), "/b": ("std_msgs/msg/String", 1), "/silent": ("std_msgs/msg/String", 0)
        }  # fmt: skip
        assert {profile.durability.name for one in reader.connections for profile in one.ext.offered_qos_profiles} == {
            "TRANSIENT_LOCAL"
        }
        assert [(one.topic, time, data) for one, time, data in reader.messages()] == [
            (topic, time, _cdr(text)) for topic, time, text in FIRST
        ]
    assert (tmp_path / "bag/bag_0.mcap").read_bytes() == log.read_bytes()


def test_the_parts_of_a_bag_are_one_log(split: Path, tmp_path: Path) -> None:
    join(bag_files(split), tmp_path / "whole.mcap")
    assert _sent(tmp_path / "whole.mcap") == [*FIRST, *SECOND]
    assert open_topics(tmp_path / "whole.mcap").all["/a"].count == 3
    assert not [*tmp_path.glob("*.partial")]


def test_every_command_that_reads_a_log_reads_a_bag(split: Path, tmp_path: Path, call_cli: RunCli) -> None:
    assert "/c" in call_cli("info", split, cwd=tmp_path).out
    assert "/a" in call_cli("graph", "bag", cwd=tmp_path).out
    assert call_cli("diff", split, split, cwd=tmp_path).code == 0
    again = call_cli("export", "bag", "--rosbag2", "again", cwd=tmp_path)
    assert again.code == 0, again.err
    assert _sent(tmp_path / "again/again_0.mcap") == [*FIRST, *SECOND]


def test_a_part_that_breaks_off_before_the_last_is_refused(split: Path, tmp_path: Path) -> None:
    whole = (split / "bag_0.mcap").read_bytes()
    (split / "bag_0.mcap").write_bytes(whole[:-40])
    with pytest.raises(InvalidInput, match="a part before the last one is incomplete"):
        join(bag_files(split), tmp_path / "whole.mcap")
    assert not [*tmp_path.glob("whole*")]


@pytest.mark.parametrize(
    ("files", "text"),
    [
        (["../secret.mcap"], "'../secret.mcap' is not a file of this folder"),
        (["/etc/passwd"], "'/etc/passwd' is not a file of this folder"),
        (["bag/../../secret.mcap"], "is not a file of this folder"),
        ([".."], "'..' is not a file of this folder"),
        (["bag_0.mcap\0"], "is not a file of this folder"),
        ([7], "is not a file of this folder"),
        (["link.mcap"], "'link.mcap' is a link to another folder"),
        (["bag_9.mcap"], "'bag_9.mcap' does not exist"),
        ([], f"expected 1 to {MAX_FILES} files"),
        ("bag_0.mcap", f"expected 1 to {MAX_FILES} files"),
        (["bag_0.mcap"] * (MAX_FILES + 1), f"expected 1 to {MAX_FILES} files"),
    ],
)
def test_a_bag_names_files_of_its_own_folder(split: Path, files: object, text: str) -> None:
    (split.parent / "secret.mcap").write_bytes((split / "bag_0.mcap").read_bytes())
    (split / "link.mcap").symlink_to(split.parent / "secret.mcap")
    _describe(split, files)
    with pytest.raises(InvalidInput) as refused:
        bag_files(split)
    (finding,) = refused.value.findings
    assert text in finding.message
    assert finding.place is not None and finding.place.line > 0


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "LOG310"),
        ("rosbag2_bagfile_information: &a [*a]\n", "YAML109"),
        ("a: &a [1, 1]\n" + "".join(f"{x}: &{x} [*{y}, *{y}, *{y}, *{y}, *{y}, *{y}, *{y}, *{y}, *{y}]\n"
                                  for x, y in zip("bcdefgh", "abcdefg", strict=True)), "YAML107"),
        ("#" * 10_000_001, "YAML103"),
        ("rosbag2_bagfile_information: !!python/object/apply:os.system [id]\n", "YAML104"),
        ("rosbag2_bagfile_information: {storage_identifier: sqlite3}\n", "LOG311"),
        ("rosbag2_bagfile_information: {storage_identifier: mcap, compression_mode: FILE}\n", "LOG311"),
        ("rosbag2_bagfile_information: {storage_identifier: [mcap]}\n", "LOG311"),
    ],
)  # fmt: skip
def test_hostile_metadata_is_refused(split: Path, text: str, code: str) -> None:
    (split / "metadata.yaml").write_text(text)
    with pytest.raises(InvalidInput) as refused:
        bag_files(split)
    assert code in {finding.code for finding in refused.value.findings}


def test_an_unfinished_log_is_not_a_bag(tmp_path: Path) -> None:
    log = _log(tmp_path / "run.mcap", FIRST, ["/a", "/b"])
    log.write_bytes(log.read_bytes()[:-30])
    with pytest.raises(InvalidInput, match="incomplete"):
        write_bag(log, tmp_path / "bag")
    assert not (tmp_path / "bag").exists()
