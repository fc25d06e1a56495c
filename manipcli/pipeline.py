"""READ FIRST: the whole program. Files -> task -> plan -> recording -> verdict.

`run_task` is the sentence; each word of it is a function of the stage that does it. The recording is the only witness:
the verdict of a run is that of its log, read back from the file before it gets its name.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from manipcli.core.errors import Finding, NotPlannable, SimulationFailed
from manipcli.core.stopwatch import Stopwatch
from manipcli.flow.check import check_files, kind_of, schema, words
from manipcli.flow.controllers import controllers_of
from manipcli.flow.execute import Progress, controllers, simulate
from manipcli.flow.load import Task, load_libraries
from manipcli.flow.log import default_log, judge_log, known_of, mesh_files, open_log, run_metadata, verdict_metadata
from manipcli.flow.plan import Plan, plan_task, refused
from manipcli.flow.recorded_task import recorded_task
from manipcli.flow.sample import load_task
from manipcli.flow.verify import compared, refused_as_unlike
from manipcli.flow.vocabulary import meanings
from manipcli.judge.steps import RunStatus
from manipcli.judge.verdict import INTERRUPTED, Verdict
from manipcli.preflight.preflight_findings import preflight_findings
from manipcli.record.faults import RecordingFailed
from manipcli.record.reading import open_recording
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.verification import Verification

__all__ = [
    "Finding",
    "Plan",
    "Task",
    "check_files",
    "controllers_of",
    "judge_log",
    "kind_of",
    "load_task",
    "meanings",
    "plan_task",
    "run_task",
    "schema",
    "verify_log",
    "words",
]


def run_task(
    path: Path,
    *,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    sample: int | None = None,
    log: Path | None = None,
    force: bool = False,
    embed_meshes: bool = False,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    progress: Progress | None = None,
) -> RunReport:
    """Load, plan, simulate, record and judge a task.

    Args:
        path: the task file.
        overrides: `scene.cup.mass=80 g`, as after `--set`.
        seed: instead of the task's.
        sample: which one of its `vary:`; None for the task as it is written.
        log: where the log goes; default `runs/<task>.mcap`, which is replaced.
        force: replace `log` if it exists.
        embed_meshes: put the files of all meshes into the log, so that it is shown without any package.
        package_path, allow_outside: see `load_task`.
        progress: told of steps and ticks.

    Returns:
        The verdict on the log, and how long what took. A step that cannot be planned (nothing was simulated, there
        is no log), a simulation that left the plausible, or an interruption is in the verdict, too.

    Raises:
        InvalidInput: a file or the log's path cannot be used; nothing was simulated.
        RecordingFailed: the disk refused more of the log.
    """
    began = time.perf_counter()
    task = load_task(
        path, overrides=overrides, seed=seed, sample=sample, package_path=package_path, allow_outside=allow_outside
    )
    warnings = tuple(finding for finding in task.findings if finding.severity == "warning")
    if progress is not None and warnings:
        progress.warned(warnings)
    load_libraries(task)
    loaded = time.perf_counter()
    try:
        plan = plan_task(task, doing=_told(progress))
    except NotPlannable as refusal:
        took = time.perf_counter() - began
        timing = Timing(load=loaded - began, plan=began + took - loaded, simulate=0.0, judge=0.0)
        return RunReport(
            refused(task, refusal), wall_time=took, real_time_factor=None, log=None, timing=timing, warnings=warnings
        )
    doubts = preflight_findings(task, plan)
    planned = time.perf_counter()
    if progress is not None and doubts:
        progress.warned(doubts)

    where = log if log is not None else default_log(task)
    try:
        verdict, simulated, planning = _recorded(
            task, plan, where, overwrite=force or log is None, embed_meshes=embed_meshes, progress=progress
        )
    except RecordingFailed as failure:
        failure.known = known_of(task, failure.partial)
        raise
    judged = time.perf_counter()
    timing = Timing(
        load=loaded - began,
        plan=planned - loaded + planning,
        simulate=simulated - planned - planning,
        judge=judged - simulated,
    )
    return RunReport(
        verdict=verdict,
        wall_time=judged - began,
        real_time_factor=verdict.simulated_time / timing.simulate,
        log=str(where),
        timing=timing,
        warnings=(*warnings, *doubts),
        meshes=mesh_files(task),
    )


def verify_log(
    log: Path,
    *,
    allow_different: bool = False,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    progress: Progress | None = None,
) -> Verification:
    """Plan, simulate and record again what a log holds, and compare the two logs.

    Args:
        log: the log of a run, or what a killed run left.
        allow_different: also with another version of manipcli or of the engine, or other meshes.
        package_path, allow_outside: where meshes are looked for that it does not carry.
        progress: told of steps and ticks.

    Raises:
        InvalidInput: the log lacks something, or versions or meshes are others.
        NotPlannable: a step cannot be planned any more.
    """
    began = time.perf_counter()
    recording = open_recording(log)
    recorded = recorded_task(recording, log, package_path=package_path, allow_outside=allow_outside)
    if recorded.unlike and not allow_different:
        raise refused_as_unlike(recorded.unlike)
    plan = plan_task(recorded.task)
    with TemporaryDirectory(prefix="manipcli-") as folder:
        again = Path(folder) / "again.mcap"
        verdict, _, _ = _recorded(
            recorded.task, plan, again, overwrite=False, embed_meshes=recorded.embedded, progress=progress
        )
        if any(finding.code == INTERRUPTED for finding in verdict.errors):
            raise KeyboardInterrupt
        return compared(recording, log, again, unlike=recorded.unlike, began=began)


def _told(progress: Progress | None) -> Callable[[str], None]:
    """Who is told what is being done."""
    return progress.doing if progress is not None else lambda _: None


def _recorded(
    task: Task, plan: Plan, where: Path, *, overwrite: bool, embed_meshes: bool, progress: Progress | None
) -> tuple[Verdict, float, float]:
    """Simulate into a log that is judged before it gets its name; the verdict, when the simulation was over, and how
    long it was held up by planning."""
    manager = controllers(task, plan.planner.kinematics)
    replanning = Stopwatch()
    recorder = open_log(task, plan, manager, where, overwrite=overwrite, embed_meshes=embed_meshes)
    try:
        status, cause = RunStatus.COMPLETE, ""
        try:
            simulate(task, plan, manager, recorder, progress, replanning)
        except SimulationFailed as failure:
            status, cause = RunStatus.FAILED, str(failure)
        except KeyboardInterrupt:
            status, cause = RunStatus.INTERRUPTED, "interrupted by the user"
        recorder.metadata("run", run_metadata(task, status=status, cause=cause))
        simulated = time.perf_counter()
        verdict = judge_log(recorder.partial_path, being_written=True, doing=_told(progress))
        recorder.finish(verdict_metadata(verdict))
    finally:
        recorder.close_partial()
    return verdict, simulated, replanning.seconds
