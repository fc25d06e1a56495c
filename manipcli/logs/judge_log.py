"""The verdict on a log, from the log alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from manipcli.judge.judge import judge
from manipcli.judge.verdict import Verdict
from manipcli.logs.recorded_files import recorded_robot, recorded_scene, recorded_task_file
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording, Span


def judge_log(path: Path, *, being_written: bool = False, doing: Callable[[str], None] = lambda _: None) -> Verdict:
    """The verdict on a log, from the log alone; a verdict stored in it is not looked at.

    Args:
        path: the log, or what a killed run left.
        being_written: the run that writes it is still on and has just flushed: that it has no end is no loss.
        doing: told of each span that is judged.

    Raises:
        InvalidInput: the file is no log of ours, is damaged, or lacks what it is judged by.
    """
    recording = open_recording(path, being_written=being_written)
    return judge_recording(replace(recording, spans=_Watched(recording.spans, doing)), path)


@dataclass(frozen=True, slots=True)
class _Watched:
    """Spans; somebody is told of each that is read."""

    spans: Iterable[Span]
    doing: Callable[[str], None]

    def __iter__(self) -> Iterator[Span]:
        for span in self.spans:
            self.doing("judging")
            yield span


def judge_recording(recording: Recording, path: Path) -> Verdict:
    """The verdict on a log that is open already; see `judge_log`."""
    expect = recorded_task_file(recording, path).spec.judged
    scene = recorded_scene(recording, path)
    return judge(recording, expect=expect, robot=recorded_robot(recording, path), scene=scene)
