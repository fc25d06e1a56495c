"""YAML text of plain values is read back the same, by our parser and by PyYAML."""

from __future__ import annotations

import pytest
import yaml

from manipcli.spec.source.tree import plain
from manipcli.spec.source.yaml import parse
from manipcli.spec.source.yaml_text import to_yaml


@pytest.mark.parametrize(
    "value",
    [
        {"header": {"stamp": {"sec": 0, "nanosec": 5}, "frame_id": ""}, "name": ["a", "on", "1e5", "ü"], "data": []},
        [1.5, -0.0, 1e-300, 12345678901234567890, True, None],
        "x " * 500,
        "two\nlines: {",
        3.0,
        None,
        {},
    ],
)
def test_what_is_written_is_read_back(value: object) -> None:
    text = to_yaml(value)
    assert not text.endswith(("\n", "..."))
    assert yaml.safe_load(text) == value
    node = parse(text, "text")
    assert (None if node is None else plain(node)) == value
