"""Fields of messages by their paths, and messages as lines of CSV."""

from __future__ import annotations

import csv

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.report.message_fields import CsvTable, FieldPath, columns

MESSAGE = {"header": {"stamp": {"sec": 3}}, "name": ["a, b", 'c"d'], "position": [0.1, None], "ok": True, "points": []}


@pytest.mark.parametrize(
    ("path", "value"),
    [("header.stamp.sec", 3), ("name[1]", 'c"d'), ("position", [0.1, None]), ("header", {"stamp": {"sec": 3}})],
)
def test_a_path_names_a_field_or_an_element(path: str, value: object) -> None:
    assert FieldPath(path).of(MESSAGE) == value


@pytest.mark.parametrize(
    ("path", "code", "text"),
    [
        ("positio", "USE161", "did you mean 'position'?"),
        ("position[2]", "USE161", "'position' has 2 elements"),
        ("ok[0]", "USE161", "'ok' is not a list"),
        ("ok.sec", "USE161", "'ok' has no field 'sec'"),
        ("", "USE160", "not the path"),
        ("[0]", "USE160", "not the path"),
        ("a..b", "USE160", "not the path"),
        ("position[-1]", "USE160", "not the path"),
    ],
)
def test_a_wrong_path_is_refused(path: str, code: str, text: str) -> None:
    with pytest.raises(InvalidInput) as raised:
        FieldPath(path).of(MESSAGE)
    (found,) = raised.value.findings
    assert found.code == code
    assert text in f"{found.message} {found.hint}"


def test_the_lines_of_a_table_are_read_back_by_the_names_of_the_first() -> None:
    table = CsvTable()
    lines = [*table.lines(MESSAGE), *table.lines({**MESSAGE, "position": [1e-300, 2]})]
    first, second = csv.DictReader(lines)
    assert list(first) == [name for name, _ in columns(MESSAGE)]
    assert (first["name[0]"], first["name[1]"], first["ok"], first["position[1]"]) == ("a, b", 'c"d', "true", "")
    assert (float(second["position[0]"]), second["position[1]"]) == (1e-300, "2")


def test_a_message_of_another_length_does_not_fit_the_table() -> None:
    table = CsvTable("points")
    table.lines([1, 2])
    with pytest.raises(InvalidInput, match=r"points\[2\]"):
        table.lines([1, 2, 3])
