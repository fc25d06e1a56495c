"""Progress of a run on stderr: a live line on a terminal, one line per step elsewhere."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from typing import Final, Protocol, Self

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.core.errors import Diagnostic
from manipcli.judge.verdict import StepOutcome
from manipcli.report.text import describe, describe_step

REDRAW_PERIOD = 0.1
"""[s] of wall time between two drawings: drawing more often would slow a run of 1000 ticks per second."""

_PLANNED_STEP: Final = re.compile(r"planning step \d+ of \d+, '[^']*'(?: \([^)]*\))?")
"""What a line of the planner says of its step, before the candidate: `planning step 3 of 5, 'place_1' (if_1: then)`."""


class NamedStep(Protocol):
    """A step that begins."""

    @property
    def id(self) -> str: ...
    @property
    def verb(self) -> str: ...


class PlanningProgress:
    """Prints what the planner tries: a live line on a terminal, one line per step elsewhere; clears the line at its
    end."""

    def __init__(self, *, quiet: bool = False) -> None:
        self._live = console.is_live() and not quiet
        self._quiet = quiet
        self._printed: set[str] = set()
        self._next_drawing = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.clear()

    def clear(self) -> None:
        """Removes the live line."""
        if self._live:
            console.redraw("")

    def activity(self, what: str) -> None:
        """Shows a line of the planner: `planning step 3 of 5, 'pick_1': candidate 12`."""
        found = _PLANNED_STEP.match(what)
        if self._quiet or found is None:
            return
        step = found[0]
        if self._live:
            now = time.monotonic()
            if step not in self._printed or now >= self._next_drawing:
                self._next_drawing = now + REDRAW_PERIOD
                console.redraw(what)
        elif step not in self._printed:
            console.talk(step)
        self._printed.add(step)


class StepProgress:
    """Prints the progress of one run; a context manager that clears the live line at its end.

    A run is interrupted between two ticks: both `tick` and `step_started` raise what `interrupts` raises.
    """

    def __init__(self, *, verbose: bool = False, quiet: bool = False, interrupts: Interrupts | None = None) -> None:
        self._interrupts = interrupts
        self._verbose = verbose
        self._quiet = quiet
        self._live = console.is_live() and not quiet
        self._counts: dict[str, str] = {}
        self._head = ""
        self._next_drawing = 0.0
        self._planning = PlanningProgress(quiet=quiet)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        if self._live:
            console.redraw("")

    def activity(self, what: str) -> None:
        """Shows what the planner tries; other activities are short."""
        self._planning.activity(what)

    def warned(self, findings: Sequence[Diagnostic]) -> None:
        """Prints warnings before the first step."""
        self._planning.clear()
        for finding in findings:
            if not self._quiet:
                console.talk(describe(finding))

    def step_started(self, step: NamedStep, index: int, total: int) -> None:
        """Step `index` (from 0) of `total` begins."""
        self._may_stop()
        self._counts[step.id] = f"[{index + 1}/{total}] "
        self._head = f"{self._counts[step.id]}{step.id}"
        self._next_drawing = 0.0
        if self._verbose and not self._live and not self._quiet:
            console.talk(f"{self._head}: started")

    def message(self, text: str, *, detail: bool) -> None:
        """Prints an unplanned event, of the current step if there is one; a `detail` only with --verbose."""
        if self._quiet or (detail and not self._verbose):
            return
        if self._live:
            console.redraw("")
        console.talk(f"{self._head}: {text}" if self._head else text)

    def tick(self, simulated_time: float, wall: float) -> None:
        """Redraws the live line if that is due. Both times in s from the start."""
        self._may_stop()
        if not self._live or wall < self._next_drawing:
            return
        self._next_drawing = wall + REDRAW_PERIOD
        speed = f"{simulated_time / wall:.1f} x real time" if wall > 0.0 else ""
        console.redraw(f"{self._head}  {simulated_time:.2f} s  {speed}".lstrip())

    def step_ended(self, outcome: StepOutcome) -> None:
        """Prints the outcome of a step."""
        if self._live:
            console.redraw("")
        if not self._quiet and (self._verbose or not self._live):
            console.talk(f"{self._counts.get(outcome.id, '')}{describe_step(outcome)}")
        self._head = ""

    def _may_stop(self) -> None:
        if self._interrupts is not None:
            self._interrupts.check()
