"""A task in English: its steps, blocks, expectations, watches and varied values, each with its origin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from manipcli.conditions.clauses import condition_clause, expectation_sentence, watch_sentence
from manipcli.conditions.members import CONDITIONS
from manipcli.core.prose import amount, listing, named, sentence
from manipcli.judge.expectation import labels
from manipcli.model.robot import RobotModel
from manipcli.plan.keeps import KEEPS
from manipcli.plan.steps import STEPS
from manipcli.spec.block import BlockSpec
from manipcli.spec.condition import ConditionSpec
from manipcli.spec.reactions import OnFail, RetrySpec
from manipcli.spec.source.tree import child, node_at, plain
from manipcli.spec.step import StepSpec
from manipcli.spec.structure.words import ELSE
from manipcli.task.origins import Origin, Origins, readable_value
from manipcli.task.task import Task
from manipcli.task.vary_text import varied_sentence

WAITED: Final = 30.0
"""[s] How long a step or block without a timeout waits for its `until`."""
COMMON: Final = ("until", "timeout", "keep", "allow", "on_fail")
GIVEN: Final = ("simulation", "planner", "clearance", "plan", "replan", "floor", "start", "scene", "frames")
"""Fields of a task whose given values are listed."""


@dataclass(frozen=True, slots=True)
class Part:
    """A step, an expectation or a watch: its id or label, its sentence, its place, and its values."""

    id: str
    text: str
    place: str
    values: tuple[Origin, ...] = ()


@dataclass(frozen=True, slots=True)
class Group:
    """A block of steps.

    Attributes:
        id, word, kind, first, last, split, parent: as in `BlockSpec`.
        text: what it does, before its steps.
        then: what is done after its steps; "" for nothing.
        given: the values of the parameters of a round or a sub-task, by name.
        is_round: whether it is one round of a `repeat`.
        place: where it is written.
    """

    id: str
    word: str
    kind: str
    first: int
    last: int
    split: int
    parent: int | None
    text: str
    then: str
    given: Mapping[str, str]
    is_round: bool
    place: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """A task in English; `values` are those of the task around its steps."""

    task: str
    description: str
    robot: str
    steps: tuple[Part, ...]
    blocks: tuple[Group, ...]
    expectations: tuple[Part, ...]
    watches: tuple[Part, ...]
    varied: tuple[Part, ...]
    values: tuple[Origin, ...]


def explained(task: Task) -> Explanation:
    """The task as sentences with resolved values."""
    spec, robot = task.spec, task.robot
    names = list(labels(spec.judged))
    judged = []
    for k, ((key, number), each) in enumerate(zip(spec.judged_at, spec.judged, strict=True)):
        write = expectation_sentence if key == "expect" else watch_sentence
        node = node_at(task.file.source.root, (key, number))
        values = tuple(_origins(task).block(each, node))
        judged.append(Part(names[k], write(each, robot, CONDITIONS), str(task.file.place(key, number)), values))
    return Explanation(
        spec.task,
        spec.description,
        robot.name,
        tuple(_step(task, k, step) for k, step in enumerate(spec.steps)),
        tuple(_block(task, k, block) for k, block in enumerate(spec.blocks)),
        tuple(judged[: len(spec.expect)]),
        tuple(judged[len(spec.expect) :]),
        tuple(
            Part(key, varied_sentence(key, law), str(task.file.source.key_place("vary", key)))
            for key, law in spec.vary.items()
        ),
        tuple(_around(task)),
    )


def _origins(task: Task, step: int | None = None) -> Origins:
    structure = task.file.source.structure
    scope = structure.scope if step is None or step >= len(structure.steps) else structure.steps[step].scope
    return Origins(scope, task.robot)


def _around(task: Task) -> Iterator[Origin]:
    root, origins = task.file.source.root, _origins(task)
    for key in GIVEN:
        node = child(root, key)
        if node is not None:
            yield from origins.value(getattr(task.spec, key), node, key, given=True)


def _step(task: Task, k: int, step: StepSpec) -> Part:
    member, origins = STEPS[step.verb], _origins(task, k)
    node = node_at(task.file.source.root, ("steps", k))
    values = list(origins.block(step.body, child(node, step.verb)))
    for key in COMMON:
        given = child(node, key)
        if given is not None:
            values += origins.value(getattr(step, key), given, key, given=True)
    said = [sentence(member.told(step.body, task.robot, task.scene))]
    said += _waits(step.until, step.timeout, task.robot, guarded=member.guarded(step.body))
    kept = [member.clause(keep) for keep in step.keep for member in KEEPS if getattr(keep, member.name) is not None]
    said += [sentence(f"meanwhile, {listing(kept)}")] if kept else []
    pairs = [listing([named(part) for part in pair]) for pair in step.allow]
    said += [sentence(f"in this step, {listing(pairs)} may touch")] if pairs else []
    said += _after_failure(step.on_fail, "the step")
    return Part(str(step.id), " ".join(said), str(task.file.place("steps", k)), tuple(values))


def _waits(
    until: ConditionSpec | None, timeout: float | None, robot: RobotModel, *, guarded: bool = False
) -> Iterator[str]:
    if until is not None:
        clause = condition_clause(until, robot, CONDITIONS)
        most = "" if timeout is not None else f", for {amount(WAITED, 's')} at most"
        stops = f"stop as soon as {clause}; if that does not happen on the way, wait for it at the end{most}"
        yield sentence(stops if guarded else f"then wait until {clause}{most}")
    if timeout is not None:
        yield f"It fails after {amount(timeout, 's')}."


def _after_failure(on_fail: OnFail, what: str) -> Iterator[str]:
    if on_fail == "continue":
        yield sentence(f"if {what} fails, the run goes on")
    elif isinstance(on_fail, RetrySpec):
        times = "once" if on_fail.retry == 1 else f"up to {on_fail.retry} times"
        other = [f"{name} = {readable_value(value, None)}" for name, value in on_fail.with_.items()]
        changed = f", with {listing(other)}" if other else ""
        then = "the run goes on" if on_fail.then == "continue" else "the run ends"
        yield sentence(f"if {what} fails, it is retried {times}{changed}; after that {then}")


def _block(task: Task, k: int, block: BlockSpec) -> Group:
    drafts = task.file.source.structure.blocks
    draft = drafts[k] if k < len(drafts) else None
    given = {} if draft is None else {name: readable_value(plain(n), None, n) for name, n in draft.given.items()}
    is_round = draft is not None and draft.is_round
    text = "Do these steps:"
    if block.kind == "if" and block.condition is not None:
        text = f"If {condition_clause(block.condition, task.robot, CONDITIONS)} when this is reached:"
    elif block.word == "if":
        taken = task.spec.steps[block.first].id or ""
        branch = ELSE if taken.startswith(f"{block.id}/{ELSE}/") else "then"
        text = f"The values in the file select `{branch}`:"
    elif block.kind == "parallel":
        text = "At the same time:"
    elif block.word == "do":
        file = "" if draft is None else str(plain(draft.item.entries["do"].node))
        text = f"Do {named(file)}{_with(given)}:" if file else f"Do a sub-task{_with(given)}:"
    elif is_round:
        text = f"Round {block.id}{_with(given)}:"
    elif block.word == "repeat":
        rounds = sum(other.parent == k for other in task.spec.blocks)
        text = f"For each of {rounds} rounds:"
    ends = [*_waits(block.until, block.timeout, task.robot), *_after_failure(block.on_fail, "one of these steps")]
    return Group(
        block.id, block.word, block.kind, block.first, block.last, block.split, block.parent, text, " ".join(ends),
        given, is_round, str(task.file.place("blocks", k)),
    )  # fmt: skip


def _with(given: Mapping[str, str]) -> str:
    """Parameters of a round or sub-task; those of a position in the rounds are left out."""
    texts = [f"{name} = {value}" for name, value in sorted(given.items()) if name != "index"]
    return f" with {listing(texts)}" if texts else ""
