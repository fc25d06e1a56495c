"""Folders of rosbag2: `metadata.yaml` beside its MCAP files (github.com/ros2/rosbag2, rosbag2_storage)."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import listed, shorten
from manipcli.core.whole_file import whole_file, write_whole
from manipcli.record.faults import REPAIRABLE, BadRecording
from manipcli.record.foreign.topics import Topic, Topics, open_topics
from manipcli.record.read.scan import readable
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode
from manipcli.spec.source.yaml import MAX_BYTES, parse
from manipcli.spec.source.yaml_text import to_yaml

METADATA: Final = "metadata.yaml"
TOP: Final = "rosbag2_bagfile_information"
VERSION: Final = 5
"""Of the metadata that is written: that of ROS 2 Humble, which later distributions read, too."""
MAX_FILES: Final = 1000
"""Most files of one bag."""
_CONVERT = "convert it: `ros2 bag convert`, with `storage_id: mcap` and no compression for its output"


def write_bag(log: Path, folder: Path) -> Topics:
    """Writes a finished log as a bag, its bytes unchanged, and returns its contents.

    Raises:
        BadRecording: not an MCAP file, unfinished or damaged, or with messages that are not of ROS 2.
        OSError: the folder cannot be written.
    """
    topics = open_topics(log)
    if topics.lost is not None:
        raise BadRecording(log, f"incomplete: {topics.lost}; `ros2 bag` refuses it", hint=REPAIRABLE)
    others = [topic.name for topic in topics.all.values() if topic.encoding != "cdr"]
    if others:
        raise BadRecording(log, f"not only messages of ROS 2: {listed(others, most=3)}")
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{folder.resolve().name}_0.mcap"
    with readable(log), log.open("rb") as source, whole_file(folder / name) as partial, partial.open("wb") as target:
        shutil.copyfileobj(source, target, 1 << 20)
    write_whole(folder / METADATA, _metadata(topics, name).encode())
    return topics


def _metadata(topics: Topics, name: str) -> str:
    span: dict[str, object] = {
        "duration": {"nanoseconds": topics.end - topics.start},
        "starting_time": {"nanoseconds_since_epoch": topics.start},
        "message_count": topics.count,
    }
    return (
        to_yaml(
            {
                TOP: {
                    "version": VERSION,
                    "storage_identifier": "mcap",
                    **span,
                    "topics_with_message_count": [_topic(topic) for topic in topics.all.values()],
                    "compression_format": "",
                    "compression_mode": "",
                    "relative_file_paths": [name],
                    "files": [{"path": name, **span}],
                }
            }
        )
        + "\n"
    )


def _topic(topic: Topic) -> Mapping[str, object]:
    about = {
        "name": topic.name,
        "type": topic.type,
        "serialization_format": "cdr",
        "offered_qos_profiles": topic.qos,
    }
    return {"topic_metadata": about, "message_count": topic.count}


def bag_files(folder: Path) -> tuple[Path, ...]:
    """The MCAP files of a bag, in their order.

    The metadata is of unknown origin: files outside the folder are refused.

    Raises:
        InvalidInput: the metadata is missing or invalid, or a file is missing or in a format that is not read.
    """
    where = folder / METADATA
    if not where.is_file():
        logs = sorted(path.name for path in folder.glob("*.mcap"))
        hint = f"its logs: {listed(logs, most=3)}" if logs else "expected an .mcap file, or the folder of a bag"
        raise BadRecording(folder, f"a folder without {METADATA}", hint=hint)
    with readable(where), where.open("rb") as file:
        root = parse(file.read(MAX_BYTES + 1), str(where))
    top = _child(root, TOP)
    if not isinstance(top, MappingNode):
        place = Place(str(where), 1, 1)
        raise InvalidInput([Diagnostic("LOG310", f"expected the key '{TOP}' of rosbag2", place)])
    _check_format(top)
    paths = _child(top, "relative_file_paths")
    items = paths.items if isinstance(paths, SequenceNode) else ()
    if not items or len(items) > MAX_FILES:
        place = paths.place if paths is not None else top.place
        message = f"expected 1 to {MAX_FILES} files in relative_file_paths, got {len(items)}"
        raise InvalidInput([Diagnostic("LOG310", message, place)])
    return tuple(_file(folder, item) for item in items)


def _child(node: Node | None, key: str) -> Node | None:
    return node.get(key) if isinstance(node, MappingNode) else None


def _check_format(top: MappingNode) -> None:
    """
    Raises:
        InvalidInput: another storage than MCAP, or compressed by rosbag2 itself.
    """
    storage = _child(top, "storage_identifier")
    if not (isinstance(storage, ScalarNode) and storage.value == "mcap"):
        kind = shorten(str(storage.value)) if isinstance(storage, ScalarNode) else ""
        message = f"storage '{kind}' of rosbag2 is not read; expected 'mcap'"
        raise InvalidInput([Diagnostic("LOG311", message, (storage or top).place, hint=_CONVERT)])
    mode = _child(top, "compression_mode")
    if isinstance(mode, ScalarNode) and str(mode.value or "none").lower() != "none":
        message = (
            f"a bag with compression_mode '{shorten(str(mode.value))}' is not read; MCAP compresses its chunks itself"
        )
        raise InvalidInput([Diagnostic("LOG311", message, mode.place, hint=_CONVERT)])


def _file(folder: Path, item: Node) -> Path:
    """
    Raises:
        InvalidInput: not a file of this folder.
    """
    name = item.value if isinstance(item, ScalarNode) and isinstance(item.value, str) else ""
    # Before ROS 2 Foxy the paths began with the name of the folder.
    parts = PurePosixPath(name).parts
    inside = parts[1:] if len(parts) == 2 and parts[0] == folder.resolve().name else parts
    if len(inside) != 1 or inside[0] in ("..", "/") or "\0" in name:
        message = f"'{shorten(name)}' is not a file of this folder"
        raise InvalidInput([Diagnostic("LOG310", message, item.place, hint="a bag holds its files itself")])
    path = folder / inside[0]
    if not path.is_file() or path.resolve().parent != folder.resolve():
        what = "is a link to another folder" if path.exists() else "does not exist"
        raise InvalidInput([Diagnostic("LOG310", f"'{shorten(name)}' {what}", item.place)])
    return path
