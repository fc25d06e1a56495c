"""Parts of tasks: the steps of a run from `--from` to `--until`, and the start state from the log of another run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.geometry import Array, frozen
from manipcli.core.text import did_you_mean, listed
from manipcli.judge.part import PART, RunPart
from manipcli.judge.steps import step_outcomes
from manipcli.model.grasp import GRIP_FORCE, pinch_force
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.plan.outline import PLAN_FILE
from manipcli.record.channels import TF
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording, Span
from manipcli.record.start_state import START_STATE, StartState
from manipcli.scene.scene import Scene
from manipcli.spec.task import TaskSpec
from manipcli.task.part import LIVE, LIVE_RUN, WHOLE, Part
from manipcli.task.task import Task

ROUNDING = 1e-9
"""[s] Recorded times are whole nanoseconds."""


def part_until(task: Task, last: str, *, option: str = "--until") -> Part:
    """The part of a task up to a step, from its start; `option`: names it in errors.

    Raises:
        InvalidInput: an unknown step or block, or one inside a block not done in order.
    """
    end = _index(task, last, option) + 1
    return Part(last=end, until=str(task.spec.steps[end - 1].id))


def task_part(task: Task, *, first: str | None, last: str | None, log: Path) -> Part:
    """The part of a task from step `first` to step `last`, both included.

    Args:
        task: the task.
        first: id of the first step, whose start state `log` has, or of a block that begins with it; None: the first
            of the task.
        last: id of the last step, or of a block that ends with it; None: the last of the task.
        log: the log of a run of the task.

    Raises:
        InvalidInput: an unknown step or block, one inside a block not done in order, or a log without the state.
    """
    begin = 0 if first is None else _index(task, first, "--from")
    end = None if last is None else _index(task, last, "--until") + 1
    if end is not None and begin >= end:
        raise InvalidInput([Diagnostic("USE121", f"--until '{last}' is before --from '{first}'")])
    state = None if first is None else _StateOf(task, begin, log).state()
    return Part(begin, end, "" if end is None else str(task.spec.steps[end - 1].id), state)


def recorded_part(recording: Recording, path: Path, spec: TaskSpec, robot: RobotModel, scene: Scene) -> Part:
    """The part of its task that the run of a log did.

    Raises:
        InvalidInput: its metadata or its start state is damaged, or does not belong to its task.
    """
    if PART not in recording.metadata:
        return WHOLE
    part = RunPart.from_metadata(recording.metadata[PART])
    if part.live:
        return LIVE_RUN if part.runs else LIVE
    ids = [step.id for step in spec.steps]
    state = _recorded_state(recording, path)
    unknown = [name for name in (part.first, part.last) if name and name not in ids]
    if unknown:
        raise _damaged(path, f"names step '{unknown[0]}', which its task does not have")
    if (state is None) != (not part.first):
        raise _damaged(path, "has no start state")
    bodies = tuple(body.name for body in scene.movable)
    if state is not None and (state.joints, state.bodies) != (robot.joint_names, bodies):
        raise _damaged(path, "has a start state of other joints or bodies")
    end = ids.index(part.last) + 1 if part.last else None
    return Part(ids.index(part.first) if part.first else 0, end, part.last, state)


def _recorded_state(recording: Recording, path: Path) -> StartState | None:
    """The state in which the run of a log began, if it was that of another run."""
    content = recording.attachments.get(START_STATE)
    try:
        return None if content is None else StartState.from_json(content)
    except ValueError as error:
        raise _damaged(path, str(error)) from None


def _damaged(path: Path, why: str) -> InvalidInput:
    return InvalidInput([Diagnostic("LOG103", f"{path.name} {why}")])


def _index(task: Task, name: str, option: str) -> int:
    """Index of a step by its id; by the id of a block, of its first step for `--from`, of its last for `--until`."""
    ids, blocks = [str(step.id) for step in task.spec.steps], task.spec.blocks
    at, named = next(((k, block) for k, block in enumerate(blocks) if block.id == name), (0, None))
    if named is None and name not in ids:
        message = f"{option}: task '{task.name}' has no step '{name}'"
        hint = did_you_mean(name, [*ids, *(block.id for block in blocks)], kind="steps")
        raise InvalidInput([Diagnostic("USE120", message, hint=hint)])
    first, last = (k := ids.index(name), k + 1) if named is None else (named.first, named.last)
    for n, block in enumerate(blocks):
        edge = (block.first if option == "--from" else block.last - 1) if block.kind == "parallel" else None
        around = block.first <= first and last <= block.last and block is not named
        inside = named is not None and n > at and named.first <= block.first and block.last <= named.last
        if block.kind not in ("if", "parallel") or not around or inside:
            continue
        if (first if option == "--from" else last - 1) != edge:
            what = "step" if named is None else "block"
            message = f"{option}: {what} '{name}' is inside `{block.kind}` '{block.id}', which is not done step by step"
            hint = f"name '{block.id}', or a step before it or behind it{'' if edge is None else f', or {ids[edge]!r}'}"
            raise InvalidInput([Diagnostic("USE122", message, task.file.place("steps", first), hint)])
    return first if option == "--from" else last - 1


@dataclass(frozen=True, slots=True)
class _StateOf:
    """The state of a log at the start of a step, for a task that can differ from the one of the log."""

    task: Task
    k: int
    log: Path

    def state(self) -> StartState:
        step = str(self.task.spec.steps[self.k].id)
        if not self.log.is_file():
            hint = "run the task first, or name a log with --state LOG"
            raise InvalidInput([Diagnostic("LOG120", f"no log '{self.log}' with the state before '{step}'", hint=hint)])
        recording = open_recording(self.log)
        time = self._time(recording, step)
        self._same(recording)
        span, at = self._tick(recording, time)
        states = span.states.map(lambda array: array[at])
        active, inactive, reference = _references(span, at, recording.joint_names)
        contacts: tuple[Contact, ...] = ()
        for snapshot in (change for each in recording.spans for change in each.contacts):
            if snapshot.time <= time + ROUNDING:
                contacts = snapshot.contacts
        closed = self._closed(recording, time)
        joints = self.task.robot.joint_names
        order = [recording.joint_names.index(name) for name in joints]
        bodies = tuple(body.name for body in self.task.scene.movable)
        rows = [recording.body_names.index(name) for name in bodies]
        poses = np.concatenate((states.body_position, states.body_quat_xyzw), axis=1)
        latest = {each.body: each for each in recording.beliefs if each.time <= time + ROUNDING}
        known = {name for name, body in self.task.spec.scene.items() if body.known is not None}
        uncertain = tuple(name for name in recording.believed_names if name in latest and name in known)
        believed = poses.copy()
        if uncertain:
            believed[[recording.body_names.index(name) for name in recording.believed_names]] = span.believed[at]
        state = StartState(
            log=self.log.name,
            sha256=hashlib.sha256(self.log.read_bytes()).hexdigest(),
            step=step,
            time=float(states.time),
            joints=joints,
            position=frozen(states.position[order]),
            velocity=frozen(states.velocity[order]),
            reference=frozen(reference[order]),
            bodies=bodies,
            poses=frozen(poses[rows]),
            twists=frozen(np.concatenate((states.body_linear, states.body_angular), axis=1)[rows]),
            active=active,
            inactive=inactive,
            held=_held(recording, contacts, time, bodies) if closed else "",
            closed=closed,
            uncertain=uncertain,
            believed=frozen(believed[rows if uncertain else []]),
            covariances=frozen(np.reshape([latest[name].covariance for name in uncertain], (-1, 36))),
        )
        if state.damage:
            raise _damaged(self.log, f"has a damaged state at {time:.3f} s: {state.damage}")
        return state

    def _time(self, recording: Recording, step: str) -> float:
        """[s] When the step began; if it did not, when the step before it was done."""
        ran = {outcome.id: outcome for outcome in step_outcomes(recording, interrupted=True)}
        steps, blocks = self.task.spec.steps, self.task.spec.blocks
        # Of a choice, the run of the log may have taken the other branch.
        behind = max(
            (block.last for block in blocks if block.kind == "if" and block.first == self.k), default=self.k + 1
        )
        inside = [ran[str(one.id)].started for one in steps[self.k : behind] if str(one.id) in ran]
        if (began := min((time for time in inside if time is not None), default=None)) is not None:
            return began
        before = str(self.task.spec.steps[self.k - 1].id) if self.k else ""
        if before in ran and ran[before].outcome == "done" and (ended := ran[before].ended) is not None:
            return ended
        started = [outcome.id for outcome in ran.values() if outcome.started is not None]
        message = f"{self.log}: step '{step}' never started in this run"
        hint = f"it has the start of {listed([repr(name) for name in started])}" if started else None
        raise InvalidInput([Diagnostic("LOG120", message, Place(str(self.log), 0, 0), hint)])

    def _same(self, recording: Recording) -> None:
        """Refuse a log of other joints or bodies, whose state cannot be applied."""
        task = self.task
        bodies = {body.name for body in task.scene.movable}
        found = [*_unlike("joint", set(task.robot.joint_names), set(recording.joint_names))]
        found += _unlike("movable body", bodies, set(recording.body_names))
        unknown = [name for name, body in task.spec.scene.items() if body.known is not None]
        found += [
            f"the log has no belief about '{name}'"
            for name in unknown
            if TF not in recording.absent and all(each.body != name for each in recording.beliefs)
        ]
        if TF in recording.absent:
            found.append(f"the log has no {TF}: its task excludes it from `record:`")
        if found:
            message = f"the state of {self.log} cannot be applied to task '{task.name}': {'; '.join(found)}"
            hint = "changed gains, steps, poses and expectations are allowed; run the changed task once from its start"
            raise InvalidInput([Diagnostic("LOG121", message, Place(str(self.log), 0, 0), hint)])

    def _tick(self, recording: Recording, time: float) -> tuple[Span, int]:
        """The last recorded tick that is not after `time`."""
        before: Span | None = None
        for span in recording.spans:
            if len(span.states.time) == 0 or span.states.time[0] > time + ROUNDING:
                break
            before = span
        if before is None:
            raise InvalidInput([Diagnostic("LOG120", f"{self.log} has no tick at {time:.3f} s")])
        return before, int(np.searchsorted(before.states.time, time + ROUNDING)) - 1

    def _closed(self, recording: Recording, time: float) -> bool:
        """Whether the hand was closed to hold something: the last motion of the hand in the steps done before."""
        ran = {outcome.id for outcome in step_outcomes(recording, interrupted=True) if _ended(outcome.ended, time)}
        origin = _recorded_state(recording, self.log)
        closed = origin is not None and origin.closed
        for motion in _motions(recording, ran):
            if "attaches" in motion or ("hand" in motion and motion.get("force") is not None):
                closed = True
            elif "hand" in motion:
                closed = False
        attached = [event.kind for event in recording.events if event.time <= time + ROUNDING]
        changes = [kind for kind in attached if kind in ("attached", "detached", "attachment_broken")]
        return changes[-1] == "attached" if changes else closed


def _ended(ended: float | None, time: float) -> bool:
    return ended is not None and ended <= time + ROUNDING


def _motions(recording: Recording, ran: set[str]) -> Iterator[dict[str, object]]:
    """The planned motions of these steps, as the log has them."""
    try:
        plan = json.loads(recording.attachments.get(PLAN_FILE, b"{}"))
        steps = [step for step in plan.get("steps", ()) if step["id"] in ran]
        motions = [motion for step in steps for motion in step.get("motions", ())]
    except (ValueError, KeyError, TypeError, AttributeError):
        return
    if not all(isinstance(motion, dict) for motion in motions):
        raise InvalidInput([Diagnostic("LOG103", f"its {PLAN_FILE} is damaged: a motion is not a mapping")])
    yield from motions


def _held(recording: Recording, contacts: tuple[Contact, ...], time: float, bodies: tuple[str, ...]) -> str:
    """The body in the closed hand: the one that is attached, else the one that is pinched hardest; "" without one."""
    attached = [event for event in recording.events if event.kind == "attached" and event.time <= time + ROUNDING]
    if attached:
        names = [name for name in bodies if f"'{name}'" in attached[-1].text]
        return max(names, key=len, default="")
    forces = {name: pinch_force(contacts, name) for name in bodies}
    hardest = max(forces, key=lambda name: forces[name], default="")
    return hardest if hardest and forces[hardest] >= GRIP_FORCE else ""


def _references(span: Span, at: int, joints: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
    """Names of the active and the inactive controllers, and the reference (n) of each joint; NaN without one."""
    active: list[str] = []
    inactive: list[str] = []
    reference = np.full(len(joints), np.nan)
    for trace in span.controllers:
        wanted = trace.reference_position[at]
        (inactive if np.isnan(wanted).all() and len(wanted) else active).append(trace.name)
        for name, value in zip(trace.joints, wanted.tolist(), strict=True):
            if not np.isnan(value):
                reference[joints.index(name)] = value
    return tuple(active), tuple(inactive), reference


def _unlike(kind: str, ours: set[str], theirs: set[str]) -> Iterator[str]:
    for where, names in (("only in the task", ours - theirs), ("only in the log", theirs - ours)):
        if names:
            yield f"{kind} {listed([repr(name) for name in sorted(names)])} is {where}"
