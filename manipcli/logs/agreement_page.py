"""The replay of compared runs: the longest run, with the others as ghosts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.logs.replay import open_playback
from manipcli.logs.report import page_rate
from manipcli.record.read.reading import open_recording
from manipcli.replay.ghost import Ghost, ghost_of
from manipcli.replay.playback import Playback
from manipcli.report.agreement.compared_runs import ComparedRuns


def ghost_playback(
    compared: ComparedRuns, *, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> tuple[tuple[str, Playback] | None, tuple[Ghost, ...]]:
    """The longest run with its name, and the ghosts of the others; None where nothing was run.

    Raises:
        InvalidInput: a log cannot be read.
    """
    shown = []
    for run, report in zip(compared.agreement.runs, compared.reports, strict=True):
        if report.log is None:
            continue
        log = Path(report.log)
        rate, meshes = page_rate(open_recording(log)), report.meshes
        playback = open_playback(log, rate=rate, meshes=meshes, package_path=package_path, allow_outside=allow_outside)
        shown.append((run.name, playback))
    if not shown:
        return None, ()
    longest = max(shown, key=lambda one: one[1].end)
    ghosts = tuple(ghost_of(name, playback, longest[1]) for name, playback in shown if playback is not longest[1])
    return longest, ghosts
