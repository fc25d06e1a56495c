"""Judging a log from the log alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from manipcli.judge.implied import implied
from manipcli.judge.judge import RUN, judge
from manipcli.judge.verdict import Verdict
from manipcli.logs.recorded_files import recorded_controllers_file, recorded_robot, recorded_scene, recorded_task_file
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording, Span


def judge_log(path: Path, *, being_written: bool = False, activity: Callable[[str], None] = lambda _: None) -> Verdict:
    """The verdict on a log, from the log alone; a stored verdict is ignored.

    Args:
        path: the log, or the partial log of a killed run.
        being_written: the run that writes the log has just flushed it, so its missing end is not a loss.
        activity: called with `"judging"` for each span.

    Raises:
        InvalidInput: the file is not a log of manipcli, is damaged, or lacks attachments.
    """
    recording = open_recording(path, being_written=being_written, contact_points=False)
    return judge_recording(replace(recording, spans=_Watched(recording.spans, activity)), path)


@dataclass(frozen=True, slots=True)
class _Watched:
    """Spans with a callback for each one read."""

    spans: Iterable[Span]
    activity: Callable[[str], None]

    def __iter__(self) -> Iterator[Span]:
        for span in self.spans:
            self.activity("judging")
            yield span


def judge_recording(recording: Recording, path: Path) -> Verdict:
    """The verdict on an open log; see `judge_log`."""
    task = recorded_task_file(recording, path).spec
    robot = recorded_robot(recording, path)
    physics = recording.metadata.get(RUN, {}).get("physics", "") == "full"
    unwritten = implied(task, lambda: recorded_controllers_file(recording, path).spec, robot) if physics else ()
    scene = recorded_scene(recording, path)
    return judge(recording, expect=task.judged, robot=robot, scene=scene, implied=unwritten)
