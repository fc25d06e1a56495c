"""Two logs to what is different about them: what they were made from, what came of it, and from when on."""

from __future__ import annotations

from pathlib import Path

from manipcli.judge.measures.step_measures import step_measures
from manipcli.judge.saturations import ACTUATORS, JOINTS, LIMITS
from manipcli.logs.judge_log import judge_recording
from manipcli.logs.recorded_files import recorded_robot
from manipcli.record.channels import EVENTS, ROSOUT
from manipcli.record.foreign.compare import Comparison, compare_logs
from manipcli.record.foreign.origin import is_own
from manipcli.record.read.compare_entries import compare_entries
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording
from manipcli.report.logs.log_diff import LogDiff, LogSide

OUTCOME = ("verdict", JOINTS, ACTUATORS, LIMITS)
"""Metadata that says what came of a run, which is judged and measured anew."""
PLACES = {EVENTS: ("place",), ROSOUT: ("file", "line")}
"""Where a step was written is nothing that happened: a comment in the task moves it."""


def diff_logs(a: Path, b: Path, *, tolerance: float) -> LogDiff:
    """Compare two logs.

    Args:
        a, b: logs of runs; of other ROS 2 logs the messages are compared.
        tolerance: numbers in messages that differ by no more count as the same, whatever their unit.

    Raises:
        InvalidInput: one is no log, is damaged, or cannot be judged.
    """
    if not (is_own(a) and is_own(b)):
        foreign = [path.name for path in (a, b) if not is_own(path)]
        verb = "tells" if len(foreign) == 1 else "tell"
        why = f"{' and '.join(foreign)} {verb} of no task: messages alone are compared"
        return LogDiff(str(a), str(b), None, (), compare_logs(a, b, tolerance=tolerance), (why,), tolerance)
    recordings = open_recording(a), open_recording(b)
    sides = _side(recordings[0], a), _side(recordings[1], b)
    entries = tuple(one for one in compare_entries(*recordings) if one.name not in OUTCOME)
    apart, notes = _apart(*recordings), []
    if apart:
        notes.append(f"messages are not compared: {apart}")
        messages = Comparison((), 0.0)
    else:
        messages = compare_logs(a, b, tolerance=tolerance, besides=PLACES)
    if sides[0].task != sides[1].task:
        notes.append(f"the tasks are others, '{sides[0].task}' and '{sides[1].task}': steps of one id are compared")
    notes += [f"{path.name}: {one.lost}" for path, one in ((a, recordings[0]), (b, recordings[1])) if one.lost]
    return LogDiff(str(a), str(b), sides, entries, messages, tuple(notes), tolerance)


def _side(recording: Recording, path: Path) -> LogSide:
    verdict = judge_recording(recording, path)
    robot = recorded_robot(recording, path)
    return LogSide(
        task=verdict.task,
        robot=robot.name,
        versions=recording.metadata.get("versions", {}),
        verdict=verdict,
        steps=step_measures(recording, robot, verdict.steps),
    )


def _apart(a: Recording, b: Recording) -> str:
    """Why no message of one says anything about the other's; "" where they do."""
    for what, mine, other in (("joints", a.joint_names, b.joint_names), ("bodies", a.body_names, b.body_names)):
        if mine != other:
            only = [name for name in (*mine, *other) if name not in mine or name not in other]
            named = ", ".join(only[:4]) + (", ..." if len(only) > 4 else "")
            return f"the {what} are others ({named})" if only else f"the {what} stand in another order"
    if a.period != b.period:
        return f"the control periods are {a.period:g} s and {b.period:g} s"
    return ""
