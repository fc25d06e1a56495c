"""Judging a log from the log alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from manipcli.conditions.formula import sensors_of
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.sensed import NO_SENSORS, Sensed
from manipcli.judge.implied import implied
from manipcli.judge.judge import RUN, judge
from manipcli.judge.margin_curves import MarginTraces
from manipcli.judge.verdict import Verdict
from manipcli.logs.recorded_files import (
    recorded_controllers_file,
    recorded_robot,
    recorded_robot_file,
    recorded_scene,
    recorded_task_file,
)
from manipcli.model.robot import RobotModel
from manipcli.record.read.reading import open_recording
from manipcli.record.read.spans import with_readings
from manipcli.record.recording import Recording, Span
from manipcli.scene.scene import Scene
from manipcli.simulate.sensor_layout import sensed_by_name
from manipcli.spec.task import TaskSpec
from manipcli.task.felt import felt


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
    return judge_recording(recording, path, activity=activity)


@dataclass(frozen=True, slots=True)
class _Watched:
    """Spans with a callback for each one read."""

    spans: Iterable[Span]
    activity: Callable[[str], None]

    def __iter__(self) -> Iterator[Span]:
        for span in self.spans:
            self.activity("judging")
            yield span


def judge_recording(
    recording: Recording,
    path: Path,
    *,
    activity: Callable[[str], None] = lambda _: None,
    traces: MarginTraces | None = None,
) -> Verdict:
    """The verdict on an open log; see `judge_log`. `traces`: get the margins of the expectations over time."""
    task = recorded_task_file(recording, path).spec
    robot = recorded_robot(recording, path)
    physics = recording.metadata.get(RUN, {}).get("physics", "") == "full"
    unwritten = implied(task, lambda: recorded_controllers_file(recording, path).spec, robot) if physics else ()
    scene = recorded_scene(recording, path)
    asked = {sensor for each in task.judged for sensor in sensors_of(each.condition, CONDITIONS)}
    sensors = _sensors(recording, path, task, robot, scene) if asked else NO_SENSORS
    recording = with_readings(recording, {name: sensors[name] for name in sorted(asked & {*sensors})})
    watched = replace(recording, spans=_Watched(recording.spans, activity))
    return judge(
        watched, expect=task.judged, robot=robot, scene=scene, implied=unwritten, sensors=sensors, traces=traces
    )


def _sensors(recording: Recording, path: Path, task: TaskSpec, robot: RobotModel, scene: Scene) -> Mapping[str, Sensed]:
    """The sensors of the robot file and of the task."""
    of_robot = recorded_robot_file(recording, path).spec.sensors or {}
    return {**felt(task), **sensed_by_name({**of_robot, **(task.sensors or {})}, robot, scene)}
