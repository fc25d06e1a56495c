"""Files that commands write besides what they print: where they may be, and `--report` and `--junit` of a run."""

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
    from manipcli.task.task import Task

ReportFile = Annotated[
    Path | None,
    typer.Option("--report", metavar="FILE.html", help="Write one page for a person: verdict, cause, replay, numbers."),
]
JunitFile = Annotated[
    Path | None, typer.Option("--junit", metavar="FILE.xml", help="Write the verdict as JUnit XML, for CI.")
]


def check_outputs(*outputs: tuple[str, Path | None], reads: Sequence[Path | None] = ()) -> None:
    """Before anything is run: each file that is to be written has a place of its own.

    Args:
        outputs: the option that names it, and where it goes; None: it is not asked for.
        reads: what the same command reads, or writes under rules of its own.

    Raises:
        InvalidInput: the file of another option or one that is read is there, a folder is, or there is no folder, or
            one that nothing can be written in; or it is `-`, where stdout has the answer.
    """
    taken = [os.path.realpath(path) for path in reads if path is not None]
    for option, path in outputs:
        if path is None:
            continue
        if str(path) == "-":
            message = f"{option} '-': stdout has the answer of the command; expected the name of a file"
            raise InvalidInput([Diagnostic("USE083", message)])
        if os.path.realpath(path) in taken:
            raise InvalidInput([Diagnostic("USE081", f"{option} '{path}': the same command has that file already")])
        if path.is_dir() or not path.parent.is_dir():
            what = "is a folder" if path.is_dir() else f"there is no folder '{path.parent}'"
            raise InvalidInput([Diagnostic("USE082", f"{option} '{path}': {what}")])
        whole = path if path.exists() and not path.is_file() else Path(os.path.realpath(path)).parent
        if not os.access(whole, os.W_OK):
            raise InvalidInput([Diagnostic("USE082", f"{option} '{path}': nothing can be written in '{whole}'")])
        taken.append(os.path.realpath(path))


def check_picture(path: Path | None) -> None:
    """
    Raises:
        InvalidInput: its name is not that of a PNG file.
    """
    if path is not None and path.suffix.lower() != ".png":
        raise InvalidInput([Diagnostic("USE063", f"'{path}': a picture is a .png")])


class Outputs:
    """What is asked for; looked at before anything is run.

    Args:
        report, junit: where each goes, or None.
        others: files that the same command writes or reads.
        quiet: tell nothing.

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
        """Whether there is anything to write."""
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
        """Writes what is asked for about a log; each file is there whole or not at all.

        Args:
            log: that was judged.
            verdict: on it.
            task, overrides: its file and what was set in it, where the command knows it.
            warnings: what was doubted before it was run.
            meshes, package_path, allow_outside: the meshes that are known, and where others may be.
        """
        from manipcli.logs.report import file_places, log_page, log_places
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

    def of_refusal(self, task: Task, verdict: Verdict, file: Path, warnings: Sequence[Diagnostic]) -> None:
        """Writes what is asked for about a task of which a step cannot be planned."""
        from manipcli.logs.report import refused_page, task_places
        from manipcli.report.html.render_page import render_page
        from manipcli.report.junit import render_junit

        self._forget()
        if self._junit is not None:
            self._write(self._junit, render_junit(verdict, *task_places(task.file), file=str(file)))
        if self._report is not None:
            page = replace(refused_page(task, verdict), warnings=tuple(warnings))
            self._write(self._report, render_page(page).encode())

    def of_invalid(self, findings: Sequence[Diagnostic], *, task: Path | None = None, log: Path | None = None) -> None:
        """Writes what is asked for about a task or a log that cannot be used: no page of an earlier run may stay."""
        file = task or log
        if file is None or not self.wanted:
            return
        from manipcli.logs.invalid import invalid_page, invalid_verdict
        from manipcli.report.html.render_page import render_page
        from manipcli.report.junit import render_junit

        self._forget()
        verdict, name = invalid_verdict(file, findings), log.name if log is not None else ""
        if self._junit is not None:
            self._write(self._junit, render_junit(verdict, (), (), log=name))
        if self._report is not None:
            self._write(self._report, render_page(invalid_page(verdict, findings, log=name)).encode())

    def _forget(self) -> None:
        """Removes what tells of an earlier run: where this one cannot be told (a full disk), it stands for none."""
        for path in (self._report, self._junit):
            if path is not None and path.is_file():
                Path(os.path.realpath(path)).unlink(missing_ok=True)

    def _write(self, path: Path, data: bytes) -> None:
        from manipcli.core.whole_file import write_whole

        write_whole(path, data)
        if not self._quiet:
            console.talk(f"written: {path}")
