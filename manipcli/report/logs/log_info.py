"""Content of a log as text and JSON: verdict, steps, topics, attachments, and missing parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.core.text import listed
from manipcli.judge.saturations import Saturations
from manipcli.judge.verdict import BlockOutcome, StepOutcome
from manipcli.record.attachments import INERTIALS
from manipcli.record.foreign.topics import Topic, Topics
from manipcli.record.recording import EMBEDDED
from manipcli.report.display_quantity import data_size
from manipcli.report.inertials import recorded_inertials
from manipcli.report.json import Json, dumps, number, saturated_object, step_object
from manipcli.report.logs.engine_choice import engine_choices
from manipcli.report.table import table
from manipcli.report.text import FAIL, PASS, steps_table


@dataclass(frozen=True, slots=True)
class LogInfo:
    """Content of a log, without judging it.

    Attributes:
        found: topics, metadata and attachments of the MCAP file.
        ours: whether manipcli wrote it.
        steps: outcomes of the steps; empty if the log has none.
        missing: parts that are missing compared to the log of a finished run, or damaged; one sentence each.
        blocks: outcomes of the groups of steps.
    """

    found: Topics
    ours: bool
    steps: tuple[StepOutcome, ...]
    missing: tuple[str, ...]
    blocks: tuple[BlockOutcome, ...] = ()

    @property
    def run(self) -> Mapping[str, str]:
        """Task, seed, engine, period, status."""
        return self.found.metadata.get("run", {})

    @property
    def verdict(self) -> Mapping[str, str]:
        """Stored verdict of the run; empty without one."""
        return self.found.metadata.get("verdict", {})

    @property
    def versions(self) -> Mapping[str, str]:
        """Versions of manipcli and of the engine."""
        return self.found.metadata.get("versions", {})

    @property
    def saturations(self) -> Saturations:
        """Saturated joints and actuators."""
        try:
            period = float(self.run.get("period", ""))
        except ValueError:
            period = 0.0
        return Saturations.from_metadata(self.found.metadata, end=self.found.end / 1e9, period=period)

    @property
    def size_per_minute(self) -> float | None:
        """Size per minute of recorded time [byte]; None for a duration of zero."""
        return 60.0 * self.found.size / self.found.duration if self.found.duration > 0.0 else None


def render_text(info: LogInfo) -> str:
    """Missing parts, steps, topics, attachments, and the stored verdict."""
    found = info.found
    lines = [f"missing: {text}" for text in info.missing]
    if lines:
        lines.append("")
    if info.steps:
        lines += [steps_table(info.steps, info.blocks), ""]
    rows = [
        [topic.name, topic.type or topic.encoding, str(topic.count), _rate(topic.rate), _until(topic, found)]
        for topic in _by_name(found)
    ]
    lines.append(table(["topic", "type", "messages", "rate", "until"], rows, right=["messages", "rate", "until"]))
    if found.gaps:
        gaps = [[_after(gap.start, found), _after(gap.end, found), listed(gap.topics)] for gap in found.gaps]
        lines += ["", table(["gap from", "to", "no messages of"], gaps, right=["gap from", "to"])]
    if found.attachments:
        lines += [
            "",
            table(["attachment", "size"], [[a.name, data_size(a.size)] for a in found.attachments], right=["size"]),
        ]
    meshes, embedded = len(found.metadata.get("meshes", {})), len(found.metadata.get(EMBEDDED, {}))
    if meshes:
        held = "all embedded in the log" if embedded >= meshes else f"{embedded} embedded in the log"
        lines += ["", f"{meshes} meshes, {'not embedded in the log' if not embedded else held}"]
    lines += ["", _headline(info), *([str(info.saturations)] if str(info.saturations) else []), _length(info)]
    lines += [f"{name} of the engine: {value}" for name, value in engine_choices(found.metadata)]
    lines += [f"{name}: {value}" for name, value in recorded_inertials(found.metadata)]
    lines += [f"objects are held by {info.run['holding']}, not by friction"] if "holding" in info.run else []
    return "\n".join([*lines, f"log: {found.path}"])


def render_json(info: LogInfo) -> str:
    """The content as one JSON object; numbers are SI, sizes in bytes."""
    found = info.found
    return dumps(
        {
            "log": str(found.path),
            "size": found.size,
            "size_per_minute": number(info.size_per_minute),
            "start": _seconds(found.start, found),
            "end": _seconds(found.end, found),
            "duration": number(found.duration),
            "written_by": found.library,
            "profile": found.profile,
            "ours": info.ours,
            "run": dict(info.run),
            "versions": dict(info.versions),
            "engine_settings": dict(found.metadata.get("engine", {})),
            "inertials": dict(found.metadata.get(INERTIALS, {})),
            "verdict": dict(info.verdict) or None,
            "saturated": saturated_object(info.saturations),
            "steps": [step_object(step) for step in info.steps],
            "topics": [
                {
                    "name": topic.name,
                    "type": topic.type,
                    "encoding": topic.encoding.partition("/")[0],
                    "messages": topic.count,
                    "rate": number(topic.rate),
                    "first": _seconds(topic.first, topic),
                    "last": _seconds(topic.last, topic),
                }
                for topic in _by_name(found)
            ],
            "gaps": [
                {"start": _seconds(gap.start, found), "end": _seconds(gap.end, found), "topics": list(gap.topics)}
                for gap in found.gaps
            ],
            "attachments": [
                {"name": attachment.name, "media_type": attachment.media_type, "size": attachment.size}
                for attachment in found.attachments
            ],
            "meshes": _meshes(found),
            "missing": list(info.missing),
        }
    )


def _meshes(found: Topics) -> Json:
    embedded = found.metadata.get(EMBEDDED, {})
    return [
        {"uri": uri, "sha256": digest, "embedded": uri in embedded}
        for uri, digest in found.metadata.get("meshes", {}).items()
    ]


def _headline(info: LogInfo) -> str:
    if not info.ours:
        return f"log written by {info.found.library or 'an unknown writer'}, profile '{info.found.profile}'"
    task = info.run.get("task", "")
    if not info.verdict:
        return f"{FAIL} {task}: no stored verdict"
    word, why = info.verdict.get("verdict", ""), info.verdict.get("text", "")
    stored = f"{task} {word}: {why}"
    if info.missing:
        return f"{FAIL} stored verdict of the complete log: {stored}"
    return f"{PASS if word == 'passed' else FAIL} {stored} (stored; `manipcli judge` recomputes it)"


def _length(info: LogInfo) -> str:
    found = info.found
    parts = [f"{found.duration:.2f} s", data_size(found.size)]
    if info.size_per_minute is not None:
        parts.append(f"{data_size(round(info.size_per_minute))} per minute")
    text = ", ".join(parts)
    if info.ours:
        run, versions = info.run, info.versions
        engine = run.get("engine", "")
        release = f" {versions[engine]}" if engine in versions else ""
        text += f"; engine {engine}{release}, seed {run.get('seed', '')}, manipcli {versions.get('manipcli', '')}"
    return text


def _rate(rate: float | None) -> str:
    return "" if rate is None else f"{rate:.4g} Hz"


def _by_name(found: Topics) -> list[Topic]:
    return sorted(found.all.values(), key=lambda topic: topic.name)


def _seconds(ns: int, of: Topic | Topics) -> Json:
    return number(ns / 1e9) if of.count else None


def _until(topic: Topic, found: Topics) -> str:
    """Time of the last message from the beginning of the log, since other programs count from 1970."""
    return _after(topic.last, found) if topic.count else ""


def _after(time: int, found: Topics) -> str:
    return f"{(time - found.start) / 1e9:.2f} s"
