"""Data-flow graph of a task or a log: a tree for a terminal, a flowchart for Mermaid, JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Final, Literal

from manipcli.core.text import escape
from manipcli.report.json import Json, dumps

Kind = Literal["task", "planner", "controller", "limits", "drive", "engine", "sensor", "robot", "scene", "topic"]
GraphFormat = Literal["text", "mermaid", "json"]

_BRACKETS: Final[Mapping[Kind, tuple[str, str]]] = {
    "engine": ("[[", "]]"),
    "sensor": ("[/", "/]"),
    "topic": ("([", "])"),
}
"""Brackets of a label in Mermaid, which set the shape of a node; other kinds are rectangles."""
_SAID: Final = ("task", "controller", "engine", "robot", "scene")
"""Kinds whose name is shown with the kind."""


@dataclass(frozen=True, slots=True)
class Node:
    """A node of the data-flow graph.

    Attributes:
        id: unique id.
        kind: kind of the node.
        name: shown name.
        type: message type of a topic.
        details: short facts.
        items: further lines, such as the steps of a task.
        idle: whether it is inactive at the start.
    """

    id: str
    kind: Kind
    name: str
    type: str = ""
    details: tuple[str, ...] = ()
    items: tuple[str, ...] = ()
    idle: bool = False

    @property
    def title(self) -> str:
        """Its name, with its kind if the name alone is unclear."""
        return f"{self.kind} {self.name}" if self.kind in _SAID else self.name

    @property
    def facts(self) -> tuple[str, ...]:
        """The type without its package, and the details."""
        return (self.type.rpartition("/")[2], *self.details) if self.type else self.details


@dataclass(frozen=True, slots=True)
class Edge:
    """Data `label` from `source` to `target`; `idle`: not at the start; `back`: feedback, such as measurements."""

    source: str
    target: str
    label: str = ""
    idle: bool = False
    back: bool = False


@dataclass(frozen=True, slots=True)
class Graph:
    """Nodes in the order of the data flow, and edges between them."""

    name: str
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    notes: tuple[str, ...] = ()


def render(graph: Graph, kind: GraphFormat) -> str:
    """The graph in one of its formats."""
    return {"text": render_text, "mermaid": render_mermaid, "json": render_json}[kind](graph)


def render_text(graph: Graph) -> str:
    """A tree: each node is below its first source; below further sources it is `->` and its name."""
    nodes = {node.id: node for node in graph.nodes}
    feeder: dict[str, Edge] = {}
    for edge in graph.edges:
        feeder.setdefault(edge.target, edge)
    shown: set[str] = set()

    def below(node: Node, edge: Edge | None, first: str, rest: str) -> Iterator[str]:
        by = f"  <- {edge.label}" if edge is not None and edge.label else ""
        if edge is not None and feeder[node.id] is not edge:
            yield f"{first}-> {node.title}{by}"
            return
        shown.add(node.id)
        about = f"  ({', '.join(node.facts)})" if node.facts else ""
        yield f"{first}{node.title}{about}{by}"
        out = [feed for feed in graph.edges if feed.source == node.id]
        for item in node.items:
            yield f"{rest}{'│ ' if out else '  '}{item}"
        for k, feed in enumerate(out):
            branch, more = ("└─ ", "   ") if k == len(out) - 1 else ("├─ ", "│  ")
            if feed.target in shown and feeder[feed.target] is feed:
                yield f"{rest}{branch}-> {nodes[feed.target].title}"  # closes a cycle
            else:
                yield from below(nodes[feed.target], feed, rest + branch, rest + more)

    lines = [f"note: {note}" for note in graph.notes]
    for node in graph.nodes:
        if node.id not in feeder:
            lines += below(node, None, "", "")
    for node in graph.nodes:
        if node.id not in shown:  # in a cycle without a source
            lines += below(node, None, "", "")
    return "\n".join(lines)


def render_mermaid(graph: Graph) -> str:
    """A Mermaid flowchart, which code hosts render in Markdown."""
    numbers = {node.id: f"n{k}" for k, node in enumerate(graph.nodes)}
    lines = ["flowchart LR"]
    for node in graph.nodes:
        left, right = _BRACKETS.get(node.kind, ("[", "]"))
        label = "<br/>".join(map(_mermaid, _label(node)))
        lines.append(f'  {numbers[node.id]}{left}"{label}"{right}')
    for edge in graph.edges:
        arrow = "-.->" if edge.idle else "-->"
        about = f'|"{_mermaid(edge.label)}"|' if edge.label else ""
        lines.append(f"  {numbers[edge.source]} {arrow}{about} {numbers[edge.target]}")
    idle = [numbers[node.id] for node in graph.nodes if node.idle]
    if idle:
        lines += ["  classDef idle stroke-dasharray: 4 3", f"  class {','.join(idle)} idle"]
    return "\n".join(lines)


def _mermaid(text: str) -> str:
    """Text with numeric entities for all characters that Mermaid can read as markup."""
    return "".join(
        character if character.isalnum() or character in " _-./,:()=…→+" else f"#{ord(character)};"
        for character in escape(text)
    )


def _label(node: Node) -> tuple[str, ...]:
    return (node.title, *node.facts, *node.items)


def render_json(graph: Graph) -> str:
    """Nodes and edges as one JSON object."""
    nodes: list[Json] = [asdict(node) | {"type": node.type or None} for node in graph.nodes]
    edges: list[Json] = [
        {"source": edge.source, "target": edge.target, "label": edge.label, "idle": edge.idle, "feedback": edge.back}
        for edge in graph.edges
    ]
    return dumps({"name": graph.name, "nodes": nodes, "edges": edges, "notes": list(graph.notes)})
