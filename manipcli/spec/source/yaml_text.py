"""YAML text of plain values, as `ros2 topic echo` prints messages: block style, fields in their order."""

from __future__ import annotations

import yaml

_WIDTH = 1 << 30
"""[characters] Of a line: none is wrapped."""
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def to_yaml(value: object) -> str:
    """The text, without a newline at its end."""
    text = yaml.dump(value, Dumper=_DUMPER, sort_keys=False, allow_unicode=True, width=_WIDTH)
    return text.removesuffix("\n").removesuffix("\n...")
