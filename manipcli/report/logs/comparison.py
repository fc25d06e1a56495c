"""Comparison of two logs, message by message, as text and JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence

from manipcli.core.text import number_of, shorten, shorten_apart
from manipcli.record.foreign.compare import Comparison, Difference, TopicComparison
from manipcli.record.read.compare_entries import EntryDifference
from manipcli.report.json import Json, picked
from manipcli.report.table import table

Names = tuple[str, str]
"""Names of the two logs, as `in a`."""
MOST_ENTRIES = 12


def first_text(first: Difference, names: Names) -> str:
    """`t = 2.999 s, /joint_states.effort[finger]: 0.1 in the log, 0.2 in the re-run (by 0.1); message 3 of ...`."""
    where = f"t = {first.time:.9g} s, {first.topic}"
    where += f" {first.field}" if first.field.startswith("(") else f".{first.field}"
    if first.a is None or first.b is None:
        there = names[0] if first.b is None else names[1]
        return f"{where}: only {there}; message {first.index + 1} of the topic"
    by = "" if first.by is None else f" (by {first.by:+.6g})"
    a, b = _values(first.a, first.b)
    values = f"{a} {names[0]}, {b} {names[1]}{by}" if first.a != first.b else "differ"
    return f"{where}: {values}; message {first.index + 1} of the topic"


def topics_table(topics: Sequence[TopicComparison], names: Names) -> str:
    """A table with one row per topic that differs; "" without differences."""
    rows = [
        [
            topic.name,
            str(topic.messages[0]),
            str(topic.messages[1]),
            "not compared" if topic.why else str(topic.different),
            str(topic.only[0]),
            str(topic.only[1]),
            topic.why or ("" if topic.first is None else f"{topic.first.time:.9g} s"),
        ]
        for topic in topics
        if not topic.same
    ]
    if not rows:
        return ""
    a, b = names
    headers = ["topic", f"messages {a}", b, "different", f"only {a}", f"only {b}", "first"]
    return table(headers, rows, right=headers[1:6])


def counted(found: Comparison) -> str:
    """`3 messages of 1 topic`, `1 topic is not compared`; or that the messages are the same."""
    topics = [topic for topic in found.topics if not topic.same and not topic.why]
    apart = sum(bool(topic.why) for topic in found.topics)
    parts = []
    if topics:
        messages = sum(topic.different + sum(topic.only) for topic in topics)
        parts.append(f"{number_of(messages, 'message')} of {number_of(len(topics), 'topic')}")
    if apart:
        parts.append(f"{number_of(apart, 'topic')} {'is' if apart == 1 else 'are'} not compared")
    return "; ".join(parts) or "same messages, different metadata or attachments"


def entries_lines(entries: Sequence[EntryDifference], names: Names) -> list[str]:
    """One line per metadata record and attachment that differs."""
    lines = []
    for entry in entries[:MOST_ENTRIES]:
        where = f"{entry.kind} '{entry.name}'" + (f", {entry.where}" if entry.where else "")
        a, b = _values(entry.a, entry.b)
        values = f"{a} {names[0]}, {b} {names[1]}"
        more = f" (and {entry.count - 1} more)" if entry.count > 1 else ""
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
                **picked(topic, "name type messages different only"),
                "first": _difference(topic.first),
                "not_compared": topic.why or None,
            }
            for topic in found.topics
        ],
    }


def _difference(difference: Difference | None) -> Json:
    """The values are not rounded, because a difference can be small."""
    if difference is None:
        return None
    exact = {key: _plain(getattr(difference, key)) for key in ("a", "b", "by")}
    return {**picked(difference, "time topic field"), "message": difference.index, **exact}


def _plain(value: float | int | str | None) -> Json:
    """Text for nan and inf, which JSON does not have."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _values(a: float | int | str | None, b: float | int | str | None) -> tuple[str, str]:
    """Two values as text; long texts are shortened so that their difference stays visible."""
    if isinstance(a, str) and isinstance(b, str):
        first, second = shorten_apart(a, b)
        return f"'{first}'", f"'{second}'"
    return _value(a), _value(b)


def _value(value: float | int | str | None) -> str:
    if value is None:
        return "nothing"
    return f"'{shorten(value)}'" if isinstance(value, str) else repr(value)
