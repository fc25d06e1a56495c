"""Curves of `TOPIC.FIELD` from any ROS 2 logs, or an overview."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import did_you_mean, escape, listed, shorten
from manipcli.core.units import NUMBER, TIME, UnitError, to_si
from manipcli.judge.steps import step_outcomes
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import CONTACTS, JOINT_STATES, ROBOT_DESCRIPTION
from manipcli.record.definition import Message, UnknownDefinition, read_definition
from manipcli.record.faults import BadRecording
from manipcli.record.foreign.field_units import JointUnits, joint_units, unit_of
from manipcli.record.foreign.namespaces import meant
from manipcli.record.foreign.series import Series, Wanted, read_series
from manipcli.record.foreign.topic_fields import FieldName, Part, UnknownField, Way, numbers, parse_field, short, ways
from manipcli.record.foreign.topics import Topic, Topics, open_topics
from manipcli.record.read.reading import open_recording
from manipcli.record.schemas import CONTROLLER_STATE
from manipcli.replay.curves import Chart, Curve, Interval, Panel

MAX_CURVES = 400
"""Most curves of one figure."""


@dataclass(frozen=True, slots=True)
class FieldLine:
    """A field that can be plotted: `TOPIC.FIELD`, the type of its topic, and the number of messages."""

    name: str
    type: str
    count: int


def open_chart(
    logs: Sequence[Path], words: Sequence[str], *, start: str | None = None, end: str | None = None
) -> Chart:
    """Curves of one log, or of several logs in the same panels.

    Args:
        logs: MCAP files of ROS 2 messages, finished or not; each begins at its first message.
        words: one panel each, `TOPIC.FIELD` or several separated by commas; empty for an overview.
        start, end: seconds, a time with its unit, or a step id: start or end of the step in the first log that has it.

    Raises:
        InvalidInput: a log cannot be read, a field is missing, or there is nothing to show.
    """
    opened = [_Log(path, name) for path, name in zip(logs, map(escape, _short_names(logs)), strict=True)]
    first, last = _time(start, opened, begin=True), _time(end, opened, begin=False)
    if first >= last:
        raise InvalidInput([Diagnostic("PLOT003", f"empty time range: --from {start} is not before --to {end}")])
    asked = [tuple(_split(word)) for word in words] or _overview(opened)
    if not asked:
        found = [topic.name for log in opened for topic in log.topics.all.values() if topic.definition]
        hint = f"give TOPIC.FIELD; topics: {listed(found)}" if found else "the log has no ROS 2 messages"
        raise InvalidInput([Diagnostic("PLOT001", "no topics for an overview in these logs", hint=hint)])
    panels: _Panels = {}
    for log in opened:
        for number, group in enumerate(asked):
            log.read(group, number, panels, first, last)
            if sum(map(len, panels.values())) > MAX_CURVES:
                hint = "select elements in brackets: [joint_1]"
                raise InvalidInput([Diagnostic("PLOT005", f"more than {MAX_CURVES} curves requested", hint=hint)])
    if not panels:
        what = f" of {listed(words)}" if words else ""
        raise InvalidInput([Diagnostic("PLOT004", f"no value{what} in this time range")])
    missing = [word for number, word in enumerate(words) if number not in {head.word for head in panels}]
    steps = next((log.steps for log in opened if log.steps), ())
    ends = [log.duration for log in opened]
    return Chart(
        title=", ".join(log.name for log in opened),
        panels=tuple(
            Panel(head.title, head.quantity, head.unit, tuple(panels[head]))
            for head in sorted(panels, key=lambda head: head.word)
        ),
        steps=steps,
        start=max(first, 0.0),
        end=min(last, max(ends)) if max(ends) > max(first, 0.0) else max(first, 0.0) + 1.0,
        notes=(
            *(f"{log.name}: {log.topics.lost}" for log in opened if log.topics.lost is not None),
            *([f"no value of {listed(missing)} in this time range"] if missing else []),
        ),
    )


def field_lines(path: Path) -> tuple[FieldLine, ...]:
    """All fields of a log that can be plotted.

    Raises:
        InvalidInput: the log cannot be read.
    """
    log = _Log(path, path.name)
    lines = []
    for topic in log.topics.all.values():
        if topic.definition and topic.count:
            message = log.message(topic)
            lines += [
                FieldLine(f"{topic.name.strip('/')}.{short(message, name)}", topic.type, topic.count)
                for name in numbers(message)
            ]
    return tuple(lines)


@dataclass(frozen=True, slots=True)
class _Head:
    """Key of a panel: the number of its word on the command line, its title, unit and quantity."""

    word: int
    title: str
    unit: str
    quantity: str = field(compare=False)


_Panels = dict[_Head, list[Curve]]


class _Log:
    def __init__(self, path: Path, name: str) -> None:
        self.path = path
        self.name = name
        self.topics: Topics = open_topics(path)
        self._messages: dict[str, Message] = {}
        self.steps = _steps(path)
        self.duration = (self.topics.end - self.topics.start) / 1e9

    def message(self, topic: Topic) -> Message:
        """The type of a topic.

        Raises:
            InvalidInput: its schema cannot be read.
        """
        if topic.name not in self._messages:
            if not topic.definition:
                encoding = topic.encoding or "unknown"
                raise self._refused("PLOT006", f"{topic.name} has encoding {encoding}, expected ROS 2 CDR with ros2msg")
            try:
                self._messages[topic.name] = read_definition(topic.type, topic.definition)
            except UnknownDefinition as error:
                raise self._refused("PLOT006", f"{topic.name}: the definition of {topic.type}: {error}") from error
        return self._messages[topic.name]

    def read(self, group: Sequence[str], number: int, panels: _Panels, start: float, end: float) -> None:
        """Add the curves of one word of the command line to `panels`.

        Raises:
            InvalidInput: a field is missing.
        """
        wanted: list[Wanted] = []
        names: list[FieldName] = []
        for text in group:
            try:
                name = parse_field(text)
                topic = self._topic(name)
                message = self.message(topic)
                found = ways(message, name)
            except UnknownField as error:
                raise self._refused("PLOT002", str(error), error.hint) from error
            wanted += [Wanted(topic.name, message, way) for way in found]
            names += [name] * len(found)
        everything = read_series(self.topics, wanted, start=start, end=end)
        for request, name, series in zip(wanted, names, everything, strict=True):
            if not series:
                self._explain(request, name)
            # The axes of one vector share a panel.
            together = len(request.way.parts[-1].name) == 1 and any(
                other is not request and other.way.parts[:-1] == request.way.parts[:-1] for other in wanted
            )
            for data in series:
                self._curve(request, data, number, panels, several=len(group) > 1, together=together)

    def _curve(
        self, request: Wanted, data: Series, number: int, panels: _Panels, *, several: bool, together: bool
    ) -> None:
        parts = [part.name for part in request.way.parts]
        field = f"{request.topic.strip('/')}.{short(request.message, request.way.name)}"
        name = f"{field}[{data.label}]" if data.label else field
        unit = unit_of(request.way, data.label, self._joints)
        label = data.label.replace("+", " – ").replace("robot/", "")
        title, quantity = field, parts[-1]
        if several:
            # Fields separated by commas share a panel if they have the same unit.
            title, label = "", f"{field} {label}".strip()
        elif together:
            title, label, quantity = field.rpartition(".")[0], f"{label} {quantity}".strip(), parts[-2]
        elif len(quantity) == 1 and len(parts) > 1:
            quantity = f"{parts[-2]} {quantity}"
        curve = Curve(name, label, self.name, data.times, data.values, data.held, self.duration)
        panels.setdefault(_Head(number, title, unit, quantity), []).append(curve)

    def _topic(self, name: FieldName) -> Topic:
        topic = self.topics.all.get(name.topic)
        if topic is None:
            known = [topic_name.strip("/") for topic_name in self.topics.all]
            hint = did_you_mean(name.topic.strip("/"), known, kind="topics")
            raise UnknownField(f"{name.text}: the log has no topic '{name.topic}'", hint)
        return topic

    def _explain(self, wanted: Wanted, name: FieldName) -> None:
        """Raise if the requested elements never occur; a topic without messages is not an error."""
        keys = [part.key for part in wanted.way.parts if part.key is not None]
        if not keys or not self.topics.all[wanted.topic].count:
            return
        bare = Way(
            tuple(Part(part.name) for part in wanted.way.parts), wanted.way.holder, wanted.way.many, wanted.way.is_time
        )
        ((known),) = read_series(self.topics, [Wanted(wanted.topic, wanted.message, bare)])
        labels = dict.fromkeys(word for series in known for word in (series.label, *series.label.split("+")))
        words = [word for key in keys for word in key.words]
        if not any(word in labels or set(word.split("+")) <= set(labels) for word in words):
            hint = did_you_mean(words[0], labels, kind="elements")
            raise self._refused("PLOT002", f"{name.text}: no element '{shorten(', '.join(words))}'", hint)

    @cached_property
    def _joints(self) -> JointUnits:
        """Units of the joints in `/robot_description`; empty if it cannot be read."""
        topic = self.topics.all.get(ROBOT_DESCRIPTION)
        urdf = ""
        if topic is not None and topic.definition:
            for _, data, places in islice(self.topics.messages({ROBOT_DESCRIPTION}), 1):
                start, length = int(places.starts[0]), int(places.lengths[0])
                with suppress(CdrError):
                    urdf = CdrReader(memoryview(data)[start : start + length]).text()
        return joint_units(urdf.encode())

    def _refused(self, code: str, message: str, hint: str | None = None) -> InvalidInput:
        return InvalidInput([Diagnostic(code, message, Place(str(self.path), 0, 0), hint)])


def _steps(path: Path) -> tuple[Interval, ...]:
    """Steps of a log of manipcli; empty for other logs."""
    try:
        recording = open_recording(path)
    except BadRecording:
        return ()
    last = max((event.time for event in recording.events), default=0.0)
    found = step_outcomes(recording, interrupted=False)
    return tuple(
        Interval(step.id, step.started, last if step.ended is None else step.ended, step.outcome == "done")
        for step in found
        if step.started is not None
    )


def _overview(logs: Sequence[_Log]) -> list[tuple[str, ...]]:
    """Fields of the overview that the logs have: joint states, tracking errors, contact forces."""
    found: dict[str, None] = {}
    for log in logs:
        topics = log.topics.all
        known = meant({name: topic.type for name, topic in topics.items()}).items()
        joints = [name for name, what in known if what.usual == JOINT_STATES and topics[name].count]
        found |= {f"{name}.{field}": None for field in ("position", "velocity", "effort") for name in joints}
        for name, topic in topics.items():
            if topic.type == CONTROLLER_STATE and topic.count:
                found[f"{name}.error.positions"] = None
        if topics.get(CONTACTS) is not None and topics[CONTACTS].count:
            found[f"{CONTACTS}.force"] = None
    # Only topics that every log has.
    return [(word,) for word in found if all(word.partition(".")[0] in log.topics.all for log in logs)]


def _split(word: str) -> Iterator[str]:
    """The parts between commas outside of brackets."""
    depth, begin = 0, 0
    for k, letter in enumerate(word):
        depth += {"[": 1, "]": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            yield word[begin:k]
            begin = k + 1
    yield word[begin:]


def _time(text: str | None, logs: Sequence[_Log], *, begin: bool) -> float:
    """[s]"""
    if text is None:
        return -math.inf if begin else math.inf
    for log in logs:
        for step in log.steps:
            if step.name == text:
                return step.start if begin else step.end
    try:
        return to_si(text, NUMBER, TIME)
    except UnitError:
        steps = [step.name for log in logs for step in log.steps]
        hint = did_you_mean(text, steps, kind="steps") or "these logs have no steps"
        message = f"{'--from' if begin else '--to'}: '{shorten(text)}' is not a time or step"
        raise InvalidInput([Diagnostic("PLOT003", message, hint=hint)]) from None


def _short_names(logs: Sequence[Path]) -> list[str]:
    """File names without extension; paths if names are equal."""
    names = [path.name.removesuffix(".partial").removesuffix(".mcap") for path in logs]
    if len(set(names)) == len(names):
        return names
    names = [str(path) for path in logs]
    return [name if names.count(name) == 1 else f"{name} #{k + 1}" for k, name in enumerate(names)]
