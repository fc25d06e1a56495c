"""READ FIRST: the whole program as one pipeline. Files -> task -> plan -> recording -> verdict.

Each stage of `run_task` is a function of the layer that implements it. The verdict is computed from the recording
alone: the log is read back from its file before the file gets its name.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Unpack

from manipcli.core.errors import Diagnostic, InvalidInput, NotPlannable
from manipcli.core.stopwatch import timed
from manipcli.judge.agreement import compare
from manipcli.judge.measured_run import Variant
from manipcli.judge.verdict import INTERRUPTED, Verdict
from manipcli.live.loop import Outside, simulate_live
from manipcli.live.session import LiveOptions, recorded_session, served, session_logs
from manipcli.logs.judge_log import judge_log
from manipcli.logs.measure_run import measured_run
from manipcli.logs.part_of import part_until, task_part
from manipcli.logs.recorded_task import recorded_task
from manipcli.logs.verify import compared, refused_as_unlike
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import SelfCollisionMatrix
from manipcli.model.self_collision_cache import self_collision_matrix
from manipcli.preflight.check_files import check_files, kind_of, schema, words
from manipcli.preflight.editor_schema import updated_schema
from manipcli.preflight.findings import preflight_findings
from manipcli.record.faults import RecordingRefused
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import END
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.logs.verification import Verification
from manipcli.report.ros2.files import robot_files, task_files
from manipcli.report.run_report import RunReport, Timing
from manipcli.run.execute import build_manager, simulate
from manipcli.run.libraries import load_libraries
from manipcli.run.observer import SILENT, Progress
from manipcli.run.prepared import Prepared
from manipcli.run.run_log import RUNS, default_log, mesh_files, open_log, variant_log, verdict_metadata
from manipcli.spec.simulation import SimulationSpec
from manipcli.task.bare_task import bare_task
from manipcli.task.controller_rows import checked_controllers, controllers_of
from manipcli.task.explanation import Explanation, explained
from manipcli.task.load_task import FileOptions, LoadOptions, load_task
from manipcli.task.load_view import Sight, load_sight
from manipcli.task.part import LIVE, LIVE_RUN
from manipcli.task.plan_task import Plan, plan_task, refused, unplanned
from manipcli.task.robot_facts import RobotFacts, robot_facts
from manipcli.task.task import Task
from manipcli.task.variants import overrides_of, simulation_of
from manipcli.task.vocabulary import meanings

__all__ = [
    "Diagnostic",
    "Plan",
    "RobotFacts",
    "Sight",
    "Task",
    "bare_task",
    "check_files",
    "compare_runs",
    "controllers_of",
    "explain_task",
    "judge_log",
    "kind_of",
    "load_sight",
    "load_task",
    "meanings",
    "plan_task",
    "refused",
    "robot_facts",
    "ros2_files",
    "run_task",
    "schema",
    "self_collisions",
    "simulation_of",
    "unplanned",
    "up_to",
    "updated_schema",
    "verify_log",
    "words",
]


def explain_task(path: Path, **options: Unpack[FileOptions]) -> tuple[Explanation, tuple[Diagnostic, ...]]:
    """A task in English, with the origin of each value, and the warnings about its files. Nothing is planned.

    Raises:
        InvalidInput: all errors of the files.
    """
    task = load_task(path, **options)
    return explained(task), task.warnings


def self_collisions(
    path: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> tuple[RobotModel, SelfCollisionMatrix]:
    """The robot of a robot file, a description or a task, and its self-collision matrix.

    Raises:
        InvalidInput: all errors of the file.
    """
    robot = load_sight(path, package_path=package_path, allow_outside=allow_outside).robot
    return robot, self_collision_matrix(robot)


def ros2_files(
    path: Path, *, controllers: Path | None = None, **options: Unpack[FileOptions]
) -> tuple[dict[str, str], tuple[str, ...]]:
    """A robot file, a description or a planned task as files for ROS 2: texts by path, and notes on what differs.

    Args:
        path: the file.
        controllers: controllers file of a robot; a task names its own.
        options: how the files are read.

    Raises:
        InvalidInput: all errors of the files.
        NotPlannable: a step of the task has no plan.
    """
    kind = kind_of(path)
    if kind == "task":
        if controllers is not None:
            raise InvalidInput([Diagnostic("USE091", f"task '{path}' names its controllers: remove --controllers")])
        task = load_task(path, **options)
        return task_files(task, plan_task(task), self_collision_matrix(task.robot))
    if kind == "controllers":
        message = f"'{path}' is a controllers file; expected a robot or a task"
        raise InvalidInput([Diagnostic("USE091", message, hint="give the task that uses it")])
    if options.get("overrides") or options.get("seed") is not None:
        raise InvalidInput([Diagnostic("USE091", f"--set and --seed need a task; '{path}' is not one")])
    sight = load_sight(
        path, package_path=options.get("package_path", ()), allow_outside=options.get("allow_outside", False)
    )
    period = SimulationSpec().control_period
    spec = None if controllers is None else checked_controllers(controllers, sight.robot, period)
    return robot_files(sight.robot, sight.q, self_collision_matrix(sight.robot), spec, period=period)


def up_to(task: Task, step: str, *, option: str = "--until") -> Task:
    """The task from its start to a step, as `run --until` runs it; `option`: names the step in errors.

    Raises:
        InvalidInput: an unknown step or block, or one inside a block not done in order.
    """
    return replace(task, part=part_until(task, step, option=option))


def run_task(
    path: Path,
    *,
    log: Path | None = None,
    force: bool = False,
    embed_meshes: bool = False,
    from_step: str | None = None,
    until: str | None = None,
    state: Path | None = None,
    progress: Progress = SILENT,
    prepared: Prepared | None = None,
    **options: Unpack[LoadOptions],
) -> RunReport:
    """Loads, plans, simulates, records and judges a task.

    Args:
        path: the task file.
        log: path of the log; default `runs/<task>.mcap`, which is replaced.
        force: replace `log` if it exists.
        embed_meshes: store all mesh files in the log, so that it can be shown without packages.
        from_step: id of the step at which the run begins, with the state of another run; its log is
            `runs/<task>@from.mcap` by default.
        until: id of the step after which the run ends.
        state: the log with the state before `from_step`; default `runs/<task>.mcap`.
        progress: receives warnings, steps and ticks.
        prepared: the same task, loaded and planned before; ignored if a file has changed.
        options: how the task is loaded, see `LoadOptions`.

    Returns:
        The verdict on the log, and the duration of each stage. A step that cannot be planned (then nothing is simulated
        and no log is written), a diverged simulation and an interruption are part of the verdict.

    Raises:
        InvalidInput: a file or the path of the log is invalid; nothing was simulated.
        RecordingFailed: writing the log failed.
    """
    task, loading = timed(_load, path, progress, options, prepared)
    if from_step is not None or until is not None:
        origin = state or RUNS / f"{task.name}.mcap"
        task = replace(task, part=task_part(task, first=from_step, last=until, log=origin))
    (plan, warnings), planning = timed(_plan, task, progress, prepared)
    if isinstance(plan, Verdict):
        return RunReport(plan, Timing(load=loading, plan=planning), warnings=warnings)
    where = log if log is not None else default_log(task)
    verdict, timing = _record(
        task, plan, where, progress, None, overwrite=force or log is None, embed_meshes=embed_meshes
    )
    timing = replace(timing, load=loading, plan=planning + timing.plan)
    size = where.stat().st_size if where.is_file() else None
    return RunReport(verdict, timing, log=str(where), warnings=warnings, meshes=mesh_files(task), log_size=size)


def compare_runs(
    path: Path,
    variants: Sequence[Variant],
    *,
    log: Path | None = None,
    force: bool = False,
    embed_meshes: bool = False,
    progress: Progress = SILENT,
    started: Callable[[Variant], None] = lambda _: None,
    **options: Unpack[LoadOptions],
) -> ComparedRuns:
    """Runs a task in several engines, or also at half the step, and compares the runs.

    Args:
        path: the task file.
        variants: the runs: engines, each optionally also at half the step.
        log: path of a log, `x.mcap`; the logs are `x@<variant>.mcap`. Default `runs/<task>.mcap`; replaced.
        force: replace the logs of `log` if they exist.
        embed_meshes: see `run_task`.
        progress: receives warnings, steps and ticks of each run.
        started: called before each run.
        options: how the task is loaded, see `LoadOptions`; the variant replaces engine and step.

    Raises:
        InvalidInput: a file is invalid, or an engine refuses the task; nothing was simulated.
        RecordingFailed: writing a log failed.
        KeyboardInterrupt: a run was interrupted.
    """
    for where in (variant_log(log, variant) for variant in variants) if log is not None and not force else ():
        if where.exists():  # before the other runs, not after them
            raise RecordingRefused(where, "the file exists", hint="choose another name, or pass --force to replace it")
    overrides, seed = options.get("overrides", ()), options.get("seed")
    chosen: list[LoadOptions] = [
        {**options, "overrides": overrides_of(variant, path, overrides=overrides, seed=seed)} for variant in variants
    ]
    tasks = [load_task(path, **variant_options) for variant_options in chosen]  # an engine refuses before any run
    runs, reports = [], []
    for variant, task, variant_options in zip(variants, tasks, chosen, strict=True):
        started(variant)
        report = run_task(
            path,
            log=variant_log(log if log is not None else default_log(task), variant),
            force=force or log is None,
            embed_meshes=embed_meshes,
            progress=progress,
            **variant_options,
        )
        if any(finding.code == INTERRUPTED for finding in report.verdict.errors):
            raise KeyboardInterrupt
        runs.append(measured_run(variant, task.file, report))
        reports.append(report)
    return ComparedRuns(compare(runs), tuple(reports))


def serve_task(
    path: Path,
    live: LiveOptions,
    *,
    log: Path | None = None,
    force: bool = False,
    embed_meshes: bool = False,
    progress: Progress = SILENT,
    between: Callable[[], None],
    announce: Callable[[str], None],
    ended: Callable[[RunReport, str], None] = lambda report, failure: None,
    **options: Unpack[LoadOptions],
) -> tuple[RunReport, str]:
    """Opens the scene of a task, and lets clients command it until the session ends; a reset begins the next one.

    Args:
        path: the task file.
        live: how it is served.
        log: path of the log; default `runs/<task>@live.mcap`. The next ones, and those after an existing one, end with
            -2, -3, ...
        force: replace logs that exist.
        embed_meshes: see `run_task`.
        progress: receives warnings and steps.
        between: called before each tick; a KeyboardInterrupt ends the session.
        announce: called with the URL when clients can connect and the scene has settled.
        ended: called with what is returned when a reset has ended a session.
        options: how the task is loaded, see `LoadOptions`.

    Returns:
        The verdict on the last log, if there is a plan; and why the simulation failed, or "".

    Raises:
        InvalidInput: a file, the port or the path of the log is invalid; nothing was simulated.
        RecordingFailed: writing the log failed.
    """
    task, loading = timed(_load, path, progress, options, None)
    task = replace(task, part=LIVE_RUN if live.run else LIVE)
    (plan, warnings), planning = timed(_plan, task, progress, None)
    if isinstance(plan, Verdict):
        return RunReport(plan, Timing(load=loading, plan=planning), warnings=warnings), ""
    logs = session_logs(log if log is not None else default_log(task), overwrite=force, named=log is not None)
    manager, late = build_manager(task, plan.planner.kinematics), partial(progress.message, detail=False)
    with served(task, manager, live, between=between, announce=announce, late=late) as outside:
        while True:
            where = next(logs)
            verdict, timing = _record(task, plan, where, progress, outside, overwrite=force, embed_meshes=embed_meshes)
            timing = replace(timing, load=loading, plan=planning + timing.plan)
            report = RunReport(verdict, timing, log=str(where), warnings=warnings, meshes=mesh_files(task))
            if not outside.again():
                return report, outside.failure
            ended(report, outside.failure)
            again, planning = timed(plan_task, task)  # a planner that has re-planned would not plan the same again
            plan, loading = again, 0.0


def verify_log(
    log: Path,
    *,
    allow_different: bool = False,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    progress: Progress = SILENT,
) -> Verification:
    """Repeats the recorded run of a log (plan, simulate, record), and compares the two logs.

    Args:
        log: the log of a run, or the unfinished log of a killed run.
        allow_different: also compare with another version of manipcli or of the engine, or other meshes.
        package_path: folders to search for meshes that the log does not embed.
        allow_outside: see `LoadOptions`.
        progress: receives steps and ticks.

    Raises:
        InvalidInput: the log is incomplete, or versions or meshes differ.
        NotPlannable: a step can no longer be planned.
    """
    began = time.perf_counter()
    recording = open_recording(log)
    recorded = recorded_task(recording, log, package_path=package_path, allow_outside=allow_outside)
    if recorded.unlike and not allow_different:
        raise refused_as_unlike(recorded.unlike)
    plan = plan_task(recorded.task)
    with TemporaryDirectory(prefix="manipcli-") as folder:
        repeated = Path(folder) / "repeated.mcap"
        live = recorded_session(recording, log) if recorded.task.part.live else None
        verdict, _ = _record(
            recorded.task, plan, repeated, progress, live, overwrite=False, embed_meshes=recorded.embedded
        )
        if any(finding.code == INTERRUPTED for finding in verdict.errors):
            raise KeyboardInterrupt
        return compared(recording, log, repeated, unlike=recorded.unlike, began=began)


def _load(path: Path, progress: Progress, options: LoadOptions, prepared: Prepared | None) -> Task:
    task = prepared.load(path, **options) if prepared is not None else load_task(path, **options)
    if task.warnings:
        progress.warned(task.warnings)
    load_libraries(task)
    return task


def _plan(task: Task, progress: Progress, prepared: Prepared | None) -> tuple[Plan | Verdict, tuple[Diagnostic, ...]]:
    """The plan, or the verdict on a task without a plan; and all warnings before the run."""
    if task.part == LIVE:
        return plan_task(task), task.warnings
    try:
        plan = prepared.take_plan(task) if prepared is not None else None
        plan = plan or plan_task(task, on_progress=progress.activity)
    except NotPlannable as refusal:
        return refused(task, refusal), task.warnings
    findings = preflight_findings(task, plan)
    progress.warned(findings)
    return plan, (*task.warnings, *findings)


def _record(
    task: Task, plan: Plan, path: Path, progress: Progress, live: Outside | None, *, overwrite: bool, embed_meshes: bool
) -> tuple[Verdict, Timing]:
    """Simulates into a log, which is judged before it gets its name; `live`: a session that clients can command."""
    manager = build_manager(task, plan.planner.kinematics)
    with open_log(task, plan, manager, path, overwrite=overwrite, embed_meshes=embed_meshes) as recorder:
        if live is None:
            end, simulating = timed(simulate, task, plan, manager, recorder, progress)
        else:
            end, simulating = timed(simulate_live, task, plan, manager, recorder, live, progress)
        recorder.metadata(END, {"status": end.status, "cause": end.cause})
        verdict, judging = timed(judge_log, recorder.partial_path, being_written=True, activity=progress.activity)
        recorder.finish(verdict_metadata(verdict))
    return verdict, Timing(plan=end.replanning, simulate=simulating - end.replanning, judge=judging)
