"""What the processes of a batch say to each other: a job there, signs of life and an end back."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.errors import Diagnostic, Place
from manipcli.report.html.markup import link
from manipcli.report.run_report import RunReport
from manipcli.report.suite.suite import Case, Trouble

FOLDER = Path("runs") / "test"
"""Where logs of tests go, below the working directory."""


def limit(seconds: float) -> float:
    """Of a time as an option gives it: 0 means never."""
    return seconds if seconds > 0.0 else math.inf


def own_stem(file: Path) -> str:
    """What files about this task file are called, and about no other beside it; `@` is doubled.

    `a` of `a.yaml`, `a@yml` of `a.yml`.
    """
    kind = "" if file.suffix == ".yaml" else f"@{file.suffix[1:]}"
    return f"{file.stem.replace('@', '@@')}{kind}"


@dataclass(frozen=True, slots=True)
class Settings:
    """What holds for all runs of a batch; as the options of `run`, and what is made of each.

    Attributes:
        pages: the folder that gets a page about each run; None for none.
        keep_logs: also those of runs that passed.
        baseline: a run of a task as it is written may not be worse than its baseline.
        silence: a run that shows no progress for so long is ended [s].
        timeout: a run that takes longer is ended [s]; of both, `inf` for never.
    """

    overrides: tuple[str, ...] = ()
    seed: int | None = None
    package_path: tuple[Path, ...] = ()
    allow_outside: bool = False
    folder: Path = FOLDER
    pages: Path | None = None
    keep_logs: bool = False
    baseline: bool = True
    silence: float = 60.0
    timeout: float = 600.0


@dataclass(frozen=True, slots=True)
class Job:
    """A case, the file that it stands in, and where its files go."""

    case: Case
    path: Path
    settings: Settings

    @property
    def log(self) -> Path:
        """`tasks/pour.mcap` of `tasks/pour.yaml`, `tasks/pour@17.mcap` of its sample 17."""
        return self._beside(".mcap", self.settings.folder)

    @property
    def partial(self) -> Path:
        """What the log is called before it is whole."""
        return self.log.with_name(f"{self.log.name}.partial")

    @property
    def picture(self) -> Path:
        return self._beside(".png", self.settings.folder)

    @property
    def output(self) -> Path:
        """What the process says that is no result."""
        return self._beside(".txt", self.settings.folder)

    @property
    def page(self) -> Path | None:
        return None if self.settings.pages is None else self._beside(".html", self.settings.pages)

    @property
    def index(self) -> str:
        """The link from its page to the one that leads to all; "" where no pages are written."""
        if self.page is None or self.settings.pages is None:
            return ""
        return link(self.settings.pages / "index.html", self.page.parent)

    @property
    def nominal(self) -> bool:
        """Whether the task is run as it is written."""
        return self.case.sample is None and not self.settings.overrides and self.settings.seed is None

    def command(self, verb: str = "run") -> str:
        """What does the same again, for a shell; `test` compares with the baseline, too."""
        settings = self.settings
        file = self.case.file
        words = ["manipcli", verb, f"./{file}" if file.startswith("-") else file]
        words += [] if settings.seed is None else ["--seed", str(settings.seed)]
        words += [] if self.case.sample is None else ["--sample", str(self.case.sample)]
        for override in settings.overrides:
            words += ["--set", override]
        for place in settings.package_path:
            words += ["--package-path", str(place)]
        words += ["--allow-outside"] if settings.allow_outside else []
        return shlex.join(words)

    def _beside(self, suffix: str, folder: Path) -> Path:
        """Where a file of this job goes; no two jobs of a batch, nor the index of pages, share one.

        Names of folders that are nothing but `_` grow by two, which leaves `_` for the root and `__` for `..`. In a
        stem a single `@` begins a suffix other than `.yaml`, or a sample.
        """
        file = Path(self.case.file)
        names = {file.anchor: "_", "..": "__"}
        parts = [names.get(part, part if part.strip("_") else f"{part}__") for part in file.parts[:-1]]
        stem = own_stem(file) if file.name != "index.yaml" else "index@yaml"
        sample = "" if self.case.sample is None else f"@{self.case.sample}"
        return folder.joinpath(*parts, f"{stem}{sample}{suffix}")


@dataclass(frozen=True, slots=True)
class Beat:
    """A sign of life: what is done, and at which time of the run [s]. `judged`: the run has its verdict, and what is
    left is to tell of it. `written`: where the step stands that is on, as the log has it."""

    doing: str
    at: float | None = None
    judged: bool = False
    written: str = ""

    def place(self, file: str) -> Place | None:
        """Of the step that is on, in the task file of this name; of one that an option wrote, None."""
        _, line, column = self.written.rsplit(":", 2) if self.written else ("", "0", "0")
        return Place(file, int(line), int(column)) if int(line) > 0 else None

    def __str__(self) -> str:
        return self.doing if self.at is None else f"{self.doing} at {self.at:.2f} s"


@dataclass(frozen=True, slots=True)
class End:
    """A run that came to its end, or whose log could not be written.

    Attributes:
        report: None where nothing was run, or not to its end.
        findings: why nothing was run.
        troubles: why it did not pass, with places in the task file.
        warnings: what was doubted before it began.
        notes: what could not be made of it.
    """

    report: RunReport | None
    findings: tuple[Diagnostic, ...] = ()
    troubles: tuple[Trouble, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()


Message = Beat | End
