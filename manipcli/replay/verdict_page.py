"""Verdict, cause, expectations and steps of a run as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from manipcli.replay.playback import Playback

PASS, FAIL = "✓", "✗"
_SPECIAL = str.maketrans({character: f"\\{character}" for character in "\\`*_[]<>|#!~&"})


def verdict_page(playback: Playback) -> str:
    """Markdown; texts of the log are escaped, so that a name is not a link or a picture."""
    verdict = playback.verdict
    parts = [f"# {plain(playback.name)}"]
    if verdict is not None:
        mark = PASS if verdict.verdict == "passed" else FAIL
        parts.append(f"**{mark} {verdict.verdict}** {plain(verdict.text)}")
        # The text of a verdict names the first cause.
        causes = [f"step '{step.label}' {step.outcome}: {step.text}" for step in verdict.steps if step.went_wrong]
        causes += (f"expectation '{one.name}': {one.text}" for one in verdict.expectations if one.missed)
        parts += (f"{FAIL} {plain(cause)}" for cause in causes if cause.partition(": ")[2] not in verdict.text)
    if playback.lost is not None:
        parts.append(f"{FAIL} the log is incomplete: {plain(playback.lost)}")
    if verdict is not None and verdict.expectations:
        rows = [
            (
                f"{FAIL if one.missed else PASS} {one.outcome}",
                one.name,
                "-" if one.margin is None else f"{one.margin:.4g} {one.unit}",
                _seconds(one.at),
                one.text,
            )
            for one in verdict.expectations
        ]
        parts.append(_table(("expectation", "name", "margin", "tightest at", "measured"), rows))
    if verdict is not None and verdict.steps:
        steps = [
            (
                f"{_mark(step.outcome)} {step.outcome}",
                step.label,
                _seconds(step.started),
                _seconds(step.ended),
                step.text,
            )
            for step in verdict.steps
        ]
        parts.append(_table(("step", "id", "started", "ended", ""), steps))
    parts += (f"note: {plain(note)}" for note in playback.notes)
    if verdict is not None:
        parts.append(f"{verdict.simulated_time:.2f} s simulated; engine {plain(verdict.engine)}, seed {verdict.seed}")
    return "\n\n".join(parts) + "\n"


def plain(text: str) -> str:
    """A text as Markdown that shows it as it is, on one line."""
    return " ".join(text.split()).translate(_SPECIAL)


def _mark(outcome: str) -> str:
    return {"done": PASS, "skipped": "-"}.get(outcome, FAIL)


def _seconds(time: float | None) -> str:
    return "-" if time is None else f"{time:.2f} s"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *([plain(cell) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
