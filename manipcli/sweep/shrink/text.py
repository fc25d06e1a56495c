"""The smallest change in the terminal, as comment of its file and as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.report.table import table
from manipcli.sweep.results import Margin
from manipcli.sweep.shrink.runs import State
from manipcli.sweep.shrink.session import Found
from manipcli.sweep.shrink.shrink import Smallest
from manipcli.sweep.shrink.space import Space
from manipcli.sweep.shrink.trial import Trial


def state_text(state: State) -> str:
    """`37 of at most 100 runs: bisecting; fails at 2.31 spreads, 3.1 s per run`."""
    near = f"; fails at {state.nearest:.3g} spreads" if state.nearest is not None else ""
    return f"{state.done} of at most {state.budget} runs: {state.doing}{near}"


def nothing_text(task: str, found: Found) -> str:
    """Why there is no change."""
    if found.written.outcome != "passed":
        what = (
            found.written.way if found.written.outcome == "failed" and str(found.written.way) else found.written.outcome
        )
        return f"{task}: does not pass as written, so there is nothing to shrink: {what}: {found.written.result.cause}"
    ran = outcomes_text(found.outcomes)
    return f"{task}: nothing fails: {ran or 'no changes'} in {found.done} runs, to several times the declared spread"


def render_text(task: str, space: Space, smallest: Smallest) -> str:
    """What breaks, how far it is from the task as written, and the numbers."""
    point = smallest.trial.point
    heading = f"{task}: fails at a distance of {point.distance:.3g} spreads"
    return "\n".join([heading, *_described(space, smallest)])


def comment(task: str, space: Space, smallest: Smallest, command: str) -> list[str]:
    """The comment above the file."""
    return [
        f"The smallest change under which '{task}' fails, found by manipcli shrink: {command}",
        f"Distance: {smallest.trial.point.distance:.3g} spreads.",
        *_described(space, smallest),
        "",
    ]


def _described(space: Space, smallest: Smallest) -> list[str]:
    point, result = smallest.trial.point, smallest.trial.result
    where = "within" if space.inside(point) else "beyond"
    changed = f"{len(point.changed)} of {number_of(len(point.x), 'number')} changed"
    return [
        result.cause,
        f"{changed}, {where} the declared spread; {_nearer(smallest)}",
        "",
        *numbers(space, smallest).splitlines(),
    ]


def numbers(space: Space, smallest: Smallest) -> str:
    """A table: each number as written, where it fails, and by how many spreads they differ."""
    rows = []
    for k, each in enumerate(space.coordinates):
        x = smallest.trial.point.x[k]
        ends = (space.origin, smallest.trial.point)
        values = [readable(space.value(k, point), each.quantity.unit, digits=6) for point in ends]
        cells = (*values, f"{x:+.3f}") if x else (values[0], "as written", "0")
        rows.append((each.name, *(cell.replace("-", "−") for cell in cells)))
    headers = ("number", "as written", "fails at", "spreads")
    return table(headers, rows, right=headers[1:])


def _nearer(smallest: Smallest) -> str:
    nearer = smallest.nearer
    if nearer is None:
        return "not confirmed: the search ended before the same change at 0.9 of the distance was run"
    if nearer.outcome == "passed":
        margin = _tightest(nearer)
        met = f", {margin.name} by {readable(margin.value, margin.unit)}" if margin and margin.value is not None else ""
        return f"the same change at 0.9 of the distance passes{met}"
    way = f" ({nearer.way})" if str(nearer.way) else ""
    return f"the same change at 0.9 of the distance {_WORDS[nearer.outcome]}{way}"


_WORDS = {"failed": "fails in another way", "refused": "is refused", "crashed": "has no verdict"}


def _tightest(trial: Trial) -> Margin | None:
    known = [margin for margin in trial.result.margins if margin.telling]
    return min(known, key=lambda margin: margin.relative or 0.0, default=None)


def trial_object(trial: Trial) -> Mapping[str, object]:
    """A run, for JSON."""
    return {
        "distance": trial.point.distance,
        "outcome": trial.outcome,
        "step": trial.way.step,
        "expectation": trial.way.broken,
        "cause": trial.result.cause,
        "margins": {margin.name: margin.finite for margin in trial.result.margins},
    }


def json_object(space: Space, smallest: Smallest, file: Path | None) -> Mapping[str, object]:
    """A change, for `render_json`."""
    trial, nearer = smallest.trial, smallest.nearer
    return {
        **trial_object(trial),
        "inside_declared_spread": space.inside(trial.point),
        "numbers": [
            {
                "name": each.name,
                "nominal": space.value(k, space.origin),
                "value": space.value(k, trial.point),
                "spreads": trial.point.x[k],
                "spread": each.spread,
            }
            for k, each in enumerate(space.coordinates)
        ],
        "nearer": None if nearer is None else trial_object(nearer),
        "confirmed": smallest.confirmed,
        "file": None if file is None else str(file),
    }


def outcomes_text(outcomes: Sequence[str]) -> str:
    """`60 passed, 3 refused`."""
    return ", ".join(f"{outcomes.count(word)} {word}" for word in dict.fromkeys(outcomes))
