"""The sections of the page that say what came of a run: verdict, cause, expectations, steps, files. `html.py` puts them
in order."""

from __future__ import annotations

from manipcli.core.text import number_of
from manipcli.judge.drawn import value_text
from manipcli.judge.measures.facts import RunFacts
from manipcli.judge.verdict import StepOutcome
from manipcli.replay.playback import Phase
from manipcli.report.html.markup import Markup, element, joined
from manipcli.report.html.page_parts import (
    anchor,
    heading,
    image,
    line_link,
    mark,
    meter,
    number,
    of_limit,
    seek,
    signed,
    table,
)
from manipcli.report.quantity import quantity
from manipcli.report.run_page import RunPage, Source, Written

SHORT_HASH = 16
"""Digits of a hash that are shown; all of them are in the page."""


ALSO = 3
"""Causes beside the first that are shown at once; the others are folded, and told below."""


def head(page: RunPage) -> Markup:
    """The task, the verdict, and the run in a few numbers."""
    verdict = page.verdict
    good = verdict.verdict == "passed"
    word = element("span", f"{'✓' if good else '✗'} {verdict.verdict}", class_=f"verdict {verdict.verdict}")
    told: list[tuple[str, str]] = []
    if page.facts is not None:
        told.append(("simulated", f"{verdict.simulated_time:.2f} s"))
        done = sum(step.outcome == "done" for step in verdict.steps)
        told.append(("steps done", f"{done} of {len(verdict.steps)}"))
    if verdict.expectations and page.facts is not None:
        met = sum(one.outcome == "passed" for one in verdict.expectations)
        told.append(("expectations met", f"{met} of {len(verdict.expectations)}"))
    if page.facts is not None:
        told += _figures(page.facts)
    figures = (element("div", element("dt", name), element("dd", value)) for name, value in told)
    if page.facts is None and not page.log:
        told.append(("simulated", "nothing: the task was refused"))
    lost = element("p", f"The log is incomplete: {page.lost}", class_="warn") if page.lost is not None else None
    return element(
        "header",
        element("div", element("h1", verdict.task), word, class_="title"),
        element("p", verdict.text, class_="says") if good or not page.causes else None,
        element("p", verdict.drawn.told()) if verdict.drawn is not None else None,
        lost,
        element("dl", *figures, class_="figures"),
    )


def _figures(facts: RunFacts) -> list[tuple[str, str]]:
    told = []
    slips = [hold.slip.most for hold in facts.holds if hold.slip is not None and hold.hold.lifted is not None]
    if slips:
        told.append(("slip in the hand", quantity(max(slips), "m")))
    told.append(("energy", number(sum(one.given for one in facts.joints), "J")))
    total = max((step.total.value for step in facts.steps), default=0.0)
    told.append(("peak power", number(total, "W")))
    return told


def causes(page: RunPage) -> Markup | None:
    """Why it did not pass: the first cause with the picture of its moment, then the others."""
    if not page.causes:
        return None
    playable = page.playback is not None
    shown = []
    for k, cause in enumerate(page.causes):
        jump = seek(cause.at, f"show {cause.at:.2f} s", playable=playable) if cause.at is not None else None
        lines = (
            element("h3" if k == 0 else "h4", f"✗ {cause.title}"),
            element("p", cause.text) if cause.text else None,
            element("p", f"hint: {cause.hint}", class_="about") if cause.hint else None,
            element("p", jump, line_link(cause.written) if cause.written is not None else None, class_="jump"),
        )
        shown.append(element("div", *lines, class_="cause"))
    cut = str(page.verdict.cuts)
    # Of an invalid file nothing else tells them; and one alone is as short as the line that it would hide behind.
    rest = shown[1 + ALSO :] if page.facts is not None and len(shown) > 2 + ALSO else []
    folded = element("details", element("summary", f"{len(rest)} more"), *rest) if rest else None
    others = (*shown[1 : len(shown) - len(rest)], folded)
    also = element("div", element("p", "Also:", class_="about"), *others, class_="also") if shown[1:] else None
    told_cut = element("p", f"In this run: {cut}.", class_="about") if cut else None
    first = [element("div", shown[0], also, told_cut)]
    if page.moment is not None:
        told = f"{page.verdict.task} at {page.moment.time:.2f} s"
        caption = element("figcaption", f"at {page.moment.time:.2f} s")
        first.append(element("figure", image(page.moment, told), caption))
    title = "Why it failed" if page.verdict.verdict == "failed" else "What went wrong"
    return element("section", heading("cause", title), element("div", *first, class_="first"), class_="why")


def warnings(page: RunPage) -> Markup | None:
    """What was doubted before anything moved."""
    if not page.warnings:
        return None
    shown = []
    for one in page.warnings:
        place = element("span", str(one.place), class_="place") if one.place is not None else None
        hint = element("p", f"hint: {one.hint}", class_="about") if one.hint else None
        shown.append(element("div", element("p", f"{one.message} ", place, element("small", f" {one.code}")), hint))
    title = number_of(len(shown), "warning")
    return element("section", heading("warnings", title, "Told before the run began."), *shown, class_="warned")


def expectations(page: RunPage) -> Markup | None:
    """Each with its signed margin, in numbers and as a bar."""
    if not page.verdict.expectations or page.facts is None:
        return None
    rows = []
    for one, written, limit in page.judged:
        used: Markup | str = ""
        if one.margin is not None and limit is not None and limit > 0.0:
            told = of_limit(limit - one.margin, limit, one.unit)
            used = joined(meter((limit - one.margin) / limit, told=f"{told} used"), element("small", told))
        name = joined(element("b", one.name), line_link(written), element("small", one.text))
        margin = "–" if one.margin is None else signed(one.margin, one.unit)
        at = seek(one.at, playable=page.playback is not None)
        rows.append((mark(one.outcome == "passed", one.outcome), name, margin, used, at))
    headers = ("outcome", "expectation", "margin", "of its limit", "tightest at")
    about = "The margin is what is left to the limit: + to spare, − short of it; at its tightest moment."
    return element(
        "section",
        heading("expectations", "Expectations", about),
        table(headers, rows, numbers=("margin",), stacks=True),
    )


def steps(page: RunPage) -> Markup | None:
    """The steps over time, planned and measured; what each took; a picture of each."""
    verdict, facts = page.verdict, page.facts
    if not verdict.steps:
        return None
    parts: list[Markup | None] = []
    if facts is None:
        rows = [(_outcome(step), _step_name(page, step, written), step.text) for step, written in page.located_steps]
        parts.append(table(("outcome", "step", ""), rows))
    else:
        end = max(facts.end, 1e-9)
        by_id = {one.id: one for one in facts.steps}
        timed: list[tuple[str, ...]] = []
        for step, written in page.located_steps:
            took = None if step.started is None or step.ended is None else step.ended - step.started
            planned = step.planned_duration
            mine = by_id.get(step.id)
            timed.append(
                (
                    _outcome(step),
                    _step_name(page, step, written),
                    _gantt(page, step, end),
                    "" if planned is None else f"{planned:.2f} s",
                    "" if took is None else f"{took:.2f} s",
                    "" if took is None or planned is None else _late(took - planned),
                    "" if mine is None else number(float(mine.given.sum()), "J"),
                    "" if mine is None else number(mine.total.value, "W"),
                    seek(step.started) if step.started is not None else "",
                )
            )
        columns = ("planned", "measured", "late by", "energy", "peak power")
        headers = ("outcome", "step", f"0 to {facts.end:.2f} s", *columns, "starts at")
        parts.append(table(headers, timed, numbers=columns, stacks=True))
        parts.append(_pictures(page))
    about = "Outlined: as planned. Filled: as measured, a line where a phase begins." if facts is not None else ""
    return element("section", heading("steps", "Steps", about), *parts)


def _outcome(step: StepOutcome) -> Markup:
    """With the number of attempts, and whether it may fail."""
    shown = element("span", f"– {step.outcome}, may fail", class_="idle") if step.tolerated else None
    tries = element("small", f"at attempt {len(step.attempts)}") if len(step.attempts) > 1 else None
    return joined(shown or mark(step.outcome == "done", step.outcome), tries)


def _late(seconds: float) -> str:
    return f"{'+' if seconds > 0.0 else '−'}{abs(seconds):.2f} s" if abs(seconds) >= 0.005 else "0.00 s"


def _step_name(page: RunPage, step: StepOutcome, written: Written) -> Markup:
    shown = _phases(page, step)
    named = element("small", " · ".join(phase.name for phase in shown)) if len(shown) > 1 else None
    told: Markup | None = None
    if step.text and page.facts is not None:
        folded = element("details", element("summary", "what it told"), element("small", step.text))
        told = folded if step.outcome == "done" else element("small", step.text)
    again = [element("small", f"planned again: {why}") for why in step.replanned]
    return joined(element("b", step.label), line_link(written), named, *again, told)


def _phases(page: RunPage, step: StepOutcome) -> tuple[Phase, ...]:
    """Those of a step that is shown; none of another."""
    shown = page.playback.steps if page.playback is not None else ()
    return next((one.phases for one in shown if one.id == step.id), ())


def _gantt(page: RunPage, step: StepOutcome, end: float) -> Markup:
    """One row of the Gantt chart: two bars over the time of the whole run."""
    if step.started is None or step.planned_duration is None:
        return element("small", "not begun")
    last = end if step.ended is None else step.ended
    scale = 1000.0 / end
    starts = [phase.start for phase in _phases(page, step)[1:]]
    planned = min(step.planned_duration, end - step.started)
    told = f"{step.id}: planned {step.planned_duration:.2f} s, measured {last - step.started:.2f} s"
    drawn = (
        element("rect", class_="row", x="0", y="0", width="1000", height="26"),
        element("rect", class_="planned", x=step.started * scale, y="3.5", width=max(planned * scale, 2.0), height="8"),
        element(
            "rect",
            class_="measured" if step.outcome == "done" or step.tolerated else "measured no",
            x=step.started * scale,
            y="14",
            width=max((last - step.started) * scale, 2.0),
            height="9",
        ),
        *(element("line", x1=at * scale, x2=at * scale, y1="14", y2="23") for at in starts),
    )
    svg = element(
        "svg", *drawn, class_="gantt", viewBox="0 0 1000 26", preserveAspectRatio="none", role="img", aria_label=told
    )
    return element("span", svg, class_="seeks", data_seek=f"{step.started:.6f}", title=told)


def _pictures(page: RunPage) -> Markup | None:
    shown = []
    for step in page.verdict.steps:
        picture = page.pictures.get(step.id)
        if picture is not None:
            told = f"{step.id} at {picture.time:.2f} s"
            caption = element("figcaption", element("b", step.id), f" {picture.time:.2f} s")
            shown.append(
                element("figure", image(picture, told), caption, data_seek=f"{picture.time:.6f}", title=f"show {told}")
            )
    return element("div", *shown, class_="pictures") if shown else None


def sources(page: RunPage) -> Markup | None:
    """The resolved files, each line with a number to point at."""
    if not page.sources:
        return None
    about = "As resolved: defaults, parameters and overrides written out, numbers in SI."
    shown = [_source(source, page) for source in page.sources]
    return element("section", heading("files", "Files", about if page.facts is not None else ""), *shown)


def _source(source: Source, page: RunPage) -> Markup:
    """Folded, but for the file of a task that was refused; the lines that causes are about are marked."""
    lines = source.text.splitlines()
    marked = {one.written.line for one in page.causes if one.written is not None and one.written.file == source.name}
    rows = (
        element("li", element("code", line or " "), id=anchor(source.name, k), class_="marked" if k in marked else None)
        for k, line in enumerate(lines, 1)
    )
    return element(
        "details",
        element("summary", element("b", source.name), f" {len(lines)} lines"),
        element("ol", *rows, class_="source"),
        open=page.facts is None,
    )


def provenance(page: RunPage) -> Markup:
    """Where the run is from: versions, seed, engine, hashes; and what the log lacks."""
    pairs = (element("div", element("dt", name), element("dd", value)) for name, value in page.provenance)
    hashes = [
        (element("code", name), element("code", digest[:SHORT_HASH], title=digest)) for name, digest in page.hashes
    ]
    listed = (
        element("details", element("summary", f"{len(hashes)} hashes (SHA-256)"), table(("file", "hash"), hashes))
        if hashes
        else None
    )
    drawn = page.verdict.drawn
    values = [(element("code", path), value_text(value)) for path, value in drawn.values] if drawn is not None else []
    sample = (
        element(
            "details",
            element("summary", f"{number_of(len(values), 'value')} of the sample (SI)"),
            table(("path", "value"), values),
        )
        if values
        else None
    )
    notes = [element("p", f"Note: {note}", class_="about") for note in page.notes]
    figures = element("dl", *pairs, class_="figures small")
    return element("section", heading("provenance", "Provenance"), figures, sample, listed, *notes)
