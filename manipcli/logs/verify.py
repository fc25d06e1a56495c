"""A log against a second one that was simulated from what the first holds."""

from __future__ import annotations

import filecmp
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.judge.saturations import ACTUATORS, JOINTS, LIMITS
from manipcli.judge.steps import RunStatus
from manipcli.record.foreign.compare import compare_logs, compared_with_itself
from manipcli.record.read.compare_entries import compare_entries
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording
from manipcli.report.logs.verification import Verification

UNFINISHED = ("run", "verdict", JOINTS, ACTUATORS, LIMITS, "repair")
"""Metadata that a run writes at its end; one that did not come to its end lacks it, or says something else."""


def refused_as_unlike(unlike: Sequence[Diagnostic]) -> InvalidInput:
    """Why a log is not simulated again: what would come out says nothing about it."""
    *others, last = (replace(finding, severity="error") for finding in unlike)
    hint = "with --allow-different it is simulated all the same; differences say little then"
    return InvalidInput([*others, replace(last, hint=hint)])


def compared(
    recording: Recording, log: Path, again: Path, *, unlike: tuple[Diagnostic, ...], began: float
) -> Verification:
    """Everything in two logs, compared.

    Args:
        recording: of `log`, opened.
        log: the log.
        again: what was simulated from it; finished.
        unlike: what is not as it was in the run of the log.
        began: of the verification, by `perf_counter`.
    """
    second = open_recording(again)
    interrupted = recording.metadata.get("run", {}).get("status") == RunStatus.INTERRUPTED
    cut = recording.lost or ("the run was interrupted" if interrupted else "")
    same = filecmp.cmp(log, again, shallow=False)
    messages = compared_with_itself(log) if same else compare_logs(log, again, exact=True, open_end=bool(cut))
    entries = () if same else compare_entries(recording, second)
    if cut:
        entries = tuple(one for one in entries if one.name not in UNFINISHED)
    if unlike:
        entries = tuple(one for one in entries if one.name not in ("versions", "meshes"))
    return Verification(
        log=str(log),
        versions=second.metadata["versions"],
        messages=messages,
        entries=entries,
        unlike=unlike,
        cut=cut,
        wall_time=time.perf_counter() - began,
    )
