"""The planned ghost of a log: its task is planned again from its files, as `verify` does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.logs.recorded_task import recorded_task
from manipcli.plan.outline import PLAN_FILE, PlanOutline, StepOutline
from manipcli.record.foreign.origin import is_own
from manipcli.record.read.reading import open_recording
from manipcli.replay.ghost import Ghost
from manipcli.replay.planned_ghost import planned_ghost
from manipcli.replay.playback import Playback
from manipcli.task.plan_task import plan_task

_SAME: Final = 1e-6
"""Largest difference of the durations of a step in two equal plans [s]; other machines round differently."""


def open_planned_ghost(
    path: Path, shown: Playback, *, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> tuple[Ghost | None, tuple[str, ...]]:
    """The planned ghost of a log, and notes: why there is none, or why its plan can differ from that of the run.

    Args:
        path: the log.
        shown: its playback.
        package_path, allow_outside: where meshes are searched, see `open_playback`.
    """
    try:
        if not is_own(path):
            return None, ("no planned ghost: the log is of another program",)
        recording = open_recording(path)
        recorded = recorded_task(recording, path, package_path=package_path, allow_outside=allow_outside)
        plan = plan_task(recorded.task)
        ghost = planned_ghost(plan, shown)
    except InvalidInput as refusal:
        return None, tuple(f"no planned ghost: {finding.message}" for finding in refusal.findings[:1])
    except NotPlannable as refusal:
        return None, (f"no planned ghost: planning the task again failed: {refusal}",)
    if ghost is None:
        return None, ("no planned ghost: no step that began was planned before the run",)
    outline = PlanOutline.read(recording.attachments.get(PLAN_FILE))
    notes = (*(finding.message for finding in recorded.unlike), *plan_differences(outline.steps, plan.listed))
    return ghost, tuple(f"planned ghost: {note}" for note in notes)


def plan_differences(recorded: Sequence[StepOutline], planned: Sequence[StepOutline]) -> Iterator[str]:
    """One sentence about the first step whose plan takes another time than in the log; none if all take the same."""
    now = {step.id: step.planned_duration for step in planned}
    for step in recorded:
        then, other = step.planned_duration, now.get(step.id)
        if then is None or other is None:
            if then is not other:
                yield f"step '{step.id}' was {_planned(then)} before the run, and is {_planned(other)} now"
                return
        elif not math.isclose(then, other, rel_tol=0.0, abs_tol=_SAME):
            yield f"step '{step.id}' takes {other:.3f} s in it, but {then:.3f} s in the plan of the run"
            return


def _planned(duration: float | None) -> str:
    return "not planned" if duration is None else "planned"
