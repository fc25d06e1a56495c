"""The written files: YAML that reads back, with the evidence as comments."""

from __future__ import annotations

import yaml

from manipcli.onboard.writer import Entry, checks, written

ENTRIES = {
    "robot": Entry("a b"),
    "poses": Entry({"home": Entry({"arm": [0.0, -1e-05, 2.5]}, "best of 10 " * 30), "off": Entry({"arm": "home"})}),
    "limits": Entry({"j": Entry({"velocity": 2.0}, "no value", True)}, "all"),
    "pairs": Entry([["a", "b"], ["c", "d"]]),
}


def test_a_reader_gets_the_values_and_nothing_else() -> None:
    assert yaml.safe_load(written(ENTRIES, head=["one", "two"])) == {
        "robot": "a b",
        "poses": {"home": {"arm": [0.0, -1e-05, 2.5]}, "off": {"arm": "home"}},
        "limits": {"j": {"velocity": 2.0}},
        "pairs": [["a", "b"], ["c", "d"]],
    }


def test_comments_are_above_their_values_and_lines_are_short() -> None:
    lines = written(ENTRIES).splitlines()
    k = next(k for k, line in enumerate(lines) if line.strip().startswith("j:"))
    assert lines[k - 1].strip() == "# CHECK: no value"
    assert max(map(len, lines)) <= 120


def test_values_to_look_at_are_listed_with_their_path() -> None:
    assert checks(ENTRIES) == [("limits.j", "no value")]
