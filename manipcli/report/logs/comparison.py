"""Two logs beside each other, message by message: what is the same, and the first that is not."""

from __future__ import annotations

import math
from collections.abc import Sequence

from manipcli.core.text import number_of, shorten, shorten_apart
from manipcli.record.foreign.compare import Comparison, Difference, TopicComparison
from manipcli.record.read.compare_entries import EntryDifference
from manipcli.report.json import Json, picked
from manipcli.report.table import table

Names = tuple[str, str]
"""What the two logs are called."""
MOST_ENTRIES = 12


def first_text(first: Difference, names: Names) -> str:
    """`t = 2.999 s, /joint_states.effort[finger]: 0.098 in the log, 0.097 again (by -0.001); message 3000 of ...`."""
    where = f"t = {first.time:.9g} s, {first.topic}"
    where += f" {first.field}" if first.field.startswith("(") else f".{first.field}"
    if first.a is None or first.b is None:
        there = names[0] if first.b is None else names[1]
        return f"{where}: there is one {there} alone; message {first.index + 1} of the topic"
    by = "" if first.by is None else f" (by {first.by:+.6g})"
    a, b = _values(first.a, first.b)
    values = f"{a} {names[0]}, {b} {names[1]}{by}" if first.a != first.b else "differ"
    return f"{where}: {values}; message {first.index + 1} of the topic"


def topics_table(topics: Sequence[TopicComparison], names: Names) -> str:
    """A row for each topic that is not the same; "" where there is none."""
    rows = [
        [
            one.name,
            str(one.messages[0]),
            str(one.messages[1]),
            "not compared" if one.why else str(one.different),
            str(one.only[0]),
            str(one.only[1]),
            one.why or ("" if one.first is None else f"{one.first.time:.9g} s"),
        ]
        for one in topics
        if not one.same
    ]
    if not rows:
        return ""
    a, b = names
    headers = ["topic", f"messages {a}", b, "different", f"only {a}", f"only {b}", "first"]
    return table(headers, rows, right=headers[1:6])


def counted(found: Comparison) -> str:
    """`3 messages of 1 topic`, `1 topic is not compared`; or that it is not the messages."""
    topics = [topic for topic in found.topics if not topic.same and not topic.why]
    apart = sum(bool(topic.why) for topic in found.topics)
    told = []
    if topics:
        messages = sum(topic.different + sum(topic.only) for topic in topics)
        told.append(f"{number_of(messages, 'message')} of {number_of(len(topics), 'topic')}")
    if apart:
        told.append(f"{number_of(apart, 'topic')} {'is' if apart == 1 else 'are'} not compared")
    return "; ".join(told) or "the messages are the same, what is beside them is not"


def entries_lines(entries: Sequence[EntryDifference], names: Names) -> list[str]:
    """A line for each record of metadata and each attachment that differs."""
    lines = []
    for one in entries[:MOST_ENTRIES]:
        where = f"{one.kind} '{one.name}'" + (f", {one.where}" if one.where else "")
        a, b = _values(one.a, one.b)
        values = f"{a} {names[0]}, {b} {names[1]}"
        more = f" (and {one.count - 1} more)" if one.count > 1 else ""
        lines.append(f"{where}: {values}{more}")
    if len(entries) > MOST_ENTRIES:
        lines.append(f"and {len(entries) - MOST_ENTRIES} more")
    return lines


def messages_object(found: Comparison) -> dict[str, Json]:
    return {
        "messages": found.messages,
        "first": _difference(found.first),
        "topics": [
            {
                **picked(one, "name type messages different only"),
                "first": _difference(one.first),
                "not_compared": one.why or None,
            }
            for one in found.topics
        ],
    }


def _difference(one: Difference | None) -> Json:
    """Values as they are: not rounded, for a difference may be small."""
    if one is None:
        return None
    exact = {key: _plain(getattr(one, key)) for key in ("a", "b", "by")}
    return {**picked(one, "time topic field"), "message": one.index, **exact}


def _plain(value: float | int | str | None) -> Json:
    """JSON knows no nan and inf."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _values(a: float | int | str | None, b: float | int | str | None) -> tuple[str, str]:
    """As text, so that texts which differ look different."""
    if isinstance(a, str) and isinstance(b, str):
        one, other = shorten_apart(a, b)
        return f"'{one}'", f"'{other}'"
    return _value(a), _value(b)


def _value(value: float | int | str | None) -> str:
    if value is None:
        return "nothing"
    return f"'{shorten(value)}'" if isinstance(value, str) else repr(value)
