"""Line breaks in XML written on one line."""

from __future__ import annotations

import re
from typing import Final

WIDTH: Final = 100
"""Elements that are longer have their children on lines of their own."""


def broken(xml: str, *, width: int = WIDTH, indent: str = "") -> str:
    """An element, its children on lines of their own if it is longer than `width`; only white space is added."""
    found = re.fullmatch(r"(<[^>]+>)(<.*>)(</[^>]+>)", xml)
    if found is None or len(indent + xml) <= width:
        return indent + xml
    head, inside, tail = found.groups()
    lines = [broken(child, indent=indent + "  ") for child in _children(inside)]
    return "\n".join([indent + head, *lines, indent + tail])


def _children(xml: str) -> list[str]:
    """The elements side by side in `xml`; what is not closed is one."""
    children, depth, begin = [], 0, 0
    for tag in re.finditer(r"<[^>]+>", xml):
        if tag[0].startswith("</"):
            depth -= 1
        elif not tag[0].endswith("/>"):
            depth += 1
        if depth == 0:
            children.append(xml[begin : tag.end()])
            begin = tag.end()
    return [*children, xml[begin:]] if xml[begin:] else children
