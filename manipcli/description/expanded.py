"""A description file (URDF or xacro) as one expanded tree of located elements."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.dom import minidom

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, shorten
from manipcli.description.located_xml import Element, element_of, invalid, parse_document, read_document
from manipcli.description.packages import Packages, Unread

XACRO_NAMESPACES = ("http://www.ros.org/wiki/xacro", "http://ros.org/wiki/xacro", "http://wiki.ros.org/xacro")


_USES = re.compile(r"<xacro:|\sxacro:|\$\{|\$\(")
"""An element, an attribute or an expression of xacro."""


@dataclass(frozen=True, slots=True)
class Description:
    """`root`: the expanded <robot> element; `packages` resolves the files it names; `findings`: warnings.

    `expanded`: the file is xacro, so its elements may come from macros and other files.
    """

    path: Path
    root: Element
    packages: Packages
    findings: tuple[Diagnostic, ...]
    expanded: bool = False


def read_description(
    path: Path,
    *,
    packages: Packages,
    arguments: Mapping[str, str | int | float | bool] = {},
    allow_env: Collection[str] = (),
) -> Description:
    """Reads and expands a description.

    Args:
        path: URDF or xacro; xacro is recognised by the suffix, or by the namespace of its root element and its use.
        packages: finds the packages and files it names.
        arguments: for `<xacro:arg>`.
        allow_env: environment variables that `$(env NAME)` and `$(optenv NAME)` may read.

    Raises:
        InvalidInput: with file, line and column.
    """
    document = read_document(path)
    declared = _declares_xacro(document)
    uses = declared and _USES.search(path.read_text(encoding="utf-8", errors="replace")) is not None
    findings: tuple[Diagnostic, ...] = ()
    expanded = path.suffix == ".xacro" or uses
    if expanded:
        from manipcli.description.xacro.expand import expand

        words = {name: argument_text(value) for name, value in arguments.items()}
        document, findings = expand(path, words, packages, allow_env=allow_env)
    elif arguments and not declared:
        raise takes_no_arguments(path, arguments)
    assert document.documentElement is not None  # a document without a root element is not well-formed
    root = element_of(document.documentElement)
    if root.tag != "robot":
        raise _other_format(root)
    return Description(path=path, root=root, packages=packages, findings=findings, expanded=expanded)


def _declares_xacro(document: minidom.Document) -> bool:
    top = document.documentElement
    return top is not None and any(value in XACRO_NAMESPACES for _, value in top.attributes.items())


def is_plain(path: Path) -> bool:
    """Whether this is readable plain URDF, which takes no arguments."""
    try:
        return path.suffix != ".xacro" and not _declares_xacro(read_document(path))
    except InvalidInput:
        return False


def unread_description(urdf: bytes, name: str) -> Description:
    """An expanded description whose files are never read, as in a log; messages call it `name`.

    Raises:
        InvalidInput: it is not valid XML.
    """
    root = parse_document(urdf, name).documentElement
    assert root is not None  # a document without a root element is not well-formed
    return Description(path=Path(name), root=element_of(root), packages=Unread(), findings=())


_FORMATS = {
    "sdf": "SDF",
    "world": "SDF",
    "model": "SDF",
    "mujoco": "MJCF",
    "mujocoinclude": "MJCF",
    "COLLADA": "a Collada mesh",
    "package": "the manifest of a ROS package",
    "launch": "a launch file",
}
"""Other formats by their root element."""


def _other_format(root: Element) -> InvalidInput:
    known = _FORMATS.get(root.tag)
    if known is None:
        message = f"the root element is <{shorten(root.tag)}>; expected <robot>"
        return invalid("URDF002", message, root.place, did_you_mean(root.tag, ["robot"]))
    hint = "convert it to URDF first" if known in {"SDF", "MJCF"} else None
    return invalid("URDF002", f"this is {known}, not URDF: the root element is <{shorten(root.tag)}>", root.place, hint)


def argument_text(value: str | int | float | bool) -> str:
    """An argument as the text that xacro expects: `true`, `0.1`, `text`."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def takes_no_arguments(path: Path, arguments: Mapping[str, object]) -> InvalidInput:
    """The error for arguments of a plain URDF file."""
    return invalid("XACRO003", f"'{path.name}' is plain URDF and takes no arguments; given: {', '.join(arguments)}")
