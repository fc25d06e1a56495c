"""`manipcli sweep TASK`: samples of a task, and how robust it is; `sweep A.csv B.csv`: two sweeps compared."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed, cores, seconds
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, ManipcliError

if TYPE_CHECKING:
    from manipcli.batch.job import Settings
    from manipcli.sweep.analysis import Analysis
    from manipcli.sweep.local import Backend
    from manipcli.sweep.results import SampleResult
    from manipcli.sweep.sampling import Sampling
    from manipcli.sweep.sweep import Progress

Keep = Literal["none", "failed", "all"]
DesignName = Literal["random", "grid", "lhs", "sobol", "oat", "saltelli"]
_OF_COMPARISONS = frozenset({"alpha", "margins"})
_OF_BOTH = frozenset({"paths", "format_", "quiet"})
FOLDER = Path("runs") / "sweep"
PERIOD = 0.1
"""[s] between two drawings of the live line."""
MOST_LINES = 10
"""Number of failures printed as they come."""
QUIET_PERIOD = 20.0
"""[s] between two lines where the output is not a terminal."""


def sweep(
    context: typer.Context,
    paths: Annotated[
        list[Path], typer.Argument(metavar="TASK | A.csv B.csv", help="Task file, or two sweeps.", show_default=False)
    ],
    *,
    samples: Annotated[
        int | None, typer.Option("--samples", metavar="N", min=1, help="Number of samples [default: 100].")
    ] = None,
    design: Annotated[
        DesignName, typer.Option("--design", help="How samples are chosen; saltelli runs N (d + 2) for d numbers.")
    ] = "random",
    workers: Annotated[
        int | None,
        typer.Option("-n", "--workers", metavar="W", min=1, help="Parallel runs [default: number of cores]."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="tcp://HOST:PORT", help="Run on the workers of this Dask scheduler."),
    ] = None,
    until: Annotated[
        str,
        typer.Option("--until", metavar="width=W", help="End when the interval of the rate is this narrow: width=5%."),
    ] = "",
    at_least: Annotated[
        str, typer.Option("--at-least", metavar="RATE", help="Success rate below which the exit code is 1.")
    ] = "100%",
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for each sample to FILE.")
    ] = None,
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE", help="Write a page with plots to FILE.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an interrupted sweep.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Start over where a sweep is unfinished.")] = False,
    keep: Annotated[Keep, typer.Option("--keep", help="Logs to keep, for replay.")] = "none",
    folder: Annotated[
        Path, typer.Option("--folder", metavar="DIR", help="Write the journal and kept logs to DIR.")
    ] = FOLDER,
    timeout: Annotated[
        str, typer.Option("--timeout", metavar="T", help="Stop a run that takes longer than T; 0: never.")
    ] = "10 min",
    silence: Annotated[
        str, typer.Option("--silence", metavar="T", help="Stop a run without progress for T; 0: never.")
    ] = "60 s",
    alpha: Annotated[
        float, typer.Option("--alpha", metavar="P", min=0.0, max=1.0, help="Level of significance of a comparison.")
    ] = 0.05,
    margins: Annotated[
        bool, typer.Option("--margins", help="Exit code 1 also where a margin is significantly smaller.")
    ] = False,
    seed: Seed = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result.")] = False,
) -> ExitCode:
    """Run many samples of a task's `vary:`, and show how robust it is: rate, margins, what matters, worst samples.

    Results are journalled in runs/sweep, so that --resume goes on after an interrupt. With two CSV files of sweeps:
    whether the second is worse, by the samples that both have; the exit code is then 1 if it is significantly worse.
    """
    from manipcli.cli.interrupts import Interrupts

    comparing = len(paths) == 2 and all(path.suffix == ".csv" for path in paths)
    _refuse_without_effect(context, comparing=comparing)
    if comparing:
        return _compare(*paths, alpha=alpha, margins=margins, format_=format_)
    if len(paths) != 1:
        message = f"expected a task, or two CSV files of sweeps; got {len(paths)} files"
        raise InvalidInput([Diagnostic("USE189", message, hint="run one sweep for each task")])
    with Interrupts():
        from manipcli.batch.job import Settings, limit
        from manipcli.sweep.analysis import Analysis
        from manipcli.sweep.journal import Journal, identity
        from manipcli.sweep.local import local_backend
        from manipcli.sweep.sampling import Sampling
        from manipcli.sweep.sweep import DEFAULT, MOST, collected, read_until, run_sweep

        width, needed = read_until(until), _rate(at_least)
        if width is not None and design != "random":
            message = "--until needs the random design: the interval of the rate holds for no other"
            raise InvalidInput([Diagnostic("USE186", message, hint="remove --until or --design")])
        check_outputs(("--csv", csv), ("--html", html), reads=(paths[0],))
        count = samples or (DEFAULT if width is None else MOST)
        name = "" if design == "random" else f"{design}:{count}"
        settings = Settings(
            overrides=tuple(overrides or ()),
            seed=seed,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
            design=name,
            folder=folder / (name.replace(":", "-") or design),
            keep_logs=keep == "all",
            pictures=False,
            baseline=False,
            silence=limit(seconds(silence)),
            timeout=limit(seconds(timeout)),
        )
        sampling = Sampling(paths[0], settings)
        count = count if sampling.total is None else sampling.total
        if scheduler is None:
            backend = local_backend(sampling.job, at_once=workers or cores(), keep=keep)
        else:
            backend = _cluster(sampling, paths[0], settings, scheduler, count=count, keep=keep)
        path = sampling.job(0).log.with_name(f"{paths[0].stem}.jsonl")
        lines = _Lines(quiet=quiet)
        with Journal(path, identity(sampling.written), resume=resume, force=force) as journal:
            try:
                swept = run_sweep(sampling, count, journal, backend, width=width, observer=lines.show)
            except (ManipcliError, OSError, KeyboardInterrupt):
                lines.clear()
                partly = collected(sampling, journal, count)
                if partly.results and format_ == "text":
                    console.result(_text(Analysis(partly)))
                if partly.results:
                    console.talk(f"journal: {path}; go on with --resume")
                raise
        lines.clear()
    analysis = Analysis(swept)
    if format_ == "json":
        from manipcli.sweep.text import render_json

        console.result(render_json(analysis))
    else:
        console.result(_text(analysis))
    _write(analysis, csv, html)
    return ExitCode.PASSED if swept.rate.share >= needed else ExitCode.FAILED


def _refuse_without_effect(context: typer.Context, *, comparing: bool) -> None:
    """
    Raises:
        InvalidInput: an option of a sweep is given for a comparison, or one of a comparison for a sweep.
    """
    given = [
        max(parameter.opts, key=len)
        for parameter in context.command.params
        if parameter.name is not None
        and parameter.name not in _OF_BOTH
        and (parameter.name in _OF_COMPARISONS) is not comparing
        and (source := context.get_parameter_source(parameter.name)) is not None
        and source.name == "COMMANDLINE"
    ]
    if given:
        what = "a comparison of two sweeps" if comparing else "a sweep of a task"
        message = f"{what} has no {' and no '.join(given)}"
        raise InvalidInput([Diagnostic("USE189", message, hint="remove it; `manipcli sweep --help` lists the options")])


def _cluster(sampling: Sampling, path: Path, settings: Settings, scheduler: str, *, count: int, keep: Keep) -> Backend:
    """
    Raises:
        InvalidInput: dask.distributed is not installed.
    """
    try:
        from manipcli.sweep.cluster import cluster_backend
    except ImportError as error:
        hint = "pip install 'manipcli[sweep]'"
        raise InvalidInput([Diagnostic("USE190", f"--scheduler needs dask.distributed: {error}", hint=hint)]) from None
    return cluster_backend(sampling, path, settings, scheduler, count=count, keep=keep)


def _compare(a: Path, b: Path, *, alpha: float, margins: bool, format_: str) -> ExitCode:
    from manipcli.sweep.compare import compare_sweeps, render_json, render_text

    compared = compare_sweeps(a, b, alpha=alpha, with_margins=margins)
    console.result(render_json(compared) if format_ == "json" else render_text(compared))
    return compared.exit_code


def _text(analysis: Analysis) -> str:
    from manipcli.sweep.text import render_text

    return render_text(analysis)


def _write(analysis: Analysis, csv: Path | None, html: Path | None) -> None:
    from manipcli.core.whole_file import write_whole

    if csv is not None:
        from manipcli.sweep.table import render_csv

        write_whole(csv, render_csv(analysis).encode())
        console.talk(f"written: {csv}")
    if html is not None:
        from manipcli.sweep.sweep_page import render_page

        write_whole(html, render_page(analysis, html.parent).encode())
        console.talk(f"written: {html}")


def _rate(text: str) -> float:
    """A success rate: `95%` or 0.95.

    Raises:
        InvalidInput: it is not one.
    """
    with suppress(ValueError):
        value = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
        if 0.0 <= value <= 1.0:
            return value
    raise InvalidInput([Diagnostic("USE186", f"--at-least '{text}' is not a rate", hint="write 95% or 0.95")])


class _Lines:
    """The progress of a sweep: a live line on a terminal, else a line now and then."""

    def __init__(self, *, quiet: bool) -> None:
        self._live = console.is_live() and not quiet
        self._quiet = quiet
        self._failed = 0
        self._next = time.monotonic() + (0.0 if self._live else QUIET_PERIOD)

    def show(self, progress: Progress, result: SampleResult | None) -> None:
        from manipcli.sweep.text import progress_text, sample_text

        if self._quiet:
            return
        if result is not None and not result.passed:
            self._failed += 1
            self.clear()
            if self._failed <= MOST_LINES:
                console.talk(sample_text(result))
            elif self._failed == MOST_LINES + 1:
                console.talk("further failures are not listed here")
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + (PERIOD if self._live else QUIET_PERIOD)
        (console.redraw if self._live else console.talk)(progress_text(progress))

    def clear(self) -> None:
        if self._live:
            console.redraw("")
