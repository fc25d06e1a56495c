"""`manipcli replay LOG --verify`: a run simulated from its log alone, and compared with it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.options import OutputFormat
from manipcli.core.errors import ExitCode


def verify(
    log: Path,
    *,
    allow_different: bool,
    package_path: Sequence[Path],
    allow_outside: bool,
    format_: OutputFormat,
    interrupts: Interrupts,
) -> ExitCode:
    """Exit code 0 where the new log is identical."""
    from manipcli import pipeline
    from manipcli.cli.progress import StepProgress
    from manipcli.report.logs import verification

    with StepProgress(quiet=not console.is_live(), interrupts=interrupts) as progress:
        made = pipeline.verify_log(
            log,
            allow_different=allow_different,
            package_path=package_path,
            allow_outside=allow_outside,
            progress=progress,
        )
    render = verification.render_json if format_ == "json" else verification.render_text
    console.result(render(made))
    return ExitCode.PASSED if made.identical else ExitCode.FAILED
