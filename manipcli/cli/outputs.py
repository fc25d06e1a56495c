"""Output files of commands: checks of their paths, and `--report` and `--junit` of a run."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, InvalidInput

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from manipcli.judge.verdict import Verdict
    from manipcli.pipeline import Task
    from manipcli.report.agreement.compared_runs import ComparedRuns

ReportFile = Annotated[
    Path | None,
    typer.Option("--report", metavar="FILE.html", help="Write an HTML report: verdict, cause, replay, numbers."),
]
JunitFile = Annotated[Path | None, typer.Option("--junit", metavar="FILE.xml", help="Write the verdict as JUnit XML.")]


def check_outputs(*outputs: tuple[str, Path | None], reads: Sequence[Path | None] = ()) -> None:
    """Checks the output files of a command before anything is run, and creates their folders.

    Args:
        outputs: the option and its path; None: the option is not given.
        reads: files that the same command reads, or writes under other rules.

    Raises:
        InvalidInput: a path is used twice, is a folder or `-`, or its folder cannot be created or is not writable.
    """
    taken = [os.path.realpath(path) for path in reads if path is not None]
    for option, path in outputs:
        if path is None:
            continue
        if str(path) == "-":
            message = f"{option} '-': stdout holds the result of the command; expected a file name"
            raise InvalidInput([Diagnostic("USE083", message)])
        if os.path.realpath(path) in taken:
            raise InvalidInput([Diagnostic("USE081", f"{option} '{path}': the command already uses this file")])
        if path.is_dir():
            raise InvalidInput([Diagnostic("USE082", f"{option} '{path}': is a folder")])
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            message = f"{option} '{path}': cannot create folder '{path.parent}': {error.strerror}"
            raise InvalidInput([Diagnostic("USE082", message)]) from error
        whole = path if path.exists() and not path.is_file() else Path(os.path.realpath(path)).parent
        if not os.access(whole, os.W_OK):
            raise InvalidInput([Diagnostic("USE082", f"{option} '{path}': '{whole}' is not writable")])
        _try(option, path)
        taken.append(os.path.realpath(path))


def _try(option: str, path: Path) -> None:
    """Creates and removes the temporary file of `path`: permissions do not show a read-only or full file system.

    Raises:
        InvalidInput: it cannot be created.
    """
    from manipcli.core.whole_file import touched

    try:
        touched(path)
    except OSError as error:
        raise InvalidInput([Diagnostic("USE082", f"{option} '{path}': {error.strerror or error}")]) from error


def check_picture(path: Path | None) -> None:
    """
    Raises:
        InvalidInput: its suffix is not `.png`.
    """
    if path is not None and path.suffix.lower() != ".png":
        raise InvalidInput([Diagnostic("USE063", f"'{path}' is not a .png file")])


class Outputs:
    """The `--report` and `--junit` files of a command; their paths are checked before anything is run.

    Args:
        report, junit: path of each, or None.
        others: files that the same command writes or reads.
        quiet: do not print which files are written.

    Raises:
        InvalidInput: a file cannot be written there.
    """

    def __init__(
        self, report: Path | None, junit: Path | None, *, others: Sequence[Path | None] = (), quiet: bool = False
    ) -> None:
        self._report, self._junit, self._quiet = report, junit, quiet
        check_outputs(("--report", report), ("--junit", junit), reads=others)

    @property
    def wanted(self) -> bool:
        """Whether one of the options is given."""
        return self._report is not None or self._junit is not None

    def of_log(
        self,
        log: Path,
        verdict: Verdict,
        *,
        task: Path | None = None,
        overrides: Sequence[str] = (),
        warnings: Sequence[Diagnostic] = (),
        meshes: Mapping[str, Path] = {},
        package_path: Sequence[Path] = (),
        allow_outside: bool = False,
    ) -> None:
        """Writes the requested files about a log; each is written completely or not at all.

        Args:
            log: the judged log.
            verdict: of the log.
            task, overrides: task file and its overrides, where the command knows them.
            warnings: of the files and the plan, before the run.
            meshes, package_path, allow_outside: known mesh files, and where others may be.
        """
        from manipcli.logs.causes import file_places, log_places
        from manipcli.logs.report import log_page
        from manipcli.record.read.reading import open_recording
        from manipcli.report.html.render_page import render_page
        from manipcli.report.junit import render_junit

        self._forget()
        if self._junit is not None:
            if task is not None:
                places = file_places(task, overrides)
            else:
                places = log_places(open_recording(log), log, verdict.steps)
            file = str(task) if task is not None else ""
            self._write(self._junit, render_junit(verdict, *places, log=log.name, file=file))
        if self._report is not None:
            page = log_page(log, meshes=meshes, package_path=package_path, allow_outside=allow_outside)
            self._write(self._report, render_page(replace(page, warnings=tuple(warnings))).encode())

    def of_comparison(
        self, compared: ComparedRuns, *, package_path: Sequence[Path] = (), allow_outside: bool = False
    ) -> None:
        """Writes the requested page about compared runs."""
        from manipcli.logs.agreement_page import ghost_playback
        from manipcli.report.html.agreement_page import render_page

        self._forget()
        if self._report is not None:
            shown, ghosts = ghost_playback(compared, package_path=package_path, allow_outside=allow_outside)
            self._write(self._report, render_page(compared, shown, ghosts).encode())

    def of_refusal(self, task: Task, verdict: Verdict, file: Path, warnings: Sequence[Diagnostic]) -> None:
        """Writes the requested files about a task with a step that cannot be planned."""
        from manipcli.logs.causes import task_places
        from manipcli.logs.report import refused_page
        from manipcli.report.html.render_page import render_page
        from manipcli.report.junit import render_junit

        self._forget()
        if self._junit is not None:
            self._write(self._junit, render_junit(verdict, *task_places(task.file), file=str(file)))
        if self._report is not None:
            page = replace(refused_page(task, verdict), warnings=tuple(warnings))
            self._write(self._report, render_page(page).encode())

    def of_invalid(self, findings: Sequence[Diagnostic], *, task: Path | None = None, log: Path | None = None) -> None:
        """Writes the requested files about an unusable task or log, so that no page of an earlier run is left."""
        file = task or log
        if file is None or not self.wanted:
            return
        from manipcli.logs.invalid_input import invalid_page, invalid_verdict
        from manipcli.report.html.render_page import render_page
        from manipcli.report.junit import render_junit

        self._forget()
        verdict, name = invalid_verdict(file, findings), log.name if log is not None else ""
        if self._junit is not None:
            self._write(self._junit, render_junit(verdict, (), (), log=name))
        if self._report is not None:
            self._write(self._report, render_page(invalid_page(verdict, findings, log=name)).encode())

    def _forget(self) -> None:
        """Removes the files of an earlier run, which must not be left where writing fails (a full disk)."""
        for path in (self._report, self._junit):
            if path is not None and path.is_file():
                Path(os.path.realpath(path)).unlink(missing_ok=True)

    def _write(self, path: Path, data: bytes) -> None:
        from manipcli.core.whole_file import write_whole

        write_whole(path, data)
        if not self._quiet:
            console.talk(f"written: {path}")
