"""YAML text of plain values, as `ros2 topic echo` prints messages: block style, fields in their order."""

from __future__ import annotations

import re
from typing import Final

import yaml

_WIDTH: Final = 1 << 30
"""[characters] Of a line: none is wrapped."""
_NUMBER: Final = re.compile(r"[-+]?(\.?\d[\d.]*([eE][-+]?\d+)?|0[ox][\da-fA-F]+)")
"""Texts that YAML 1.2 reads as numbers; PyYAML leaves `1e5` without quotes."""


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes without anchors."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    style = "'" if _NUMBER.fullmatch(value) else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


_Dumper.add_representer(str, _text)


def to_yaml(value: object) -> str:
    """The text, without a newline at its end."""
    text = yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=_WIDTH)
    return text.removesuffix("\n").removesuffix("\n...")
