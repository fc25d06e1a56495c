"""The definitions of ROS's own types are ROS's own."""

from __future__ import annotations

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.record import schemas

STANDARD = (
    schemas.STRING,
    schemas.TF_MESSAGE,
    schemas.JOINT_STATE,
    schemas.WRENCH,
    schemas.LOG,
    schemas.MARKER_ARRAY,
    "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
    "trajectory_msgs/msg/JointTrajectoryPoint",
    schemas.GOAL_STATUS_ARRAY,
    "unique_identifier_msgs/msg/UUID",
)


@pytest.mark.parametrize("name", STANDARD)
def test_definition_has_the_hash_of_the_ros_type(name: str) -> None:
    ours = get_typestore(Stores.EMPTY)
    ours.register(get_types_from_msg(schemas.schema_text(name), name))
    assert ours.hash_rihs01(name) == get_typestore(Stores.ROS2_JAZZY).hash_rihs01(name)


@pytest.mark.parametrize("name", [schemas.CONTROLLER_STATE, schemas.CONTACTS, schemas.TASK_EVENT])
def test_text_defines_every_type_it_uses(name: str) -> None:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schemas.schema_text(name), name))
    assert store.hash_rihs01(name).startswith("RIHS01_")
