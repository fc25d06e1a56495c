"""The verdict on a run, with the outcomes of its steps and expectations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from manipcli.conditions.robustness import EDGE
from manipcli.core.errors import Diagnostic
from manipcli.core.refused_candidates import RefusedCandidates
from manipcli.judge.drawn import Drawn
from manipcli.judge.located import Correction
from manipcli.judge.part import RunPart
from manipcli.judge.saturations import Saturations
from manipcli.judge.self_contacts import SelfContact

VerdictWord = Literal["passed", "failed", "error"]
ExpectationWord = Literal["passed", "failed", "not_evaluated", "skipped"]
StepWord = Literal["done", "failed", "timeout", "interrupted", "not_run", "skipped"]

INTERRUPTED = "RUN101"
"""Code of the error of a run that was interrupted by the user."""


def broken_at(watch: str) -> str:
    """How the text of an event begins whose watch ended the run."""
    return f"'{watch}' is broken at "


def own_name(id: str) -> str:
    """An id without the blocks around it: `pick_1` of `stack[0]/pick_1`, `else/place_1` of `if_1/else/place_1`."""
    around, _, name = id.rpartition("/")
    return f"else/{name}" if around.endswith("/else") else name


@dataclass(frozen=True, slots=True)
class Attempt:
    """An attempt at a step: start and end [s], and outcome."""

    outcome: StepWord
    started: float
    ended: float | None
    text: str = ""


@dataclass(frozen=True, slots=True)
class StepOutcome:
    """The outcome of a step.

    Attributes:
        id, verb: of the step.
        outcome, text: of its last attempt; `skipped`: its branch was not taken.
        started, ended: simulated time [s]; None if it never started or ended.
        planned_duration: [s]; None without a plan.
        attempts: in order.
        tolerated: it failed or was not reached, and the task tolerates that (`on_fail: continue`).
        replanned: the reason of each re-planning during the run.
        excused: the run was not asked to do it.
    """

    id: str
    verb: str
    outcome: StepWord
    started: float | None
    ended: float | None
    planned_duration: float | None
    text: str = ""
    attempts: tuple[Attempt, ...] = ()
    tolerated: bool = False
    replanned: tuple[str, ...] = ()
    excused: bool = False

    @property
    def label(self) -> str:
        """Its id, followed by its verb unless its own name begins with it."""
        return self.id if self.id.rpartition("/")[2].startswith(self.verb) else f"{self.id} ({self.verb})"

    @property
    def went_wrong(self) -> bool:
        """Whether it ran and was not done, and the task does not tolerate that."""
        return self.outcome not in ("done", "not_run", "skipped") and not self.tolerated and not self.excused


@dataclass(frozen=True, slots=True)
class BlockOutcome:
    """The outcome of a block of steps: `steps[first:last]`.

    Attributes:
        id, word: of the block; `word` is its key in the file.
        first, last: indices of its steps.
        parent: index of the enclosing block; None for an outermost one.
        outcome, text: of its last attempt; the text of an `if` is the evaluation of its condition.
        started, ended: simulated time [s]; None if it never started or ended.
        attempts: number of attempts.
        taken: `then` or `else` of an `if`; "" for other blocks, and before it is asked.
        tolerated: it failed, and the task goes on behind it (`on_fail: continue`).
    """

    id: str
    word: str
    first: int
    last: int
    parent: int | None
    outcome: StepWord
    started: float | None
    ended: float | None
    attempts: int = 0
    taken: str = ""
    text: str = ""
    tolerated: bool = False

    @property
    def went_wrong(self) -> bool:
        """Whether it ran and was not done, and the task does not tolerate that."""
        return self.outcome not in ("done", "not_run", "skipped") and not self.tolerated

    @property
    def label(self) -> str:
        """Its key in the file and its id: `repeat 'stack'`."""
        return f"{self.word} '{self.id}'"


@dataclass(frozen=True, slots=True)
class ExpectationOutcome:
    """The outcome of an expectation.

    Attributes:
        name: in reports.
        outcome: `passed`, `failed`, `not_evaluated`, or `skipped` with the steps that it is asked of.
        margin: in `unit`, negative if it failed; None if not evaluated.
        unit: SI.
        at: [s] the time of the deciding tick.
        text: the measurement.
        relative: the margin divided by its tolerance, to compare margins of different units.
        excused: it concerns steps that the run was not asked to do, so that its being not evaluated is no failure.
    """

    name: str
    outcome: ExpectationWord
    margin: float | None
    unit: str
    at: float | None
    text: str = ""
    relative: float | None = None
    excused: bool = False

    @property
    def missed(self) -> bool:
        """Whether it is not met, and the run was asked to do what it concerns."""
        return self.outcome not in ("passed", "skipped") and not self.excused

    @property
    def distance(self) -> float:
        """|margin| in `unit`; 0 if it is too small to show, or if there is no unit."""
        size = abs(self.margin or 0.0)
        return size if self.unit and size > EDGE else 0.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a recording.

    Attributes:
        verdict, text: the result, and its reason in one line.
        simulated_time: [s] of the last tick.
        errors: why the recording cannot be judged: no run, an interrupted run, or an incomplete log.
        drawn: the sample of the task's `vary:`; None: the task as written.
        saturations: saturation of joints and actuators.
        self_contacts: the pairs of links of the robot that pressed on each other.
        located: corrections of the believed poses of bodies.
        holding: what held objects by an attachment instead of friction, one text per object and kind.
        candidates: the refused candidates of a task without a plan.
        implied: outcomes of the expectations that every task has unless it sets them otherwise (`saturation`).
        part: the part of the task that was run; None: all of it.
        blocks: the groups of its steps; a block precedes its parts.
    """

    task: str
    verdict: VerdictWord
    seed: int
    engine: str
    simulated_time: float
    steps: tuple[StepOutcome, ...]
    expectations: tuple[ExpectationOutcome, ...]
    errors: tuple[Diagnostic, ...] = ()
    text: str = ""
    drawn: Drawn | None = None
    saturations: Saturations = field(default_factory=Saturations)
    self_contacts: tuple[SelfContact, ...] = ()
    located: tuple[Correction, ...] = ()
    holding: tuple[str, ...] = ()
    candidates: tuple[RefusedCandidates, ...] = ()
    implied: tuple[ExpectationOutcome, ...] = ()
    part: RunPart | None = None
    blocks: tuple[BlockOutcome, ...] = ()

    @property
    def blocks_at_fault(self) -> tuple[BlockOutcome, ...]:
        """The blocks that went wrong although none of their steps and blocks did."""
        wrong = [block for block in self.blocks if block.went_wrong]
        return tuple(
            block
            for block in wrong
            if not any(step.went_wrong for step in self.steps[block.first : block.last])
            and not any(other.parent is not None and self.blocks[other.parent] is block for other in wrong)
        )

    @property
    def ended_between(self) -> bool:
        """Whether the run ended before its first step or after its last, so that no step or expectation shows why."""
        if any(step.went_wrong for step in self.steps) or self.blocks_at_fault:
            return False
        undone = any(step.outcome == "not_run" and not step.excused for step in self.steps)
        return undone or not any(expectation.missed for expectation in self.expectations)
