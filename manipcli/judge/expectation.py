"""Evaluation of an expectation: a condition, and the ticks at which it must hold.

The result is the least margin on these ticks, with `eventually` the greatest. The ticks are known before the recording
is read, except for the end of the run.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from manipcli.conditions.condition import CheckContext, Problem, World
from manipcli.conditions.formula import Seams, absent, believing, leaves, opened, problems, scopes
from manipcli.conditions.members.step_done import StepDoneSpec
from manipcli.conditions.robustness import EDGE, Extreme, Measured, NotEvaluated, Pick, Robustness, never
from manipcli.conditions.state_window import ROUNDING, StateWindow
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean, listed
from manipcli.core.units import readable
from manipcli.judge.margin_curves import MarginTrace
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome
from manipcli.spec.condition import END, ConditionSpec, ExpectationSpec, WatchSpec

END_WINDOW = 0.5
"""[s] How long a condition must hold up to the end of the recording, so that passing through does not count."""


@dataclass(frozen=True, slots=True)
class When:
    """The ticks at which an expectation is evaluated.

    Attributes:
        intervals: [s] each including its start, excluding its end; the monitor starts at the first. None: the end of
            the run, with the monitor started at time 0.
        last: only the last tick of the intervals counts.
        words: the ticks, in words; "" for the whole run.
    """

    intervals: tuple[tuple[float, float], ...] | None
    last: bool = False
    words: str = ""


def when(spec: ExpectationSpec, steps: Sequence[StepOutcome], seam: Seams) -> When | NotEvaluated:
    """The evaluated ticks, or why there are none."""
    if spec.steps or spec.at not in (None, END):
        return _of_steps(spec, steps)
    if spec.quantifier == "eventually" and spec.within is not None:
        return When(((-np.inf, spec.within + ROUNDING),), words=f"within {readable(spec.within, 's')}")
    if spec.quantifier is not None or (spec.at is None and "always" in scopes(spec.condition, seam)):
        return When(((-np.inf, np.inf),))
    return When(None)


def _of_steps(spec: ExpectationSpec, steps: Sequence[StepOutcome]) -> When | NotEvaluated:
    known = {step.id: step for step in steps}
    ran = {step.id for step in steps if step.started is not None}
    intervals: list[tuple[float, float]] = []
    skipped: list[StepOutcome] = []
    for name in spec.steps or (spec.at or "",):
        step = known.get(name)
        if step is not None and step.outcome == "skipped":
            skipped.append(step)
            continue
        if step is None or step.started is None:
            if isinstance(spec, WatchSpec) and any(other in ran for other in spec.steps):
                continue  # this watch may have ended the run before the step
            return NotEvaluated(f"step '{name}' never ran")
        if spec.at is not None and step.ended is None:
            return NotEvaluated(f"step '{name}' never ended")
        end = np.inf if step.ended is None else step.ended - ROUNDING
        intervals.append((step.started - ROUNDING, end))
    if skipped and not intervals:
        first = skipped[0]
        return NotEvaluated(f"step '{first.id}' was skipped: {first.text}", skipped=True)
    intervals.sort()
    names = " and ".join(f"'{name}'" for name in spec.steps or (spec.at,))
    words = f"at the end of {names}" if spec.at is not None else f"during {names}"
    if spec.within is not None:
        start = intervals[0][0]
        intervals = [(a, min(b, start + spec.within + 2 * ROUNDING)) for a, b in intervals]
        words = f"{words}, within {readable(spec.within, 's')}"
    return When(tuple(intervals), last=spec.at is not None, words=words)


class Expected:
    """Evaluates one expectation, window by window; `trace`: gets its margins."""

    def __init__(
        self,
        spec: ExpectationSpec,
        world: World,
        steps: Sequence[StepOutcome],
        seam: Seams,
        trace: MarginTrace | None = None,
    ) -> None:
        self._spec = spec
        self._pick: Pick = "greatest" if spec.quantifier == "eventually" else "least"
        self._extreme = Extreme(self._pick)
        self._trace = trace
        self._recent: deque[tuple[StateWindow, Robustness]] = deque()
        self._ticks, self._first, self._last = 0, 0.0, 0.0
        self._never: NotEvaluated | None = None
        self._at_once = any(not seam[leaf.name].live for leaf in leaves(spec.condition))  # not a matter of duration
        self._when = When(None)
        reason = absent(spec.condition, world, seam)
        found = when(spec, steps, seam) if reason is None else NotEvaluated(reason)
        if isinstance(found, NotEvaluated):
            self._never = found
            return
        self._when = found
        about = believing if isinstance(spec, WatchSpec) else opened  # a watch is asked of the robot, during the run
        self._monitor = about(spec.condition, world, seam)

    def look(self, window: StateWindow) -> None:
        """Evaluate the next ticks."""
        if self._never is not None:
            return
        if not self._ticks:
            self._first = float(window.times[0])
        self._ticks, self._last = self._ticks + len(window.times), float(window.times[-1])
        intervals = self._when.intervals
        if intervals is None:
            self._keep(window)
            return
        first = int(np.searchsorted(window.times, intervals[0][0]))
        last = int(np.searchsorted(window.times, intervals[-1][1]))
        if first >= last:
            return
        shown = window.part(first, last)
        answer = self._answer(shown)
        if self._when.last:
            self._recent.append((shown, answer))
            self._traced(shown, answer)
            if len(self._recent) > 1:
                self._recent.popleft()
            return
        for start, end in intervals:
            a, b = np.searchsorted(shown.times, (start, end))
            self._extreme.add(answer, shown.times, int(a), int(b))
            self._traced(shown, answer, int(a), int(b))

    def _answer(self, window: StateWindow) -> Robustness:
        answer = self._monitor(window)
        return never(answer) if self._spec.quantifier == "never" else answer

    def _traced(self, window: StateWindow, answer: Robustness, first: int = 0, last: int | None = None) -> None:
        if self._trace is not None:
            self._trace.add(answer, window.times, self._pick, first, last)

    def _keep(self, window: StateWindow) -> None:
        """Keep the windows of the last `END_WINDOW` seconds."""
        answer = self._answer(window)
        self._recent.append((window, answer))
        self._traced(window, answer)
        start = float(window.times[-1]) - END_WINDOW - ROUNDING
        while len(self._recent) > 1 and self._recent[1][0].times[0] <= start:
            self._recent.popleft()

    def found(self, end: float) -> Measured | NotEvaluated:
        """The result, after the last tick at `end` [s]."""
        if self._never is not None:
            return self._never
        for window, answer in self._recent:
            start = float(window.times[-1]) if self._when.last else end - END_WINDOW
            self._extreme.add(answer, window.times, int(np.searchsorted(window.times, start - ROUNDING)))
            if self._trace is not None:
                self._trace.since = start - ROUNDING
        self._recent.clear()
        found = self._extreme.found
        if found is None:
            return NotEvaluated(f"no recorded tick {self._when.words}".rstrip())
        if isinstance(found, NotEvaluated):
            return found
        best = ("at best",) if self._spec.quantifier == "eventually" else ()
        words = ", ".join(word for word in (self._when.words, *best) if word)
        text = f"{found.text}{self._broken(found)}"
        return replace(found, text=f"{words}: {text}" if words else text)

    def _broken(self, found: Measured) -> str:
        """When and for how long an expectation over several ticks failed; "" if it passed."""
        first = self._extreme.broken
        if (
            first is None
            or self._at_once
            or self._spec.quantifier == "eventually"
            or self._when.intervals is None
            or self._when.last
        ):
            return ""
        if isinstance(self._spec, WatchSpec):
            return "" if first == found.at else f"; broken at t = {first:.3f} s"
        since = "" if first == found.at else f", first at t = {first:.3f} s"
        whole = self._last - self._first
        broken = self._extreme.broken_ticks * whole / max(self._ticks - 1, 1)
        return f"; broken for {readable(min(broken, whole), 's')}{since}"


def labels(expect: Sequence[ExpectationSpec]) -> Iterator[str]:
    """The names in reports: id, else label (see `ExpectationSpec.label`); duplicates are numbered from 2."""
    taken = {expectation.id for expectation in expect}
    seen = Counter[str]()
    for expectation in expect:
        name = expectation.label
        if expectation.id is None:
            seen[name] += 1
            while (name if seen[name] == 1 else f"{name}_{seen[name]}") in taken:
                seen[name] += 1
            name = name if seen[name] == 1 else f"{name}_{seen[name]}"
        yield name


def expectation_problems(spec: ExpectationSpec, context: CheckContext, seam: Seams) -> tuple[Problem, ...]:
    """Every unknown name in an expectation, and steps that end too late; `loc` is inside the expectation."""
    found = list(problems(spec.condition, context, seam))
    if isinstance(spec, WatchSpec):
        found += _known_late(spec.condition, seam)
    if spec.quantifier is not None:
        found = [Problem((spec.word, *p.loc), p.message, p.hint, p.code) for p in found]
    named: list[tuple[Loc, str]] = []
    if spec.at not in (None, END):
        named.append((("at",), spec.at or ""))
    for k, name in enumerate(spec.steps):
        named.append((("during",) if isinstance(spec.during, str) else ("during", k), name))
    for loc, name in named:
        if context.steps is not None and name not in context.steps:
            blocks = context.blocks
            known = (*context.steps, *blocks, *((END,) if loc == ("at",) else ()))
            rounds = [block for block in blocks if block.startswith(f"{name.rpartition('[')[0]}[")]
            rounds = [block for block in rounds if "/" not in block.removeprefix(name.rpartition("[")[0])]
            near = f"rounds: {listed(rounds)}" if rounds and name.endswith("]") else None
            hint = near or did_you_mean(name, known, kind="steps")
            found.append(Problem(loc, f"the task has no step '{name}'", hint))
    if not found and context.in_order:
        found += _too_early(spec, named, context.steps)
    if not found and spec.at is None and spec.during is None and spec.quantifier is None:
        wanted = scopes(spec.condition, seam)
        if len(wanted) > 1:
            message = f"time missing: `{wanted['end']}` defaults to the end, `{wanted['always']}` to the whole run"
            found.append(Problem((spec.word,), message, "add `at: end` or `during: STEP`, or write `always: {...}`"))
    return tuple(found)


def until_problems(spec: ConditionSpec, step: str | None, context: CheckContext, seam: Seams) -> tuple[Problem, ...]:
    """Every unknown name in the `until` of a step, and steps that are not done before it ends."""
    found = (*problems(spec, context, seam), *_known_late(spec, seam))
    if found or step is None or context.steps is None or not context.in_order:
        return found
    problems_found = []
    for late in _undone(spec, step, context.steps):
        what = "its own end" if late == step else f"the end of step '{late}', which runs later"
        problems_found.append(Problem((spec.name,), f"step '{step}' waits for {what}", "name an earlier step"))
    return tuple(problems_found)


def _known_late(spec: ConditionSpec, seam: Seams) -> Iterator[Problem]:
    """Conditions that are known only from a recording."""
    for name in dict.fromkeys(leaf.name for leaf in leaves(spec) if not seam[leaf.name].live):
        yield Problem((spec.name,), f"`{name}` is judged after the run, not during it", "move it to `expect`")


def _too_early(
    spec: ExpectationSpec, named: Sequence[tuple[Loc, str]], steps: Sequence[str] | None
) -> Iterator[Problem]:
    """A `step_done` that is evaluated before its step is done."""
    if spec.quantifier == "never" or (spec.quantifier == "eventually" and len(named) > 1):
        return  # it may hold in a later step
    reported: set[str] = set()
    for loc, name in reversed(named):
        for late in _undone(spec.condition, name, steps or (name,)):
            if late in reported:
                continue
            reported.add(late)
            message = f"step '{late}' is not done yet when this is evaluated"
            yield Problem(loc, message, "use `at: end`, or name a later step")


def _undone(condition: ConditionSpec, step: str, steps: Sequence[str]) -> tuple[str, ...]:
    """The steps that the condition requires to be done and that end after the last tick of `step`."""
    needed = condition.members if condition.name == "all" else (condition,)
    waited = {leaf.body.step for leaf in needed if not leaf.combines and isinstance(leaf.body, StepDoneSpec)}
    return tuple(later for later in steps[steps.index(step) :] if later in waited)


def outcome(name: str, found: Measured | NotEvaluated) -> ExpectationOutcome:
    """The outcome of expectation `name`: passed at a margin of 0 or more; a failed margin is at most -`EDGE`."""
    if isinstance(found, NotEvaluated):
        return ExpectationOutcome(
            name=name,
            outcome="skipped" if found.skipped else "not_evaluated",
            margin=None,
            unit=found.unit,
            at=None,
            text=found.reason,
        )
    passed = found.margin >= 0.0
    return ExpectationOutcome(
        name=name,
        outcome="passed" if passed else "failed",
        margin=found.margin if passed else min(found.margin, -EDGE),
        unit=found.unit,
        at=found.at,
        text=found.text,
        relative=found.relative,
    )
