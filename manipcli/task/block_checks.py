"""Checks of blocks: what may be done in parallel, and which choices are planned before the run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from manipcli.conditions.condition import Problem
from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.text import listed, number_of
from manipcli.model.robot import RobotModel
from manipcli.plan.block_tree import MOST, block_tree, blocks_of, choices
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.steps import STEPS
from manipcli.plan.steps.move import MoveSpec
from manipcli.spec.block import BlockSpec
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec

IN_THE_RUN: Final = 280
UNLIKE_PARTS: Final = 281
RETRIED_PART: Final = 282
"""Numbers of the codes of findings about blocks."""
MOVES: Final = {
    "arm": "moves the arm",
    "hand": "moves the hand",
    "both": "needs the arm and the hand",
    "nothing": "moves neither",
}


class BranchClaims:
    """The claims of controllers along the branches: `else` begins with those at its `if`, as `then` does.

    Behind an `if` they are those after `then`, the path that `Plan.steps` takes.
    """

    def __init__(self, blocks: Sequence[BlockSpec]) -> None:
        self._choices = [block for block in blocks if block.kind == "if"]
        self._at: dict[str, Claims | None] = {}
        self._after_then: dict[str, Claims | None] = {}

    def before(self, k: int, claims: Claims | None) -> Claims | None:
        """The claims before step `k`; to be called for each step in turn, with those after the step before."""
        for block in reversed(self._choices):  # inner ones end first
            if block.id in self._at and block.split == k != block.last:
                self._after_then[block.id], claims = claims, self._at[block.id]
            if block.last == k and block.id in self._after_then:
                claims = self._after_then[block.id]
        for block in self._choices:
            if block.first == k:
                self._at[block.id] = claims
        return claims


def parallel_problems(spec: TaskSpec, robot: RobotModel, claims: Claims | None) -> Iterator[tuple[int, Loc, Problem]]:
    """Number of the code, location and problem of each part that cannot be done in parallel with the other."""
    for block in spec.blocks:
        if block.kind == "parallel" and claims is not None:
            yield from _parallel(spec, block, robot, claims)


def _parallel(
    spec: TaskSpec, block: BlockSpec, robot: RobotModel, claims: Claims
) -> Iterator[tuple[int, Loc, Problem]]:
    """A part that cannot be done beside the other, or is retried alone."""
    indices = range(block.first, block.last)
    parts = {k: STEPS[spec.steps[k].verb].part(spec.steps[k].body, robot, claims.hand) for k in indices}
    hint = "one part is a `move` of the arm or a `follow`; the other is a `release`, a `grasp` without an object, or a "
    hint += "`move` to a pose of the hand's joints"
    wrong = [k for k in indices if parts[k] in ("both", "nothing")]
    if not wrong and len(set(parts.values())) < len(parts):
        wrong = [block.last - 1]
    for k in wrong[:1]:
        why = f"it {MOVES[parts[k]]}{' too' if parts[k] in ('arm', 'hand') else ''}"
        body = spec.steps[k].body
        if parts[k] == "both" and isinstance(body, MoveSpec):
            why, hint = _beyond_the_arm(body, robot, claims.hand)
        message = f"`{spec.steps[k].verb}` cannot be done in parallel here: {why}"
        yield UNLIKE_PARTS, ("steps", k), Problem((spec.steps[k].verb,), message, hint)
    for k in indices:
        if spec.steps[k].retry is not None:
            message = "a part of `parallel` cannot be retried alone"
            retried = "write `on_fail` next to `parallel`: both parts are then done again"
            yield RETRIED_PART, ("steps", k), Problem(("on_fail",), message, retried)


def _beyond_the_arm(body: MoveSpec, robot: RobotModel, hand: Sequence[str]) -> tuple[str, str]:
    """Why a `move` to joint positions needs the arm and the hand, and what moves the arm alone instead."""
    if not isinstance(body.to, str):
        too = listed(name for name in body.to or () if name in hand)
        return f"it also moves joints of the hand ({too})", "name the arm's joints alone"
    alone = [pose.name for pose in robot.poses if pose.joints and not set(pose.joints) & set(hand)]
    poses = f" ({listed(alone, most=3)})" if alone else ""
    return f"pose '{body.to}' also moves the hand", f"name the arm's joints, a pose of the arm alone{poses}, or a point"


def planned_in_the_run(task: Located[TaskSpec]) -> Iterator[Diagnostic]:
    """A warning if the task has more combinations of outcomes than are planned before the run."""
    items = block_tree(len(task.spec.steps), task.spec.blocks)
    beyond = choices(items).beyond
    if beyond is not None:
        asked = sum(block.spec.kind == "if" for block in blocks_of(items))
        message = f"the steps after '{beyond.spec.id}' are planned during the run: {number_of(asked, 'choice')} have "
        message += f"more than {MOST} combinations of outcomes"
        hint = "a step without a plan is then found during the run; split the task to plan all of it before"
        yield task.source.finding(IN_THE_RUN, ("blocks", beyond.index), message, hint=hint, severity="warning")
