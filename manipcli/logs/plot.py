"""Logs and words to curves: `TOPIC.FIELD` of any ROS 2 log, or what is worth a first look."""

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
from manipcli.record.foreign.fields import FieldName, Part, UnknownField, Way, numbers, parse_field, short, ways
from manipcli.record.foreign.namespaces import meant
from manipcli.record.foreign.series import Series, Wanted, read_series
from manipcli.record.foreign.topics import Topic, Topics, open_topics
from manipcli.record.foreign.units import JointUnits, joint_units, unit_of
from manipcli.record.read.reading import open_recording
from manipcli.record.schemas import CONTROLLER_STATE
from manipcli.replay.curves import Chart, Curve, Interval, Panel

MAX_CURVES = 400
"""On one sheet: more are seen by nobody."""


@dataclass(frozen=True, slots=True)
class FieldLine:
    """One line of what can be plotted: `name` as it is written, the type of its topic, how many messages there are."""

    name: str
    type: str
    count: int


def open_chart(
    logs: Sequence[Path], words: Sequence[str], *, start: str | None = None, end: str | None = None
) -> Chart:
    """Curves of one log or of several over each other.

    Args:
        logs: MCAP files of ROS 2 messages, finished or not; each begins at its first message.
        words: a panel each, `TOPIC.FIELD` or several with commas between; none: an overview.
        start, end: seconds, a time with its unit, or the id of a step of the first log that has it: its begin, its end.

    Raises:
        InvalidInput: a log cannot be read, a field is not there, or there is nothing to show.
    """
    opened = [_Log(path, name) for path, name in zip(logs, map(escape, _short_names(logs)), strict=True)]
    first, last = _time(start, opened, begin=True), _time(end, opened, begin=False)
    if first >= last:
        raise InvalidInput([Diagnostic("PLOT003", f"nothing lies between --from {start} and --to {end}")])
    asked = [tuple(_split(word)) for word in words] or _overview(opened)
    if not asked:
        found = [topic.name for one in opened for topic in one.topics.all.values() if topic.definition]
        hint = f"say TOPIC.FIELD; topics: {listed(found)}" if found else "it has no topic of ROS 2 messages"
        raise InvalidInput([Diagnostic("PLOT001", "these logs have nothing that is shown by itself", hint=hint)])
    panels: _Panels = {}
    for one in opened:
        for number, group in enumerate(asked):
            one.read(group, number, panels, first, last)
            if sum(map(len, panels.values())) > MAX_CURVES:
                hint = "pick elements in brackets: [joint_1]"
                raise InvalidInput([Diagnostic("PLOT005", f"more than {MAX_CURVES} curves are asked for", hint=hint)])
    if not panels:
        what = f" of {listed(words)}" if words else ""
        raise InvalidInput([Diagnostic("PLOT004", f"there is no value{what} in that time")])
    missing = [word for number, word in enumerate(words) if number not in {head.word for head in panels}]
    steps = next((one.steps for one in opened if one.steps), ())
    ends = [one.duration for one in opened]
    return Chart(
        title=", ".join(one.name for one in opened),
        panels=tuple(
            Panel(head.title, head.quantity, head.unit, tuple(panels[head]))
            for head in sorted(panels, key=lambda head: head.word)
        ),
        steps=steps,
        start=max(first, 0.0),
        end=min(last, max(ends)) if max(ends) > max(first, 0.0) else max(first, 0.0) + 1.0,
        notes=(
            *(f"{one.name}: {one.topics.lost}" for one in opened if one.topics.lost is not None),
            *([f"there is no value of {listed(missing)} in that time"] if missing else []),
        ),
    )


def field_lines(path: Path) -> tuple[FieldLine, ...]:
    """Everything in a log that can be plotted.

    Raises:
        InvalidInput: it cannot be read.
    """
    one = _Log(path, path.name)
    lines = []
    for topic in one.topics.all.values():
        if topic.definition and topic.count:
            message = one.message(topic)
            lines += [
                FieldLine(f"{topic.name.strip('/')}.{short(message, name)}", topic.type, topic.count)
                for name in numbers(message)
            ]
    return tuple(lines)


@dataclass(frozen=True, slots=True)
class _Head:
    """What a panel is of: the number of the word that asks for it, its title, unit and quantity."""

    word: int
    title: str
    unit: str
    quantity: str = field(compare=False)


_Panels = dict[_Head, list[Curve]]


class _Log:
    """One log that is plotted."""

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
        """The curves of one word of the command line.

        Raises:
            InvalidInput: a field is not there.
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
        for one, name, series in zip(wanted, names, everything, strict=True):
            if not series:
                self._explain(one, name)
            # The axes of a vector that is asked for as a whole share a panel.
            together = len(one.way.parts[-1].name) == 1 and any(
                other is not one and other.way.parts[:-1] == one.way.parts[:-1] for other in wanted
            )
            for each in series:
                self._curve(one, each, number, panels, several=len(group) > 1, together=together)

    def _curve(self, one: Wanted, each: Series, number: int, panels: _Panels, *, several: bool, together: bool) -> None:
        parts = [part.name for part in one.way.parts]
        field = f"{one.topic.strip('/')}.{short(one.message, one.way.name)}"
        name = f"{field}[{each.label}]" if each.label else field
        unit = unit_of(one.way, each.label, self._joints)
        label = each.label.replace("+", " – ").replace("robot/", "")
        title, quantity = field, parts[-1]
        if several:
            # Words with commas between share a panel, whatever they are of, as long as the unit is the same.
            title, label = "", f"{field} {label}".strip()
        elif together:
            title, label, quantity = field.rpartition(".")[0], f"{label} {quantity}".strip(), parts[-2]
        elif len(quantity) == 1 and len(parts) > 1:
            quantity = f"{parts[-2]} {quantity}"
        curve = Curve(name, label, self.name, each.times, each.values, each.held, self.duration)
        panels.setdefault(_Head(number, title, unit, quantity), []).append(curve)

    def _topic(self, name: FieldName) -> Topic:
        topic = self.topics.all.get(name.topic)
        if topic is None:
            known = [one.strip("/") for one in self.topics.all]
            hint = did_you_mean(name.topic.strip("/"), known, kind="topics")
            raise UnknownField(f"{name.text}: the log has no topic '{name.topic}'", hint)
        return topic

    def _explain(self, one: Wanted, name: FieldName) -> None:
        """Raises where the elements that were asked for are never there; a topic without messages is no mistake."""
        keys = [part.key for part in one.way.parts if part.key is not None]
        if not keys or not self.topics.all[one.topic].count:
            return
        bare = Way(tuple(Part(part.name) for part in one.way.parts), one.way.holder, one.way.many, one.way.is_time)
        ((known),) = read_series(self.topics, [Wanted(one.topic, one.message, bare)])
        labels = dict.fromkeys(word for series in known for word in (series.label, *series.label.split("+")))
        words = [word for key in keys for word in key.words]
        if not any(word in labels or set(word.split("+")) <= set(labels) for word in words):
            hint = did_you_mean(words[0], labels, kind="there are")
            raise self._refused("PLOT002", f"{name.text}: there is no '{shorten(', '.join(words))}' in it", hint)

    @cached_property
    def _joints(self) -> JointUnits:
        """The units of the joints of the described robot; none where the description cannot be read."""
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
    """The steps of a log of manipcli; other logs have none."""
    try:
        recording = open_recording(path)
    except BadRecording:
        return ()
    last = max((one.time for one in recording.events), default=0.0)
    found = step_outcomes(recording, interrupted=False)
    return tuple(
        Interval(one.id, one.started, last if one.ended is None else one.ended, one.outcome == "done")
        for one in found
        if one.started is not None
    )


def _overview(logs: Sequence[_Log]) -> list[tuple[str, ...]]:
    """Joints, how far they are from their references, contacts: of what the logs have."""
    found: dict[str, None] = {}
    for one in logs:
        topics = one.topics.all
        known = meant({name: topic.type for name, topic in topics.items()}).items()
        joints = [name for name, what in known if what.usual == JOINT_STATES and topics[name].count]
        found |= {f"{name}.{field}": None for field in ("position", "velocity", "effort") for name in joints}
        for name, topic in topics.items():
            if topic.type == CONTROLLER_STATE and topic.count:
                found[f"{name}.error.positions"] = None
        if topics.get(CONTACTS) is not None and topics[CONTACTS].count:
            found[f"{CONTACTS}.force"] = None
    # Every log must have what is asked of all.
    return [(word,) for word in found if all(word.partition(".")[0] in one.topics.all for one in logs)]


def _split(word: str) -> Iterator[str]:
    """At the commas that stand in no brackets."""
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
    for one in logs:
        for step in one.steps:
            if step.name == text:
                return step.start if begin else step.end
    try:
        return to_si(text, NUMBER, TIME)
    except UnitError:
        steps = [step.name for one in logs for step in one.steps]
        hint = did_you_mean(text, steps, kind="steps") or "these logs have no steps"
        message = f"{'--from' if begin else '--to'}: '{shorten(text)}' is neither a time nor a step"
        raise InvalidInput([Diagnostic("PLOT003", message, hint=hint)]) from None


def _short_names(logs: Sequence[Path]) -> list[str]:
    """The names of the files without what they end with; with folders where they would be the same."""
    names = [path.name.removesuffix(".partial").removesuffix(".mcap") for path in logs]
    if len(set(names)) == len(names):
        return names
    names = [str(path) for path in logs]
    return [name if names.count(name) == 1 else f"{name} #{k + 1}" for k, name in enumerate(names)]
