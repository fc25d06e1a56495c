"""Numbers of a run for `agreement`, from its log and its task file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from manipcli.core.errors import Loc, Place
from manipcli.judge.agreement import LIMITS
from manipcli.judge.measured_run import GraspNumbers, MeasuredRun, Variant
from manipcli.judge.measures.grasp_intervals import GraspFacts, GraspMeter, find_grasps
from manipcli.judge.measures.step_measures import step_measures
from manipcli.logs.recorded_files import recorded_robot, recorded_scene
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording
from manipcli.report.run_report import RunReport
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec


def measured_run(variant: Variant, task: Located[TaskSpec], report: RunReport) -> MeasuredRun:
    """The numbers of one run.

    Args:
        variant: how it was run.
        task: its file, with the overrides of the variant.
        report: of the run, with its log.

    Raises:
        InvalidInput: the log cannot be read.
    """
    grasps: tuple[GraspNumbers, ...] = ()
    forces: dict[str, float] = {}
    if report.log is not None:
        log = Path(report.log)
        recording = open_recording(log)
        grasps = tuple(_numbered(_grasps(recording, log)))
        steps = step_measures(recording, recorded_robot(recording, log), report.verdict.steps)
        forces = {step.id: step.force for step in steps if step.force is not None}
    return MeasuredRun(
        variant=variant,
        verdict=report.verdict,
        step=task.spec.simulation.step,
        wall_time=report.wall_time,
        log=report.log,
        grasps=grasps,
        forces=forces,
        agree=task.spec.agree,
        places=_places(task),
    )


def _grasps(recording: Recording, log: Path) -> list[GraspFacts]:
    robot, scene = recorded_robot(recording, log), recorded_scene(recording, log)
    joints = [recording.joint_names.index(name) for name in robot.joint_names]
    bodies = {name: k for k, name in enumerate(recording.body_names)}
    holds, _ = find_grasps(recording, scene)
    meters = [GraspMeter(hold, robot, scene, joints) for hold in holds if hold.body in bodies]
    for span in recording.spans if meters else ():
        if len(span.states.time):
            for meter in meters:
                meter.add(span, bodies)
    return [meter.finish() for meter in meters]


def _numbered(grasps: Iterable[GraspFacts]) -> Iterable[GraspNumbers]:
    counts = Counter[str]()
    for grasp in grasps:
        body = grasp.hold.body
        counts[body] += 1
        yield GraspNumbers(
            body if counts[body] == 1 else f"{body}_{counts[body]}",
            None if grasp.slip is None else grasp.slip.most,
            None if grasp.rotation is None else grasp.rotation.most,
            grasp.force.most,
        )


def _places(task: Located[TaskSpec]) -> dict[Loc, Place]:
    """`MeasuredRun.places`; `("judged", k)` is the k-th of expectations and watches."""
    spec = task.spec
    keys: list[Loc] = [("task",), *(("steps", k) for k in range(len(spec.steps)))]
    limits = ("margin", *dict.fromkeys(LIMITS.values()))
    keys += [("agree", key) for key in limits if getattr(spec.agree, key) is not None]
    keys += [("agree", "margins", name) for name in spec.agree.margins]
    judged: list[Loc] = [("judged", k) for k in range(len(spec.judged_at))]
    places = zip((*keys, *judged), (*keys, *spec.judged_at), strict=True)
    return {key: task.place(*at) for key, at in places}
