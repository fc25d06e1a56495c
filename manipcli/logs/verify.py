"""Comparison of a log with its re-simulation."""

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
from manipcli.record.recording import END, Recording
from manipcli.report.logs.verification import Verification

UNFINISHED = ("run", END, "verdict", JOINTS, ACTUATORS, LIMITS, "repair")
"""Metadata that a run writes at its end; it is missing or different in an unfinished log."""


def refused_as_unlike(unlike: Sequence[Diagnostic]) -> InvalidInput:
    """The error for a log that is not re-simulated because its inputs differ."""
    *others, last = (replace(finding, severity="error") for finding in unlike)
    hint = "re-simulate anyway with --allow-different; the results are then not comparable"
    return InvalidInput([*others, replace(last, hint=hint)])


def compared(
    recording: Recording, log: Path, rerun: Path, *, unlike: tuple[Diagnostic, ...], began: float
) -> Verification:
    """Comparison of messages, metadata and attachments of a log and its re-run.

    Args:
        recording: the opened log.
        log: path of the log.
        rerun: path of the finished log of the re-run.
        unlike: versions and meshes that differ from those of the run.
        began: start of the verification, by `perf_counter` [s].
    """
    second = open_recording(rerun)
    interrupted = recording.end.get("status") == RunStatus.INTERRUPTED
    cut = recording.lost or ("the run was interrupted" if interrupted else "")
    same = filecmp.cmp(log, rerun, shallow=False)
    messages = compared_with_itself(log) if same else compare_logs(log, rerun, exact=True, open_end=bool(cut))
    entries = () if same else compare_entries(recording, second)
    if cut:
        entries = tuple(entry for entry in entries if entry.name not in UNFINISHED)
    if unlike:
        entries = tuple(entry for entry in entries if entry.name not in ("versions", "meshes"))
    return Verification(
        log=str(log),
        versions=second.metadata["versions"],
        messages=messages,
        entries=entries,
        unlike=unlike,
        cut=cut,
        wall_time=time.perf_counter() - began,
    )
