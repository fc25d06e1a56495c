"""Messages between the processes of a batch: a job to the child, heartbeats and the result back."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.judge.measured_run import MeasuredRun
from manipcli.report.html.markup import link
from manipcli.report.run_report import RunReport
from manipcli.report.suite.suite import Case, Trouble

if TYPE_CHECKING:
    from manipcli.task.load_task import FileOptions

FOLDER = Path("runs") / "test"
"""Folder for the logs of tests, below the working directory."""


def limit(seconds: float) -> float:
    """A time limit [s] from the value of an option, where 0 means never.

    Raises:
        InvalidInput: it is negative.
    """
    if seconds < 0.0:
        message = f"a time limit of {seconds:g} s is negative"
        raise InvalidInput([Diagnostic("USE050", message, hint="write 30 s, or 0 for never")])
    return seconds or math.inf


def own_stem(file: Path) -> str:
    """The stem of files about a task file, unique in its folder: `a` for `a.yaml`, `a@yml` for `a.yml`.

    An `@` in the name is doubled.
    """
    kind = "" if file.suffix == ".yaml" else f"@{file.suffix[1:]}"
    return f"{file.stem.replace('@', '@@')}{kind}"


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of all runs of a batch: the options of `run`, and the files that are kept.

    Attributes:
        pages: folder for a page about each run; None for no pages.
        keep_logs: keep the logs of passed runs, too.
        pictures: draw runs that did not pass.
        baseline: compare a run of a task as written with its baseline.
        engines: run each task in these engines and compare the runs; empty: in its own engine.
        design: the design of the samples, `sobol:256`; "": random ones.
        check_step: run each task also at half the physics step, and compare the runs.
        silence: stop a run without progress for this time [s]; `inf` for never.
        timeout: stop a run that takes longer [s]; `inf` for never.
    """

    overrides: tuple[str, ...] = ()
    seed: int | None = None
    package_path: tuple[Path, ...] = ()
    allow_outside: bool = False
    design: str = ""
    folder: Path = FOLDER
    pages: Path | None = None
    keep_logs: bool = False
    pictures: bool = True
    baseline: bool = True
    engines: tuple[str, ...] = ()
    check_step: bool = False
    silence: float = 60.0
    timeout: float = 600.0


@dataclass(frozen=True, slots=True)
class Loading:
    """How the task of a job is loaded, without its sample: a task file and the options of `load_task`."""

    path: Path
    overrides: tuple[str, ...] = ()
    seed: int | None = None
    package_path: tuple[Path, ...] = ()
    allow_outside: bool = False
    design: str = ""

    @property
    def options(self) -> FileOptions:
        return {
            "overrides": self.overrides,
            "seed": self.seed,
            "package_path": self.package_path,
            "allow_outside": self.allow_outside,
            "design": self.design,
        }


@dataclass(frozen=True, slots=True)
class Job:
    """A case, its task file, and the paths of its output files."""

    case: Case
    path: Path
    settings: Settings

    @property
    def loading(self) -> Loading:
        settings = self.settings
        return Loading(
            self.path,
            settings.overrides,
            settings.seed,
            settings.package_path,
            settings.allow_outside,
            settings.design,
        )

    @property
    def log(self) -> Path:
        """`tasks/pour.mcap` for `tasks/pour.yaml`, `tasks/pour@17.mcap` for its sample 17, `tasks/pour@mujoco.mcap`."""
        return self._beside(".mcap", self.settings.folder)

    @property
    def partial(self) -> Path:
        """The path of the unfinished log."""
        return self.log.with_name(f"{self.log.name}.partial")

    @property
    def picture(self) -> Path:
        return self._beside(".png", self.settings.folder)

    @property
    def output(self) -> Path:
        """stdout and stderr of the process."""
        return self._beside(".txt", self.settings.folder)

    @property
    def page(self) -> Path | None:
        return None if self.settings.pages is None else self._beside(".html", self.settings.pages)

    @property
    def index(self) -> str:
        """The link from its page to the index of all pages; "" without pages."""
        if self.page is None or self.settings.pages is None:
            return ""
        return link(self.settings.pages / "index.html", self.page.parent)

    @property
    def nominal(self) -> bool:
        """Whether the task is run as written."""
        return self.case.kind == "" and not self.settings.overrides and self.settings.seed is None

    def command(self, verb: str = "run") -> str:
        """The shell command that repeats this run; `test` also compares with the baseline."""
        settings = self.settings
        file = self.case.file
        words = ["manipcli", verb, f"./{file}" if file.startswith("-") else file]
        words += [] if settings.seed is None else ["--seed", str(settings.seed)]
        words += [] if self.case.sample is None else ["--sample", str(self.case.sample)]
        words += ["--design", settings.design] if settings.design else []
        for override in settings.overrides:
            words += ["--set", override]
        words += self._variant_words()
        for place in settings.package_path:
            words += ["--package-path", str(place)]
        words += ["--allow-outside"] if settings.allow_outside else []
        return shlex.join(words)

    def _beside(self, suffix: str, folder: Path) -> Path:
        """The path of an output file; unique among the jobs of a batch and the index of pages.

        A folder name of `_` only grows by two, which reserves `_` for the root and `__` for `..`. In a stem a single
        `@` begins a suffix other than `.yaml`, a sample or an engine.
        """
        file = Path(self.case.file)
        names = {file.anchor: "_", "..": "__"}
        parts = [names.get(part, part if part.strip("_") else f"{part}__") for part in file.parts[:-1]]
        stem = own_stem(file) if file.name != "index.yaml" else "index@yaml"
        kind = f"@{self.case.kind}" if self.case.kind else ""
        return folder.joinpath(*parts, f"{stem}{kind}{suffix}")

    def _variant_words(self) -> list[str]:
        """Options that repeat the run, or the runs of an agreement; half the step with the run it is compared to."""
        variants = self.case.compared or ((self.case.variant,) if self.case.variant is not None else ())
        engines = list(dict.fromkeys(variant.engine for variant in self.case.compared))
        words = ["--engines", ",".join(engines)] if len(engines) > 1 else []
        words += ["--set", f"simulation.engine={engines[0]}"] if len(engines) == 1 else []
        return words + (["--check-step"] if any(variant.half_step for variant in variants) else [])


@dataclass(frozen=True, slots=True)
class Beat:
    """A heartbeat of a run.

    Attributes:
        activity: the current activity.
        at: simulated time [s].
        judged: the run has its verdict; only reports are left.
        written: place of the current step, as in the log.
    """

    activity: str
    at: float | None = None
    judged: bool = False
    written: str = ""

    def place(self, file: str) -> Place | None:
        """Place of the current step in the task file `file`; None for a step that an option defines."""
        _, line, column = self.written.rsplit(":", 2) if self.written else ("", "0", "0")
        return Place(file, int(line), int(column)) if int(line) > 0 else None

    def __str__(self) -> str:
        return self.activity if self.at is None else f"{self.activity} at {self.at:.2f} s"


@dataclass(frozen=True, slots=True)
class End:
    """The result of a run that ended, or whose log could not be written.

    Attributes:
        report: None where nothing was run, or the run did not end.
        findings: why nothing was run.
        troubles: why it did not pass, with places in the task file.
        warnings: of the files and the plan, before the run.
        notes: pictures and pages that could not be made, and numbers better than the baseline.
        measured: numbers of a run with a variant.
    """

    report: RunReport | None
    findings: tuple[Diagnostic, ...] = ()
    troubles: tuple[Trouble, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()
    measured: MeasuredRun | None = None


Message = Beat | End
