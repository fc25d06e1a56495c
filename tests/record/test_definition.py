"""Schemas of any ROS 2 log as types: what rosbags reads from the same text, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.record import schemas
from manipcli.record.definition import Array, Message, Number, Text, UnknownDefinition, read_definition

ODD = """
# a comment with = and [] in it
int32 X=1
string NAME="a # b"
float64[<=3] bounded
string<=10 short
uint8[4] fixed 1
bool flag true
builtin_interfaces/Time when
Inner[] inner
================================================================================
MSG: some_msgs/Inner
char letter  # behind a field
int64[] many
"""


def _shape(message: Message) -> list[tuple[str, str]]:
    return [(one.name, _kind(one.type)) for one in message.fields]


def _kind(kind: object) -> str:
    match kind:
        case Number():
            return kind.name
        case Text():
            return "string"
        case Message():
            return kind.name
        case Array():
            return f"{_kind(kind.element)}[{'' if kind.length is None else kind.length}]"
    raise AssertionError(kind)


def test_every_kind_of_line_is_read() -> None:
    message = read_definition("some_msgs/msg/Odd", ODD)
    assert _shape(message) == [
        ("bounded", "float64[]"),
        ("short", "string"),
        ("fixed", "uint8[4]"),
        ("flag", "bool"),
        ("when", "builtin_interfaces/Time"),
        ("inner", "some_msgs/Inner[]"),
    ]
    assert [one.code for one in (Number("char"), Number("float32"), Number("int64"))] == ["|u1", "<f4", "<i8"]


STANDARD = [schemas.MARKER_ARRAY, schemas.CONTROLLER_STATE, schemas.TF_MESSAGE, schemas.JOINT_STATE, schemas.LOG]


@pytest.mark.parametrize("name", STANDARD)
def test_fields_are_those_that_rosbags_finds_in_the_text(name: str) -> None:
    types = get_types_from_msg(schemas.schema_text(name), name)
    message = read_definition(name, schemas.schema_text(name))
    _, fields = types[name]
    assert [one.name for one in message.fields] == [field for field, _ in fields]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("Inner a\n", "type 'Inner'"),
        ("A a\n" + "=" * 80 + "\nMSG: p/A\nB b\n" + "=" * 80 + "\nMSG: p/B\nA a\n", "contains itself"),
        ("float64\n", "is not a field"),
        ("float64 1st\n", "is not a field"),
        ("wstring w\n", "wstring"),
        ("int32 a\n" * 5000, "more than"),
        ("#" * (1 << 21), "longer"),
        ("int32 a\n" + "=" * 80 + "\nnothing\n", "MSG:"),
    ],
)
def test_what_is_no_definition_is_refused(text: str, says: str) -> None:
    with pytest.raises(UnknownDefinition, match=says):
        read_definition("p/msg/Root", text)


def test_types_that_double_with_each_level_cost_nothing() -> None:
    levels = [f"{'=' * 80}\nMSG: p/L{k}\nL{k + 1} a\nL{k + 1} b\n" for k in range(20)]
    text = "L0 root\n" + "".join(levels) + f"{'=' * 80}\nMSG: p/L20\nfloat64 x\n"
    assert read_definition("p/Root", text).fields[0].name == "root"


@pytest.mark.slow
def test_all_of_jazzy_is_read() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    read = 0
    for name in list(store.types):
        text, _ = store.generate_msgdef(name, ros_version=2)
        if "wstring" not in text:
            message = read_definition(name, text)
            assert [one.name for one in message.fields] == [
                field for field, _ in store.get_msgdef(name).fields if field != "structure_needs_at_least_one_member"
            ]
            read += 1
    assert read > 150
    assert np.dtype(Number("uint16").code).itemsize == Number("uint16").size == 2
