"""The data-flow graph in its formats: names that want to break out stay within their quotes."""

from __future__ import annotations

import json
import re
from html import unescape

from manipcli.report.logs.graph import Edge, Graph, Node, render

NASTY = [
    'a"]; b',
    "<script>alert(1)</script>",
    "back\\slash\\l",
    "line\nbreak",
    "ünï … →",
    "end",
    "x --> y",
    'q"|z',
    "",
]
NODES = tuple(
    Node(f"id {k}", "topic" if k % 2 else "controller", name, "p/msg/T", (name,)) for k, name in enumerate(NASTY)
)
EDGES = (
    *(Edge(f"id {k}", f"id {k + 1}", NASTY[k], idle=k % 3 == 0) for k in range(len(NASTY) - 1)),
    Edge("id 5", "id 0", "round", back=True),
)
GRAPH = Graph('a "name"', NODES, EDGES, ("a note",))


def _mermaid(text: str) -> tuple[dict[str, str], list[tuple[str, str, str]]]:
    """By the syntax of flowcharts: a label in quotes holds no quote and no markup but the breaks between its lines."""
    lines = text.splitlines()
    assert lines[0] == "flowchart LR"
    nodes, edges = {}, []
    for line in lines[1:]:
        if re.fullmatch(r"  (?:classDef idle [\w: -]+|class n\d+(?:,n\d+)* idle)", line):
            continue
        node = re.fullmatch(
            r'  (n\d+)(?:\[|\[\[|\(\[|\[/)"([^"<>\[\]{}|]*(?:<br/>[^"<>\[\]{}|]*)*)"(?:\]|\]\]|\]\)|/\])', line
        )
        edge = re.fullmatch(r'  (n\d+) (?:-->|-\.->)(?:\|"([^"<>|]*)"\|)? (n\d+)', line)
        assert node or edge, line
        if node:
            nodes[node[1]] = _plain(node[2].replace("<br/>", "\n"))
        elif edge:
            edges.append((edge[1], edge[3], _plain(edge[2] or "")))
    return nodes, edges


def _plain(label: str) -> str:
    return unescape(re.sub(r"#(\d+);", r"&#\1;", label))


def test_names_stay_within_their_quotes() -> None:
    nodes, edges = _mermaid(render(GRAPH, "mermaid"))
    assert len(nodes) == len(NODES)
    assert [(int(a[1:]), int(b[1:])) for a, b, _ in edges] == [
        (int(one.source.split()[1]), int(one.target.split()[1])) for one in EDGES
    ]
    for node, label in zip(NODES, nodes.values(), strict=True):
        assert node.name.replace("\n", "\\n") in label
    assert [label for *_, label in edges] == [one.label.replace("\n", "\\n") for one in EDGES]


def test_the_tree_has_every_node_once_and_every_edge() -> None:
    names = [f"name{k}" for k in range(6)]
    nodes = tuple(Node(str(k), "topic", name) for k, name in enumerate(names))
    # A diamond, a way back, and a circle that nothing feeds.
    pairs = [("0", "1"), ("0", "2"), ("1", "3"), ("2", "3"), ("3", "0"), ("4", "5"), ("5", "4")]
    text = render(Graph("g", nodes, tuple(Edge(a, b, f"{a}to{b}") for a, b in pairs)), "text")
    lines = text.splitlines()
    for name in names:
        assert sum(line.lstrip("│├└─ ").split("  ")[0] == name for line in lines) == 1
    assert len(lines) == len(nodes) + sum("-> " in line for line in lines)
    drawn = {a + b for a, b in pairs if f"{a}to{b}" in text}
    assert len(drawn) >= len(pairs) - 2, "but for the two edges that close a circle"


def test_json_is_the_graph() -> None:
    found = json.loads(render(GRAPH, "json"))
    assert [node["name"] for node in found["nodes"]] == NASTY
    assert [(e["source"], e["target"], e["idle"], e["feedback"]) for e in found["edges"]] == [
        (one.source, one.target, one.idle, one.back) for one in EDGES
    ]
    assert found["notes"] == ["a note"]
