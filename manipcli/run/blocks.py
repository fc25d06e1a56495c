"""The order of the steps of a running task: sequences and their retries, choices, and steps at the same time.

The plan of a branch that was not planned before the run, and of the steps after a `locate`, is made when its first step
is reached, for all steps up to the next choice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from manipcli.core.errors import NotPlannable
from manipcli.core.units import readable
from manipcli.judge.verdict import StepOutcome
from manipcli.plan.block_tree import Group, Item, Outcomes, Unit, blocks_of, steps_of, stretch
from manipcli.run.step_loop import StepLoop
from manipcli.simulate.executor import DONE, MotionEnd
from manipcli.spec.reactions import RetrySpec
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan

FAILED = MotionEnd("failed")
"""The end of a block in which a step or a block failed, which has reported why."""


class BlockLoop:
    """One pass over the steps and blocks of a task.

    Args:
        plan: of the task.
        loop: does the steps.
    """

    def __init__(self, plan: Plan, loop: StepLoop) -> None:
        self._plan = plan
        self._loop = loop
        self._outcomes: Outcomes = ()
        self._planned = {step.index: step for step in plan.branches.get((), plan.steps)}
        self._forgotten = 0
        self._last: dict[int, StepOutcome] = {}
        """The outcome of every step that was reached or skipped in the present attempt at its block."""

    def run(self) -> None:
        """Do all steps, until one fails without being tolerated, or a watch is broken."""
        if self._plan.steps:
            self._loop.resume(self._plan.steps[0])
        self._all(self._plan.items, None)
        self._loop.finish()

    def _all(self, items: Sequence[Item], limit: float | None) -> bool:
        """Do these one after the other until one fails, up to a time limit [s]; whether the task goes on."""
        return all(self._unit((item,), limit) if isinstance(item, int) else self._block(item, limit) for item in items)

    def _unit(self, unit: Unit, limit: float | None) -> bool:
        """Do one step, or two at the same time."""
        loop = self._loop
        if unit[0] not in self._planned:
            units = stretch(self._plan.items, self._outcomes).units
            try:
                found = loop.planned(units[units.index(unit) :])
            except NotPlannable as refusal:
                outcome = loop.refused(unit[0], str(refusal))
                self._last[unit[0]] = outcome
                return outcome.tolerated
            self._planned |= {step.index: step for step in found}
        planned = [self._planned[k] for k in unit]
        outcomes = (loop.step(planned[0], limit),) if len(unit) == 1 else loop.pair(planned, limit)
        self._last |= dict(zip(unit, outcomes, strict=True))
        if loop.located:
            self._forget()
        return all(outcome.outcome == "done" or outcome.tolerated for outcome in outcomes)

    def _forget(self) -> None:
        """Drop all plans, which were made before a body was located: every step is planned again when it is reached."""
        self._loop.located = False
        self._planned.clear()
        self._plan = replace(self._plan, branches={})
        self._forgotten += 1

    def _block(self, group: Group, limit: float | None) -> bool:
        """All attempts at a block; whether the task goes on."""
        spec, loop = group.spec, self._loop
        retry = spec.on_fail if isinstance(spec.on_fail, RetrySpec) else None
        attempts = 1 if retry is None else 1 + retry.retry
        outcomes, before, forgotten = self._outcomes, dict(self._planned), self._forgotten
        for attempt in range(1, attempts + 1):
            stale = self._forgotten > forgotten
            if attempt > 1 and not self._again(group, outcomes, before, stale=stale):
                break
            loop.block_event("block_started", group.index, "", _nth(attempt, attempts))
            began = loop.time
            own = None if spec.timeout is None else began + spec.timeout
            end = self._attempt(group, min((one for one in (own, limit) if one is not None), default=None))
            if own is not None and (loop.time > own if end.outcome == "done" else loop.over(own)):
                end = MotionEnd("timeout", end.text or f"its limit of {readable(own - began, 's')} was reached")
            loop.block_event("block_ended", group.index, end.outcome, end.text)
            if end.outcome == "done":
                return True
            if not loop.may_go_on:
                return False
            loop.stop()
            if loop.over(limit):
                break
        if (spec.on_fail if retry is None else retry.then) != "continue" or not loop.may_go_on:
            return False
        self._tolerate(group)
        return True

    def _attempt(self, group: Group, limit: float | None) -> MotionEnd:
        """One attempt at a block, and the wait for its `until`."""
        spec, items = group.spec, group.parts
        if spec.kind == "if":
            chosen = self._choose(group)
            if isinstance(chosen, MotionEnd):
                return chosen
            items = chosen
        went = self._unit(steps_of(items), limit) if spec.kind == "parallel" else self._all(items, limit)
        if not went:
            return FAILED
        return DONE if spec.until is None else self._loop.wait(spec.until, limit)

    def _choose(self, group: Group) -> tuple[Item, ...] | MotionEnd:
        """The parts of the branch that is taken; the other is skipped."""
        loop, spec = self._loop, group.spec
        assert spec.condition is not None  # of every `if`
        answer = loop.ask(spec.condition)
        if isinstance(answer, MotionEnd):
            return answer
        holds, text = answer
        word = "then" if holds else "else"
        loop.block_event("branch", group.index, word, text)
        self._outcomes = (*self._outcomes, holds)
        self._planned |= {step.index: step for step in self._plan.branches.get(self._outcomes, ())}
        taken, other = (group.parts, group.other) if holds else (group.other, group.parts)
        for block in blocks_of(other):
            loop.block_event("block_skipped", block.index, "skipped", f"'{spec.id}' took {word}")
        for k in steps_of(other):
            self._last[k] = loop.skipped(k, f"'{spec.id}' took {word}")
        return taken

    def _again(self, group: Group, outcomes: Outcomes, before: dict[int, PlannedStep], *, stale: bool = False) -> bool:
        """Prepare another attempt at a block: plan its steps from the measured state; whether they have a plan.

        With `stale`, the steps behind it are planned again, too.
        """
        inside = steps_of((group,))
        self._loop.begin_again(inside)
        self._last = {k: outcome for k, outcome in self._last.items() if k not in inside}
        self._outcomes, self._planned = (
            outcomes,
            {k: step for k, step in before.items() if k not in inside and not stale},
        )
        units = [unit for unit in stretch(self._plan.items, outcomes).units if unit[0] in inside]
        if not units:
            return True  # it begins with a choice
        first = before.get(units[0][0])
        try:
            found = self._planned_again(units, empty=first is not None and first.start.carried is None)
        except NotPlannable as refusal:
            self._loop.block_event("block_ended", group.index, "failed", f"no plan for another attempt: {refusal}")
            return False
        self._planned |= {step.index: step for step in found}
        return True

    def _planned_again(self, units: Sequence[Unit], *, empty: bool) -> tuple[PlannedStep, ...]:
        """Plans from the measured state; if that has no plan and the hand was `empty` before, as if it were again."""
        try:
            return self._loop.planned(units)
        except NotPlannable:
            if not (empty and self._loop.let_go()):
                raise
            return self._loop.planned(units)

    def _tolerate(self, group: Group) -> None:
        """Go on behind a block that failed: its failed steps, and those that were not reached, do not count."""
        loop, reason = self._loop, f"on_fail: continue of '{group.spec.id}'"
        loop.block_event("block_tolerated", group.index, "", "on_fail: continue")
        for block in blocks_of(group.all):
            loop.block_event("block_tolerated", block.index, "", reason)
        for k in steps_of((group,)):
            last = self._last.get(k)
            if last is None or (last.outcome not in ("done", "skipped") and not last.tolerated):
                loop.tolerated(k, reason)
        inside = {block.index for block in (group, *blocks_of(group.all))}
        while (asked := stretch(self._plan.items, self._outcomes).asked) is not None and asked.index in inside:
            self._outcomes = (*self._outcomes, True)
            self._planned |= {step.index: step for step in self._plan.branches.get(self._outcomes, ())}


def _nth(attempt: int, attempts: int) -> str:
    return f"attempt {attempt} of {attempts}" if attempts > 1 else ""
