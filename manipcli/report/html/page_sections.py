"""Sections of the run page about its result: verdict, cause, expectations, steps, files."""

from __future__ import annotations

from dataclasses import replace

from manipcli.core.text import number_of
from manipcli.judge.drawn import value_text
from manipcli.judge.measures.facts import RunFacts
from manipcli.judge.self_contacts import self_contact_line
from manipcli.judge.verdict import BlockOutcome, StepOutcome, own_name
from manipcli.replay.cause import Written
from manipcli.replay.playback import Phase
from manipcli.report.display_quantity import quantity
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
from manipcli.report.located import LOCATED, located_rows
from manipcli.report.nesting import block_line, nested
from manipcli.report.run_page import RunPage, Source

SHORT_HASH = 16
"""Shown digits of a hash; the page source holds all of them."""


ALSO = 3
"""Causes shown after the first; the others are folded."""


def head(page: RunPage) -> Markup:
    """The task, the verdict and the key figures of the run."""
    verdict = page.verdict
    good = verdict.verdict == "passed"
    word = element("span", f"{'✓' if good else '✗'} {verdict.verdict}", class_=f"verdict {verdict.verdict}")
    entries: list[tuple[str, str]] = []
    if page.facts is not None:
        entries.append(("simulated", f"{verdict.simulated_time:.2f} s"))
        asked = [step for step in verdict.steps if not step.excused]
        done = sum(step.outcome == "done" for step in asked)
        entries.append(("steps done", f"{done} of {len(asked)}"))
    if verdict.expectations and page.facts is not None:
        judged = [expectation for expectation in verdict.expectations if not expectation.excused]
        met = sum(expectation.outcome == "passed" for expectation in judged)
        entries.append(("expectations met", f"{met} of {len(judged)}"))
    if page.facts is not None:
        entries += _figures(page.facts)
    figures = (element("div", element("dt", name), element("dd", value)) for name, value in entries)
    if page.facts is None and not page.log:
        entries.append(("simulated", "not run: the task was refused"))
    touching = self_contact_line(verdict.self_contacts)
    lost = element("p", f"The log is incomplete: {page.lost}", class_="warn") if page.lost is not None else None
    return element(
        "header",
        element("div", element("h1", verdict.task), word, class_="title"),
        element("p", verdict.text, class_="subtitle") if good or not page.causes else None,
        element("p", f"Warning: {touching}", class_="warn") if touching else None,
        *(element("p", f"Attachment: {text}") for text in verdict.holding),
        element("p", f"This run did a {verdict.part}.", class_="warn") if verdict.part is not None else None,
        element("p", verdict.drawn.described()) if verdict.drawn is not None else None,
        lost,
        element("dl", *figures, class_="figures"),
    )


def _figures(facts: RunFacts) -> list[tuple[str, str]]:
    figures = []
    slips = [hold.slip.most for hold in facts.holds if hold.slip is not None and hold.hold.lifted is not None]
    if slips:
        figures.append(("slip in the hand", quantity(max(slips), "m")))
    figures.append(("energy", number(sum(joint.given for joint in facts.joints), "J")))
    total = max((step.total.value for step in facts.steps), default=0.0)
    figures.append(("peak power", number(total, "W")))
    return figures


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
    cut = str(page.verdict.saturations)
    # The page of an invalid file has no other place for its causes; a single cause is as short as its summary line.
    rest = shown[1 + ALSO :] if page.facts is not None and len(shown) > 2 + ALSO else []
    folded = element("details", element("summary", f"{len(rest)} more"), *rest) if rest else None
    others = (*shown[1 : len(shown) - len(rest)], folded)
    also = element("div", element("p", "Also:", class_="about"), *others, class_="also") if shown[1:] else None
    saturation = element("p", f"In this run: {cut}.", class_="about") if cut else None
    first = [element("div", shown[0], also, saturation)]
    if page.moment is not None:
        label = f"{page.verdict.task} at {page.moment.time:.2f} s"
        caption = element("figcaption", f"at {page.moment.time:.2f} s")
        first.append(element("figure", image(page.moment, label), caption))
    title = "Why it failed" if page.verdict.verdict == "failed" else "What went wrong"
    return element("section", heading("cause", title), element("div", *first, class_="first"), class_="why")


def warnings(page: RunPage) -> Markup | None:
    """Warnings from before the run."""
    if not page.warnings:
        return None
    shown = []
    for warning in page.warnings:
        place = element("span", str(warning.place), class_="place") if warning.place is not None else None
        hint = element("p", f"hint: {warning.hint}", class_="about") if warning.hint else None
        shown.append(
            element("div", element("p", f"{warning.message} ", place, element("small", f" {warning.code}")), hint)
        )
    title = number_of(len(shown), "warning")
    return element("section", heading("warnings", title, "Reported before the run began."), *shown, class_="warned")


def expectations(page: RunPage) -> Markup | None:
    """Each expectation with its signed margin, as a number and as a bar."""
    if not page.verdict.expectations or page.facts is None:
        return None
    rows = []
    for expectation, written, limit in page.judged:
        used: Markup | str = ""
        if expectation.margin is not None and limit is not None and limit > 0.0:
            label = of_limit(limit - expectation.margin, limit, expectation.unit)
            used = joined(meter((limit - expectation.margin) / limit, label=f"{label} used"), element("small", label))
        name = joined(element("b", expectation.name), line_link(written), element("small", expectation.text))
        margin = "–" if expectation.margin is None else signed(expectation.margin, expectation.unit)
        at = seek(expectation.at, playable=page.playback is not None)
        rows.append(
            (
                mark(expectation.outcome == "passed", expectation.outcome, excused=expectation.excused),
                name,
                margin,
                used,
                at,
            )
        )
    headers = ("outcome", "expectation", "margin", "of limit", "tightest at")
    about = "Margin: distance to the limit at the tightest moment; + is met, − is violated."
    return element(
        "section",
        heading("expectations", "Expectations", about),
        table(headers, rows, numbers=("margin",), stacks=True),
    )


def located(page: RunPage) -> Markup | None:
    """Belief against truth before and after each `locate`."""
    found = page.verdict.located
    if not found:
        return None
    rows = [
        (*row[:-1], joined(row[-1], seek(each.time, playable=page.playback is not None)))
        for row, each in zip(located_rows(found), found, strict=True)
    ]
    about = "Distance and angle between the believed and the true pose."
    return element("section", heading("located", "Located", about), table(LOCATED, rows, stacks=True))


def steps(page: RunPage) -> Markup | None:
    """Planned and measured times of the steps, their energy, and a picture of each."""
    verdict, facts = page.verdict, page.facts
    if not verdict.steps:
        return None
    parts: list[Markup | None] = []
    if facts is None:
        rows = [(_outcome(step), _step_name(page, step, written), step.text) for step, written in page.located_steps]
        parts.append(table(("outcome", "step", ""), rows))
    else:
        end = max(facts.end, 1e-9)
        by_id = {measured.id: measured for measured in facts.steps}
        written_at = {step.id: written for step, written in page.located_steps}
        timed: list[tuple[str, ...]] = []
        for depth, step in nested(verdict.steps, verdict.blocks):
            if isinstance(step, BlockOutcome):
                timed.append(_block_row(depth, step))
                continue
            written = written_at[step.id]
            took = None if step.started is None or step.ended is None else step.ended - step.started
            planned = step.planned_duration
            mine = by_id.get(step.id)
            timed.append(
                (
                    _outcome(step),
                    _indented(depth, _step_name(page, step, written)),
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
    about = "Outline: planned. Filled: measured. Lines: starts of phases." if facts is not None else ""
    return element("section", heading("steps", "Steps", about), *parts)


def _block_row(depth: int, block: BlockOutcome) -> tuple[str, ...]:
    """The row of a block, before those of its parts."""
    took = "" if block.started is None or block.ended is None else f"{block.ended - block.started:.2f} s"
    tries = element("small", f"at attempt {block.attempts}") if block.attempts > 1 else None
    shown = element("span", f"– {block.outcome}, may fail", class_="idle") if block.tolerated else None
    short = replace(block, id=own_name(block.id))
    told = element("small", block_line(short)) if block.text else None
    named = joined(element("b", short.label, title=block.id), told)
    starts = seek(block.started) if block.started is not None else ""
    outcome = joined(shown or mark(block.outcome == "done", block.outcome), tries)
    return (outcome, _indented(depth, named), block.taken, "", took, "", "", "", starts)


def _indented(depth: int, shown: Markup) -> Markup:
    """What is in `depth` blocks."""
    return element("div", shown, style=f"margin-left:{1.2 * depth:.1f}em") if depth else shown


def _outcome(step: StepOutcome) -> Markup:
    """Outcome of a step, with its number of attempts and whether it may fail."""
    shown = element("span", f"– {step.outcome}, may fail", class_="idle") if step.tolerated else None
    tries = element("small", f"at attempt {len(step.attempts)}") if len(step.attempts) > 1 else None
    return joined(shown or mark(step.outcome == "done", step.outcome), tries)


def _late(seconds: float) -> str:
    return f"{'+' if seconds > 0.0 else '−'}{abs(seconds):.2f} s" if abs(seconds) >= 0.005 else "0.00 s"


def _step_name(page: RunPage, step: StepOutcome, written: Written) -> Markup:
    shown = _phases(page, step)
    named = element("small", " · ".join(phase.name for phase in shown)) if len(shown) > 1 else None
    details: Markup | None = None
    if step.text and page.facts is not None:
        folded = element("details", element("summary", "details"), element("small", step.text))
        details = folded if step.outcome == "done" else element("small", step.text)
    replanned = [element("small", f"re-planned: {why}") for why in step.replanned]
    shown_id = step.id if page.facts is None else own_name(step.id)  # with facts, the blocks around it have rows
    name = element("b", replace(step, id=shown_id).label, title=step.id)
    return joined(name, line_link(written), named, *replanned, details)


def _phases(page: RunPage, step: StepOutcome) -> tuple[Phase, ...]:
    """The phases of a step in the replay; empty if it is not shown."""
    shown = page.playback.steps if page.playback is not None else ()
    return next((played.phases for played in shown if played.id == step.id), ())


def _gantt(page: RunPage, step: StepOutcome, end: float) -> Markup:
    """One row of the Gantt chart: two bars over the time of the whole run."""
    if step.started is None:
        return element("small", "not started")
    last = end if step.ended is None else step.ended
    scale = 1000.0 / end
    starts = [phase.start for phase in _phases(page, step)[1:]]
    duration = step.planned_duration
    told = "in the run" if duration is None else f"{duration:.2f} s"
    label = f"{step.id}: planned {told}, measured {last - step.started:.2f} s"
    width = 0.0 if duration is None else max(min(duration, end - step.started) * scale, 2.0)
    drawn = (
        element("rect", class_="row", x="0", y="0", width="1000", height="26"),
        element("rect", class_="planned", x=step.started * scale, y="3.5", width=width, height="8"),
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
        "svg", *drawn, class_="gantt", viewBox="0 0 1000 26", preserveAspectRatio="none", role="img", aria_label=label
    )
    return element("span", svg, class_="seeks", data_seek=f"{step.started:.6f}", title=label)


def _pictures(page: RunPage) -> Markup | None:
    shown = []
    for step in page.verdict.steps:
        picture = page.pictures.get(step.id)
        if picture is not None:
            label = f"{step.id} at {picture.time:.2f} s"
            caption = element("figcaption", element("b", step.id), f" {picture.time:.2f} s")
            shown.append(
                element(
                    "figure", image(picture, label), caption, data_seek=f"{picture.time:.6f}", title=f"show {label}"
                )
            )
    return element("div", *shown, class_="pictures") if shown else None


def sources(page: RunPage) -> Markup | None:
    """The resolved files with line numbers."""
    if not page.sources:
        return None
    about = "Resolved files: defaults, parameters and overrides written out, numbers in SI units."
    shown = [_source(source, page) for source in page.sources]
    return element("section", heading("files", "Files", about if page.facts is not None else ""), *shown)


def _source(source: Source, page: RunPage) -> Markup:
    """A file, folded unless the task was refused; the lines of its causes are marked."""
    lines = source.text.splitlines()
    marked = {cause.written.line for cause in page.causes if cause.written and cause.written.file == source.name}
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
    """Versions, seed, engine and hashes of the run, and notes on what the log lacks."""
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
