"""`manipcli shrink TASK`: the smallest change of a task's varied numbers under which it fails."""

from __future__ import annotations

import json
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed, TaskFile, cores, seconds
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.batch.job import Settings
    from manipcli.sweep.sampling import Sampling
    from manipcli.sweep.shrink.runs import State
    from manipcli.sweep.shrink.session import Found
    from manipcli.sweep.shrink.shrink import Smallest
    from manipcli.sweep.shrink.space import Space

FOLDER = Path("runs") / "shrink"
SWEEPS = Path("runs") / "sweep" / "random"
"""Folder of the journals of sweeps of random samples."""
SAMPLES = 20
"""Samples in which failures are looked for."""
PERIOD = 0.1
"""[s] between two drawings of the live line."""
QUIET_PERIOD = 20.0
"""[s] between two lines where the output is not a terminal."""


def shrink(
    path: TaskFile,
    *,
    sample: Annotated[
        int | None,
        typer.Option(
            "--sample", metavar="K", min=0, help="Begin with sample K [default: those of --samples that fail]."
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            metavar="N",
            min=0,
            help="Look for failures among samples 0 to N-1 first [default: 20, at most half of the budget].",
        ),
    ] = None,
    budget: Annotated[
        int, typer.Option("--budget", metavar="RUNS", min=5, help="Run the task at most RUNS times, samples included.")
    ] = 100,
    all_: Annotated[
        bool, typer.Option("--all", help="One change for each way of failing, with a budget for each.")
    ] = False,
    refused: Annotated[
        bool, typer.Option("--refused", help="Also count a task that is invalid or has no plan as failing.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE.yaml", help="Write the task to FILE [default: <task>-shrunk.yaml]."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
    workers: Annotated[
        int | None,
        typer.Option("-n", "--workers", metavar="W", min=1, help="Parallel runs [default: number of cores]."),
    ] = None,
    timeout: Annotated[
        str, typer.Option("--timeout", metavar="T", help="Stop a run that takes longer than T; 0: never.")
    ] = "10 min",
    silence: Annotated[
        str, typer.Option("--silence", metavar="T", help="Stop a run without progress for T; 0: never.")
    ] = "60 s",
    seed: Seed = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result.")] = False,
) -> ExitCode:
    """Find the smallest change of a task's `vary:` under which it fails, and write it as a task file.

    The change is measured in spreads of the varied numbers. It is run, fails, and at 0.9 of the distance passes.
    """
    from manipcli.cli.interrupts import Interrupts

    with Interrupts():
        from manipcli.batch.job import Settings, limit
        from manipcli.sweep.local import SweepStopped
        from manipcli.sweep.sampling import Sampling
        from manipcli.sweep.shrink.runs import RunStopped, scratch
        from manipcli.sweep.shrink.session import Wish, search
        from manipcli.sweep.shrink.space import Space
        from manipcli.sweep.shrink.text import nothing_text

        settings = Settings(
            overrides=tuple(overrides or ()),
            seed=seed,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
            pictures=False,
            baseline=False,
            silence=limit(seconds(silence)),
            timeout=limit(seconds(timeout)),
        )
        wish = Wish(sample, _samples(sample, samples, budget), budget, all_, refused)
        with scratch(FOLDER) as folder:
            settings = replace(settings, folder=folder)
            sampling = Sampling(path, settings)
            space = Space(sampling)
            files = _Files(sampling, space, output, settings, every_way=all_, force=force)
            lines = _Lines(quiet=quiet)
            best: list[tuple[Smallest, int]] = []
            try:
                found = search(
                    sampling,
                    space,
                    wish,
                    settings,
                    at_once=workers or cores(),
                    sweeps=SWEEPS,
                    observer=lines.show,
                    found=lambda smallest, number: best.append((smallest, number)),
                )
            except (SweepStopped, RunStopped, OSError, KeyboardInterrupt):
                lines.clear()
                for smallest, number in best:
                    (console.result if format_ == "text" else console.talk)(files.text(smallest))
                    with suppress(OSError):
                        files.write(smallest, number)
                raise
            lines.clear()
            if format_ == "text":
                for smallest in found.smallest:
                    console.result(files.text(smallest))
            whole = [files.verified(smallest, found.sample) for smallest in found.smallest]
        if format_ == "json":
            console.result(files.json(found, budget))
        elif not found.smallest:
            console.result(nothing_text(sampling.task, found))
        return ExitCode.PASSED if whole and all(whole) else ExitCode.FAILED


def _samples(sample: int | None, samples: int | None, budget: int) -> int:
    """Number of samples to look for failures in.

    Raises:
        InvalidInput: it is given together with a sample, or takes more than half of the budget.
    """
    if samples is None:
        return 0 if sample is not None else min(SAMPLES, budget // 2)
    if sample is not None:
        raise InvalidInput([Diagnostic("USE189", "--samples has no effect with --sample", hint="remove one of them")])
    if samples > budget // 2:
        message = f"--samples {samples} takes more than half of --budget {budget}"
        raise InvalidInput([Diagnostic("USE202", message, hint=f"write --budget {2 * samples}, or fewer samples")])
    return samples


class _Files:
    """The files of the changes: one, or with `--all` one for each way of failing."""

    def __init__(
        self,
        sampling: Sampling,
        space: Space,
        output: Path | None,
        settings: Settings,
        *,
        every_way: bool,
        force: bool,
    ) -> None:
        """
        Raises:
            InvalidInput: they cannot be written, or exist.
        """
        from manipcli.sweep.shrink.file import TaskFile

        path = sampling.written.path
        self._out = output or path.with_name(f"{path.stem}-shrunk.yaml")
        self._sampling, self._space, self._settings, self._every_way = sampling, space, settings, every_way
        self._written: dict[int, Path] = {}
        if self._out.suffix not in (".yaml", ".yml"):
            message = f"'{self._out}' is not a .yaml or .yml file"
            raise InvalidInput([Diagnostic("USE203", message, hint=f"write -o {self._out.with_suffix('.yaml')}")])
        check_outputs(("--output", self._out), reads=(path,))
        for file in [self._out] if not every_way else sorted(self._out.parent.glob(f"{self._out.stem}-*.yaml")):
            if file.exists() and not force:
                message = f"'{file}' exists"
                hint = "add --force to replace it, or name another file with -o"
                raise InvalidInput([Diagnostic("USE201", message, hint=hint)])
        TaskFile(sampling.written, self._out).check(space.vary(space.origin))

    def text(self, smallest: Smallest) -> str:
        from manipcli.sweep.shrink.text import render_text

        return f"{render_text(self._sampling.task, self._space, smallest)}\n"

    def write(self, smallest: Smallest, number: int) -> Path:
        """Writes the file of a change, a sample with this number."""
        from manipcli.sweep.shrink.file import TaskFile
        from manipcli.sweep.shrink.text import comment

        k = len(self._written) + 1
        mark = f"-{k}" if self._every_way else ""
        file = self._out.with_name(f"{self._out.stem}{mark}{self._out.suffix}")
        # The options of the search are needed to run the file, where there are some.
        lines = comment(self._sampling.task, self._space, smallest, self._command(file))
        point = smallest.trial.point
        TaskFile(self._sampling.written, file, mark.replace("-", "_")).write(lines, self._space.vary(point), number)
        self._written[id(smallest)] = file
        console.talk(f"written: {file}")
        return file

    def verified(self, smallest: Smallest, number: int) -> bool:
        """Writes the file of a change and runs it; whether it fails in the same way, and the change is confirmed."""
        from manipcli.sweep.shrink.session import same_as_file

        file = self.write(smallest, number)
        same = same_as_file(file, smallest.trial, self._settings)
        if same:
            console.talk(f"verified: {self._command(file)} fails with the same margins")
        else:  # the task or the program has changed during the search
            console.error(f"removed: {self._command(file)} does not give the result of the search")
            file.unlink()
            del self._written[id(smallest)]
        return same and smallest.confirmed

    def json(self, found: Found, budget: int) -> str:
        """The result as one JSON object."""
        from manipcli.sweep.shrink.text import json_object, trial_object

        return json.dumps(
            {
                "task": self._sampling.task,
                "seed": self._sampling.seed,
                "runs": found.done,
                "budget": budget,
                "outcomes": {word: found.outcomes.count(word) for word in sorted(set(found.outcomes))},
                "as_written": trial_object(found.written),
                "changes": [json_object(self._space, each, self._written.get(id(each))) for each in found.smallest],
            },
            indent=2,
            allow_nan=False,
        )

    def _command(self, file: Path) -> str:
        from manipcli.batch.discovery import read_case, shown_path
        from manipcli.batch.job import Job

        return Job(
            replace(read_case(self._sampling.written.path), file=shown_path(file)), file, self._settings
        ).command()


class _Lines:
    """The progress of a search: a live line on a terminal, else a line now and then."""

    def __init__(self, *, quiet: bool) -> None:
        self._live = console.is_live() and not quiet
        self._quiet = quiet
        self._next = time.monotonic() + (0.0 if self._live else QUIET_PERIOD)

    def show(self, state: State) -> None:
        from manipcli.sweep.shrink.text import state_text

        if self._quiet or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + (PERIOD if self._live else QUIET_PERIOD)
        (console.redraw if self._live else console.talk)(state_text(state))

    def clear(self) -> None:
        if self._live:
            console.redraw("")
