"""Self-contained HTML page of compared runs: result, what disagrees, replay with ghosts, numbers side by side."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from manipcli.judge.agreement import Agreement
from manipcli.judge.compared_numbers import Row
from manipcli.replay.ghost import Ghost
from manipcli.replay.playback import Playback
from manipcli.replay.player import POLICY, player_html
from manipcli.report.agreement.agreement_text import TITLES, agrees, cells, limited
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.agreement.disagreement import allowed_of, difference_of, message, summary
from manipcli.report.html.markup import Markup, document, element, joined, link
from manipcli.report.html.page_parts import heading, mark, seek, table


def render_page(
    compared: ComparedRuns,
    shown: tuple[str, Playback] | None = None,
    ghosts: Sequence[Ghost] = (),
    *,
    index: str = "",
    pages: Sequence[str | None] = (),
    folder: Path = Path(),
) -> str:
    """The HTML file.

    Args:
        compared: the runs.
        shown: the run of the replay and its name; None for no replay.
        ghosts: the other runs.
        index: relative URL of the index of all runs; "" if there is none.
        pages: the page of each run; None without one.
        folder: of this page, for links.
    """
    agreement = compared.agreement
    good = compared.exit_code == 0
    word = "passed" if good else "failed" if agreement.agrees else "differs"
    parts = {
        "Cause": _causes(compared, playable=shown is not None),
        "Replay": _replay(shown, ghosts),
        "Numbers": _numbers(compared),
        "Runs": _runs(compared, [None if page is None else link(page, folder) for page in pages]),
    }
    links = (element("a", name, href=f"#{name.lower()}") for name, part in parts.items() if part)
    own = files("manipcli.report.html").joinpath("page")
    style, script = (Markup(own.joinpath(name).read_text("utf-8")) for name in ("report.css", "report.js"))
    sign = "✓" if good else "✗"
    shown_word = element("span", f"{sign} {word}", class_=f"verdict {'passed' if good else 'failed'}")
    head = element(
        "header",
        element("div", element("h1", agreement.task), shown_word, class_="title"),
        element("p", summary(agreement), class_="subtitle"),
    )
    return document(
        f"{sign} {agreement.task} {word}",
        head,
        element("nav", element("a", "All runs", href=index) if index else None, *links, aria_label="sections"),
        element("main", *parts.values()),
        element("script", script),
        style=style,
        policy=POLICY,
    )


def _causes(compared: ComparedRuns, *, playable: bool) -> Markup | None:
    """What disagrees, each with its place and the times of the deciding ticks."""
    agreement = compared.agreement
    if agreement.agrees:
        return None
    causes = []
    for found in agreement.disagreements:
        times = [
            (run.name, expectation.at)
            for run in agreement.runs
            for expectation in run.verdict.expectations
            if found.kind in ("expectation", "margin") and run.name in found.runs and expectation.name == found.name
        ]
        jumps = [seek(at, f"{name} {at:.2f} s", playable=playable) for name, at in times if at is not None]
        place = element("span", str(found.place), class_="place") if found.place is not None else None
        causes.append(
            element("div", element("h3", f"✗ {message(found)}"), element("p", *jumps, place, class_="jump"),
                    class_="cause")
        )  # fmt: skip
    return element("section", heading("cause", "What disagrees"), *causes, class_="why")


def _replay(shown: tuple[str, Playback] | None, ghosts: Sequence[Ghost]) -> Markup | None:
    if shown is None:
        return None
    others = ", ".join(ghost.name for ghost in ghosts)
    about = f"Solid: {shown[0]}, with its forces and curves. Ghosts: {others}, at the same time of the run."
    player = Markup(player_html(shown[1], ghosts=ghosts))
    return element("section", heading("replay", "Replay", about), joined(player))


def _mark(agreement: Agreement, row: Row) -> Markup | str:
    """Whether the runs agree in a number; nothing for a number without a limit."""
    good = agrees(agreement, row)
    return mark(good, "agrees" if good else "differs") if limited(row) or not good else ""


def _numbers(compared: ComparedRuns) -> Markup:
    agreement = compared.agreement
    names = [run.name for run in agreement.runs]
    last = ("difference", "allowed") if len(agreement.engines) > 1 else ()
    rows = [
        (
            _mark(agreement, row),
            element("b", row.name or "task"),
            TITLES[row.kind],
            *cells(row),
            *((difference_of(row), allowed_of(row)) if last else ()),
        )
        for row in agreement.rows
    ]
    about = "Difference: between the engines at the step of the task. Allowed: by `agree:` of the task."
    headers = ("", "of", "number", *names, *last)
    warned = (element("p", str(warning)) for warning in compared.agreement.warnings)
    shown = table(headers, rows, numbers=(*names, *last), stacks=True)
    return element("section", heading("numbers", "Numbers", about), *warned, shown)


def _runs(compared: ComparedRuns, urls: Sequence[str | None]) -> Markup:
    urls = urls or [None] * len(compared.reports)
    rows = [
        (
            mark(run.verdict.verdict == "passed", run.verdict.verdict),
            element("a", run.name, href=url) if url is not None else element("b", run.name),
            f"{1e3 * run.step:g} ms",
            f"{run.verdict.simulated_time:.2f} s",
            f"{run.wall_time:.2f} s",
            run.verdict.text,
            report.log or "",
        )
        for run, report, url in zip(compared.agreement.runs, compared.reports, urls, strict=True)
    ]
    headers = ("verdict", "run", "step", "simulated", "real", "reason", "log")
    shown = table(headers, rows, numbers=("step", "simulated", "real"), stacks=True)
    return element("section", heading("runs", "Runs"), shown)
