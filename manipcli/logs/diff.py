"""Comparison of two logs: inputs, verdicts, step measures and messages."""

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
"""Metadata of the result of a run, which is recomputed from the messages."""
PLACES = {EVENTS: ("place",), ROSOUT: ("file", "line")}
"""Fields that are not compared: a comment in the task file changes the line of a step."""


def diff_logs(a: Path, b: Path, *, tolerance: float) -> LogDiff:
    """Compare two logs.

    Args:
        a, b: logs of runs; for other ROS 2 logs only the messages are compared.
        tolerance: largest difference of numbers in messages that counts as equal, in any unit.

    Raises:
        InvalidInput: a file is not a log, is damaged, or cannot be judged.
    """
    if not (is_own(a) and is_own(b)):
        foreign = [path.name for path in (a, b) if not is_own(path)]
        why = f"{' and '.join(foreign)} not written by manipcli: only messages are compared"
        return LogDiff(str(a), str(b), None, (), compare_logs(a, b, tolerance=tolerance), (why,), tolerance)
    recordings = open_recording(a), open_recording(b)
    sides = _side(recordings[0], a), _side(recordings[1], b)
    entries = tuple(entry for entry in compare_entries(*recordings) if entry.name not in OUTCOME)
    apart, notes = _apart(*recordings), []
    if apart:
        notes.append(f"messages are not compared: {apart}")
        messages = Comparison((), 0.0)
    else:
        messages = compare_logs(a, b, tolerance=tolerance, besides=PLACES)
    if sides[0].task != sides[1].task:
        notes.append(f"the tasks differ, '{sides[0].task}' and '{sides[1].task}': steps with the same id are compared")
    notes += [f"{path.name}: {log.lost}" for path, log in ((a, recordings[0]), (b, recordings[1])) if log.lost]
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
    """Why the messages of two logs cannot be compared; "" if they can."""
    for what, mine, other in (("joints", a.joint_names, b.joint_names), ("bodies", a.body_names, b.body_names)):
        if mine != other:
            only = [name for name in (*mine, *other) if name not in mine or name not in other]
            named = ", ".join(only[:4]) + (", ..." if len(only) > 4 else "")
            return f"the {what} differ ({named})" if only else f"the order of the {what} differs"
    if a.period != b.period:
        return f"the control periods differ: {a.period:g} s and {b.period:g} s"
    return ""
