"""Messages of cameras in hostile logs: every cut and every changed byte is read or refused, never more."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from manipcli.logs.camera_messages import POINTS, read_camera_info, read_cloud, read_rows
from manipcli.logs.sensed_messages import COMPRESSED, IMAGE
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.replay.pixels import Unshown

TYPES = get_typestore(Stores.ROS2_HUMBLE)


def _cloud(points: np.ndarray, words: np.ndarray) -> bytes:
    """A PointCloud2 with x, y, z and rgb, written by rosbags."""
    Field, Cloud = TYPES.types["sensor_msgs/msg/PointField"], TYPES.types[POINTS]
    Header, Time = TYPES.types["std_msgs/msg/Header"], TYPES.types["builtin_interfaces/msg/Time"]
    rows = [struct.pack("<fffI", *point, word) for point, word in zip(points.tolist(), words.tolist(), strict=True)]
    message = Cloud(
        header=Header(stamp=Time(sec=0, nanosec=0), frame_id="eye"), height=1, width=len(rows),
        fields=[Field(name=name, offset=4 * k, datatype=7, count=1) for k, name in enumerate(("x", "y", "z", "rgb"))],
        is_bigendian=False, point_step=16, row_step=16 * len(rows),
        data=np.frombuffer(b"".join(rows), np.uint8), is_dense=False,
    )  # fmt: skip
    return bytes(TYPES.serialize_cdr(message, POINTS))


def test_points_without_a_number_are_left_out_with_their_colours() -> None:
    points = np.array([[1.0, 2.0, 3.0], [np.nan, 0.0, 0.0], [4.0, 5.0, 6.0]])
    frame, cloud = read_cloud(CdrReader(_cloud(points, np.array([0xFF0000, 0x00FF00, 0x0102FF]))))
    assert frame == "eye"
    np.testing.assert_array_equal(cloud.points, points[[0, 2]])
    np.testing.assert_array_equal(cloud.colours, [[255, 0, 0], [1, 2, 255]])


@pytest.mark.parametrize("kind", ["cloud", "info", IMAGE, COMPRESSED])
def test_no_bytes_are_read_beyond_the_message(kind: str) -> None:
    sound = _cloud(np.ones((4, 3)), np.arange(4))
    order = random.Random(1)
    for _ in range(2000):
        data = bytearray(sound)
        for _ in range(order.randint(1, 4)):
            data[order.randrange(4, len(data))] = order.choice([0, 1, 7, 127, 255])
        reader = CdrReader(bytes(data[: order.randint(4, len(data))]))
        try:
            if kind == "cloud":
                _, found = read_cloud(reader)
                assert len(found.points) <= len(data)
            elif kind == "info":
                _, lens = read_camera_info(reader)
                assert lens.fx > 0.0
            else:
                read_rows(reader, kind, labels=False)
        except (CdrError, Unshown):
            continue
