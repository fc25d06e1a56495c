"""YAML 1.2 parser that returns a tree with places.

PyYAML only splits the text into events. Its resolver and constructors, which other libraries extend for the whole
process, are not used: plain scalars follow the core schema of YAML 1.2 (`1e-3` is a number, `on` a string, `010` ten,
`12:30` a string), and no file can name code.

| code | mistake |
|---|---|
| YAML100 | the text is not YAML: quotes, brackets, indentation, tabs |
| YAML101 | not UTF-8 |
| YAML102 | a control character |
| YAML103 | the file is larger than 10 MB |
| YAML104 | a `!tag` |
| YAML105 | more than one document |
| YAML106 | a duplicate key in a mapping; in a file of ROS 2, a node's second block, which is merged |
| YAML107 | more than 100,000 values, aliases expanded |
| YAML108 | nested deeper than 64 |
| YAML109 | an alias to an unknown anchor, or to an anchor around it |
| YAML110 | a key that is not a string |
| YAML111 | infinity, not-a-number, or a number out of range |
| YAML112 | a merge key `<<` without a mapping |
"""

from __future__ import annotations

import codecs
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

import yaml

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import shorten
from manipcli.spec.source.tree import (
    Entry,
    MappingNode,
    Node,
    Scalar,
    ScalarNode,
    SequenceNode,
    clashes,
    has_parameters,
    merged,
)

MAX_BYTES = 10_000_000
MAX_NODES = 100_000
MAX_DEPTH = 64

_CONTROL = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]|\ufeff")
_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_NULL = re.compile(r"~|null|Null|NULL|")
_TRUE, _FALSE = re.compile(r"true|True|TRUE"), re.compile(r"false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+")
_BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NOT_FINITE = re.compile(_INFINITE.pattern + r"|\.(nan|NaN|NAN)")
_LONGEST_NUMBER = 400


def parse(data: bytes | str, name: str, *, ros: bool = False, reported: list[Diagnostic] | None = None) -> Node | None:
    """Parses one YAML document; None if it holds only comments.

    Args:
        data: bytes or text of the file.
        name: name of the file in places.
        ros: accept what files of ROS have: `.inf` as a number, for "no limit"; and duplicate keys of blocks with
            `ros__parameters`, which are merged.
        reported: list that receives the errors of single keys and values, which are then not raised. An invalid number
            is then null, and the first of duplicate keys is used.

    Raises:
        InvalidInput: with all findings up to the first syntax error.
    """
    if len(data) > MAX_BYTES:
        raise _refusal("YAML103", f"the file is larger than {MAX_BYTES // 1_000_000} MB", Place(name, 1, 1))
    text = _decode(data, name) if isinstance(data, bytes) else data
    text = text.removeprefix("\ufeff")
    control = _CONTROL.search(text)
    if control is not None:
        message = f"control character U+{ord(control.group()):04X}"
        hint = "remove it, or write it as an escape in double quotes"
        raise _refusal("YAML102", message, _place_at(text, control.start(), name), hint)
    composer = _Composer(name=name, text=text, ros=ros)
    try:
        try:
            root = composer.document(_events(text))
        except yaml.YAMLError as error:
            if _UNSPACED not in str(getattr(error, "problem", "")):
                raise
            composer = _Composer(name=name, text=text, ros=ros)
            root = composer.document(yaml.parse(text, Loader=yaml.BaseLoader))
    except yaml.YAMLError as error:
        if not isinstance(error, _Limit):
            composer.findings.append(_syntax_finding(error, text, name))
        raise InvalidInput(composer.findings) from None
    if reported is None and any(finding.severity == "error" for finding in composer.findings):
        raise InvalidInput(composer.findings)
    if reported is not None:
        reported += composer.findings
    return root


def _refusal(code: str, message: str, place: Place, hint: str | None = None) -> InvalidInput:
    return InvalidInput([Diagnostic(code, message, place, hint=hint)])


def _decode(data: bytes, name: str) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, codecs.BOM_UTF32_BE)) or b"\0" in data[:4]:
        message = "the file is not UTF-8 but looks like UTF-16 or UTF-32"
        raise _refusal("YAML101", message, Place(name, 1, 1), "save it as UTF-8: iconv -f utf-16 -t utf-8")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8").removeprefix("\ufeff")
        hint = "the file looks like latin-1; save it as UTF-8: iconv -f latin1 -t utf-8"
        if b"\0" in data:
            hint = "this is a binary file, not YAML"
        message = f"the byte 0x{data[error.start]:02x} is not UTF-8"
        raise _refusal("YAML101", message, _place_at(before, len(before), name), hint) from None


def _place_at(text: str, index: int, name: str) -> Place:
    line, begin = 1, 0
    for match in _BREAK.finditer(text, 0, index):
        line, begin = line + 1, match.end()
    return Place(name, line, index - begin + 1)


_UNSPACED = "found unexpected ':'"
"""libyaml refuses `{joints:['a']}`, which PyYAML's own scanner reads as `{joints: ['a']}`."""


def _events(text: str) -> Iterator[yaml.Event]:
    """Events of PyYAML's parser: libyaml if the wheel has it, else pure Python."""
    return yaml.parse(text, Loader=yaml.CBaseLoader if yaml.__with_libyaml__ else yaml.BaseLoader)


_CLEARER: tuple[tuple[str, str, str | None], ...] = (
    ("tab", "a tab in the indentation", "indent with spaces"),
    ("mapping values are not allowed", "unexpected ':'", "quote the text, or check the line above it"),
    ("did not find expected ',' or ']'", "a '[' is not closed, or a ',' is missing", None),
    ("did not find expected ',' or '}'", "a '{' is not closed, or a ',' is missing", None),
    ("found unexpected end of stream", "a quote is not closed", None),
    ("did not find expected key", "this line does not fit the indentation above it", "align it with its neighbours"),
    ("did not find expected '-'", "this line does not fit the list above it", "list items begin with '- '"),
    ("could not find expected ':'", "a key without ':'", "write `key: value`"),
)


def _syntax_finding(error: yaml.YAMLError, text: str, name: str) -> Diagnostic:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    problem = getattr(error, "problem", None) or getattr(error, "context", None) or "not readable as YAML"
    line, column = (mark.line, mark.column) if mark is not None else (0, 0)
    lines = _BREAK.split(text)
    excerpt = lines[line] if line < len(lines) else ""
    if "maximum nesting depth" in problem:  # libyaml's own limit, which it may reach before the limit here is seen
        return Diagnostic("YAML108", f"nested deeper than {MAX_DEPTH}", Place(name, line + 1, column + 1))
    if "cannot start any token" in problem:
        character = excerpt[column : column + 1]
        if character == "\t":
            problem = "tab"
        else:
            message = f"'{shorten(character)}' cannot begin a value"
            return _syntax(message, "quote the text", excerpt, Place(name, line + 1, column + 1))
    opened = getattr(error, "context_mark", None)
    for words, message, hint in _CLEARER:
        if words not in problem:
            continue
        if "not closed" in message and opened is not None:
            if not excerpt.strip():
                line, column = opened.line, opened.column
                excerpt = lines[line]
            else:
                message += f" (it opens at line {opened.line + 1}, column {opened.column + 1})"
        if message == "unexpected ':'" and line > 0 and _is_deeper(excerpt, lines[line - 1]):
            hint = "indent this line as the line above it, which has a value already; or quote the text"
        return _syntax(message, hint, excerpt, Place(name, line + 1, column + 1))
    return _syntax(problem, None, excerpt, Place(name, line + 1, column + 1))


def _is_deeper(line: str, above: str) -> bool:
    """Whether a line with a key is indented deeper than the key of the line above, which has a value."""
    key, upper = (re.match(r"(\s*(?:- +)*)[\w$-]+:(?: +(\S))?", each) for each in (line, above))
    return key is not None and upper is not None and upper[2] is not None and len(key[1]) > len(upper[1])


def _syntax(message: str, hint: str | None, excerpt: str, place: Place) -> Diagnostic:
    near = f", in: {shorten(excerpt.strip())}" if excerpt.strip() else ""
    return Diagnostic("YAML100", f"{message}{near}", place, hint=hint)


@dataclass(frozen=True, slots=True)
class _Composed:
    """A node with its number of values and its depth, for limits on aliases."""

    node: Node
    count: int
    height: int


class _Limit(yaml.YAMLError):
    """Stops parsing; its finding is already in the list."""


@dataclass(slots=True)
class _Composer:
    name: str
    text: str
    ros: bool
    findings: list[Diagnostic] = field(default_factory=list)
    anchors: dict[str, _Composed | None] = field(default_factory=dict)
    nodes: int = 0

    def document(self, events: Iterator[yaml.Event]) -> Node | None:
        root: Node | None = None
        documents = 0
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self.stop(
                        "YAML105", "a second document in one file", event, "remove '---': a file holds one document"
                    )
            elif isinstance(event, yaml.NodeEvent):
                composed = self.node(event, events, depth=1)
                root = composed.node
        return None if isinstance(root, ScalarNode) and root.value is None else root

    def node(self, event: yaml.Event, events: Iterator[yaml.Event], *, depth: int) -> _Composed:
        if depth > MAX_DEPTH:
            self.stop("YAML108", f"nested deeper than {MAX_DEPTH}", event)
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event, depth)
        self.count(1, event)
        tag = getattr(event, "tag", None)
        if tag is not None:
            self.report(
                "YAML104",
                f"the tag '{shorten(tag.replace('tag:yaml.org,2002:', '!!'))}' is not allowed",
                event,
                "remove the tag; quote a value to make it a string",
            )
        anchor = getattr(event, "anchor", None)
        if anchor is not None:
            self.anchors[anchor] = None
        if isinstance(event, yaml.MappingStartEvent):
            composed = self.mapping(event, events, depth)
        elif isinstance(event, yaml.SequenceStartEvent):
            composed = self.sequence(event, events, depth)
        else:
            assert isinstance(event, yaml.ScalarEvent)
            composed = _Composed(ScalarNode(self.scalar(event), self.place(event)), 1, 1)
        if anchor is not None:
            self.anchors[anchor] = composed
        return composed

    def alias(self, event: yaml.AliasEvent, depth: int) -> _Composed:
        anchor = str(event.anchor)
        if anchor not in self.anchors:
            self.stop("YAML109", f"the alias '*{shorten(anchor)}' has no anchor before it", event)
        target = self.anchors[anchor]
        if target is None:
            self.stop("YAML109", f"the alias '*{shorten(anchor)}' is inside its own anchor", event)
        if depth + target.height - 1 > MAX_DEPTH:
            self.stop("YAML108", f"nested deeper than {MAX_DEPTH} once the alias is expanded", event)
        self.count(target.count, event)
        return target

    def sequence(self, event: yaml.Event, events: Iterator[yaml.Event], depth: int) -> _Composed:
        items: list[_Composed] = []
        for inner in events:
            if isinstance(inner, yaml.SequenceEndEvent):
                break
            items.append(self.node(inner, events, depth=depth + 1))
        node = SequenceNode(tuple(item.node for item in items), self.place(event))
        return self.composed(node, items)

    def mapping(self, event: yaml.Event, events: Iterator[yaml.Event], depth: int) -> _Composed:
        entries: dict[str, Entry] = {}
        merged: dict[str, Entry] = {}
        merge_place: Place | None = None
        parts: list[_Composed] = []
        for key_event in events:
            if isinstance(key_event, yaml.MappingEndEvent):
                break
            key, key_place = self.key(key_event, events, depth), self.place(key_event)
            value_event = next(events)
            value = self.node(value_event, events, depth=depth + 1)
            parts.append(value)
            if key == "<<" and getattr(key_event, "implicit", (False,))[0]:
                if merge_place is not None:
                    self.duplicate("<<", key_place, merge_place)
                merge_place = key_place
                self.merge(value.node, merged, value_event)
            elif key is not None and key in entries and self.ros and has_parameters(entries[key].node, value.node):
                entries[key] = self.joined(key, entries[key], Entry(key_place, value.node))
            elif key is not None and key in entries:
                self.duplicate(key, key_place, entries[key].key_place)
            elif key is not None:
                entries[key] = Entry(key_place, value.node)
        for key, entry in merged.items():
            entries.setdefault(key, entry)
        return self.composed(MappingNode(entries, self.place(event)), parts)

    def joined(self, key: str, first: Entry, second: Entry) -> Entry:
        """The parameters of two blocks of one ROS node; of a parameter in both, the second counts, as in rclcpp."""
        assert isinstance(first.node, MappingNode) and isinstance(second.node, MappingNode)
        message = f"'{shorten(key)}' occurs at lines {first.key_place.line} and {second.key_place.line}: merged"
        self.findings.append(Diagnostic("YAML106", message, second.key_place, severity="note"))
        for path, old, new in clashes(first.node, second.node):
            message = f"'{shorten('.'.join(path))}' is given at lines {old.line} and {new.line}: the last one counts"
            self.findings.append(Diagnostic("YAML106", message, new, severity="warning"))
        return Entry(first.key_place, merged(first.node, second.node))

    def key(self, event: yaml.Event, events: Iterator[yaml.Event], depth: int) -> str | None:
        """The key as written (`010:` and `on:` are strings); None, with a finding, if it is not a string."""
        composed = self.node(event, events, depth=depth + 1)
        if isinstance(composed.node, ScalarNode) and isinstance(event, yaml.ScalarEvent):
            if event.value or not event.implicit[0]:
                return str(event.value)
            self.report("YAML110", "a key is missing before ':'", event)
        else:
            self.report("YAML110", "a key must be a string", event, "an alias, a list or a mapping cannot be a key")
        return None

    def merge(self, node: Node, merged: dict[str, Entry], event: yaml.Event) -> None:
        sources = node.items if isinstance(node, SequenceNode) else (node,)
        for source in sources:
            if not isinstance(source, MappingNode):
                self.report("YAML112", "'<<' needs a mapping or a list of mappings", event, "write `<<: *anchor`")
                return
            for key, entry in source.entries.items():
                merged.setdefault(key, entry)

    def scalar(self, event: yaml.ScalarEvent) -> Scalar:
        """A scalar by the core schema of YAML 1.2."""
        text = str(event.value)
        if not event.implicit[0]:
            return text
        if _NULL.fullmatch(text):
            return None
        if _TRUE.fullmatch(text) or _FALSE.fullmatch(text):
            return bool(_TRUE.fullmatch(text))
        whole, based = _INT.fullmatch(text), _BASED.fullmatch(text)
        number = int(text, 0 if based else 10) if (whole or based) and len(text) <= _LONGEST_NUMBER else None
        if number is not None and abs(number) <= sys.float_info.max:
            return number
        if self.ros and _INFINITE.fullmatch(text):
            return -math.inf if text.startswith("-") else math.inf
        if _NOT_FINITE.fullmatch(text):
            self.report("YAML111", f"'{text}' is not a finite number", event, "write a finite number")
            return None
        if whole or based or _FLOAT.fullmatch(text):
            value = math.inf if len(text) > _LONGEST_NUMBER or number is not None else float(text)
            if math.isfinite(value):
                return value
            self.report("YAML111", f"'{shorten(text, width=24)}' exceeds the largest number, 1.8e308", event)
            return None
        return text

    def composed(self, node: Node, parts: list[_Composed]) -> _Composed:
        height = 1 + max((part.height for part in parts), default=0)
        return _Composed(node, 1 + sum(part.count for part in parts), height)

    def count(self, more: int, event: yaml.Event) -> None:
        self.nodes += more
        if self.nodes > MAX_NODES:
            self.stop("YAML107", f"more than {MAX_NODES:,} values, aliases expanded", event)

    def place(self, event: yaml.Event) -> Place:
        mark = event.start_mark
        assert mark is not None
        return Place(self.name, mark.line + 1, mark.column + 1)

    def duplicate(self, key: str, second: Place, first: Place) -> None:
        message = f"duplicate key '{shorten(key)}': lines {first.line} and {second.line}"
        self.findings.append(Diagnostic("YAML106", message, second, hint="remove one of them"))

    def report(self, code: str, message: str, event: yaml.Event, hint: str | None = None) -> None:
        self.findings.append(Diagnostic(code, message, self.place(event), hint=hint))

    def stop(self, code: str, message: str, event: yaml.Event, hint: str | None = None) -> NoReturn:
        self.report(code, message, event, hint)
        raise _Limit
