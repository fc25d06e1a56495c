"""Expectations with a foregone result: they pass, or fail, in every run of the task.

Only what follows from the files is reported: conditions on fixed bodies alone, tolerances wider than the ranges of
joints, durations above the sum of all timeouts, and `eventually` of what holds at the start. Conditions combine as
three-valued logic: true, false, unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.conditions.condition import World
from manipcli.conditions.formula import absent, leaves, opened
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.members.duration import TimeTakenSpec
from manipcli.conditions.members.saturation import SaturationSpec
from manipcli.conditions.members.tracking import TrackingSpec
from manipcli.conditions.members.upright import UprightSpec
from manipcli.conditions.state_window import StateWindow
from manipcli.core.errors import Diagnostic
from manipcli.core.geometry import Array, quat_from_matrix
from manipcli.core.units import readable
from manipcli.judge.expectation import END_WINDOW
from manipcli.model.state import WorldState
from manipcli.scene.drop_test import SETTLED_SHIFT
from manipcli.spec.condition import END, SELECTING, ConditionSpec, ExpectationSpec
from manipcli.spec.step import StepSpec
from manipcli.task.plan_task import start_position
from manipcli.task.task import Task

PLACES: Final = ("inside", "outside", "upright", "near", "above", "at_rest", "unmoved", "at_pose")
"""Conditions that follow from poses of bodies and joints; the others need contacts, steps or time."""
SHIFT: Final = SETTLED_SHIFT
"""[m, rad] A margin at the start above this is left after settling."""
HALF_TURN: Final = 3.1415
"""[rad] No two orientations differ by more than pi."""


@dataclass(frozen=True, slots=True)
class _Foregone:
    """Whether a condition holds at every tick, and why."""

    holds: bool
    why: str


def foregone(task: Task) -> Iterator[Diagnostic]:
    """TASK324: an expectation or watch that cannot fail. TASK325: one that cannot pass."""
    world = _world(task)
    for key, expectations in (("expect", task.spec.expect), ("watch", task.spec.watch)):
        for k, expected in enumerate(expectations):
            found = _of(expected, task, world)
            if found is None:
                continue
            passes = found.holds != (expected.quantifier == "never")
            word = (
                f"`{expected.quantifier}: {expected.condition.name}`" if expected.quantifier else f"`{expected.name}`"
            )
            message = f"{word} {'cannot fail' if passes else 'can never pass'}: {found.why}"
            hint = (
                "ask for what can go wrong, or remove it" if passes else "change the bodies or the limits that it names"
            )
            yield task.file.source.finding(324 if passes else 325, (key, k), message, hint=hint, severity="warning")


def _of(expected: ExpectationSpec, task: Task, world: World) -> _Foregone | None:
    found = _constant(expected.condition, lambda leaf: _leaf(leaf, expected, task, world))
    if found is not None or expected.quantifier != "eventually" or expected.steps:
        return found
    parts = [*leaves(expected.condition)]
    if _drawn(task, [name for leaf in parts for name in _names(leaf, task)]):
        return None
    if any(leaf.name not in PLACES for leaf in parts) or absent(expected.condition, world, CONDITIONS) is not None:
        return None
    return _Foregone(True, "it holds at the start already") if _at_start(expected.condition, world) > SHIFT else None


def _constant(spec: ConditionSpec, leaf: Callable[[ConditionSpec], _Foregone | None]) -> _Foregone | None:
    """The result of a formula, None if it depends on the run."""
    if not spec.combines:
        return leaf(spec)
    if spec.name in SELECTING:
        return None  # bodies of a selection can move
    parts = [_constant(member, leaf) for member in spec.members]
    if spec.name == "not":
        return None if parts[0] is None else _Foregone(not parts[0].holds, parts[0].why)
    deciding = spec.name == "any"  # one true member decides `any`, one false member decides `all`
    for part in parts:
        if part is not None and part.holds == deciding:
            return part
    known = [part for part in parts if part is not None]
    return known[0] if len(known) == len(parts) else None


def _leaf(spec: ConditionSpec, expected: ExpectationSpec, task: Task, world: World) -> _Foregone | None:
    match spec.body:
        case UprightSpec(within=within) if within >= HALF_TURN:
            return _Foregone(True, f"no tilt is above {readable(np.pi, 'rad')}")
        case SaturationSpec(below=1.0):
            return _Foregone(True, "no share is above 100 %")
        case TrackingSpec(group=group, within=within) if within >= (most := _range(task, group)):
            return _Foregone(True, f"no joint of '{group}' can be more than {most:.3g} from its reference")
        case TimeTakenSpec(below=below):
            longest = _longest(expected, task)
            if longest is not None and below > longest:
                return _Foregone(True, f"the timeouts of the steps end them within {readable(longest, 's')}")
    return _still(spec, task, world)


def _range(task: Task, group: str) -> float:
    """The largest range of the joints [rad or m], at least pi for a continuous joint; infinite without limits."""
    limits = [task.robot.joint(name).limits for name in task.robot.group(group).joints]
    ranges = [np.inf if x.lower is None or x.upper is None else x.upper - x.lower for x in limits]
    return float(max(ranges, default=np.inf))


def _longest(expected: ExpectationSpec, task: Task) -> float | None:
    """[s] after which the measured time has ended, by the timeouts of its steps; None if a step has none."""
    if task.spec.blocks or expected.quantifier == "never" or len(expected.steps) > 1:
        return None
    named = expected.steps or ((expected.at,) if expected.at not in (None, END) else ())
    steps = [step for step in task.spec.steps if not named or step.id in named]
    times = [_attempts(step) * step.timeout for step in steps if step.timeout is not None]
    if len(times) < len(steps) or (not named and any(step.retry is not None for step in steps)):
        return None
    return sum(times) + (0.0 if named else 2.0 * END_WINDOW)


def _attempts(step: StepSpec) -> int:
    return 1 if step.retry is None else 1 + step.retry.retry


def _still(spec: ConditionSpec, task: Task, world: World) -> _Foregone | None:
    """A condition on places of fixed bodies alone: its result at the start."""
    if spec.name not in PLACES or spec.name == "at_pose":
        return None
    bodies = {body.name: body for body in task.true.scene.bodies}
    named = _names(spec, task)
    if any(name not in bodies or not bodies[name].fixed for name in named if name not in ("start", "world")):
        return None
    fixed = [name for name in named if name in bodies]
    if not fixed or _drawn(task, fixed) or absent(spec, world, CONDITIONS) is not None:
        return None
    verb = "are" if len(set(fixed)) > 1 else "is"
    return _Foregone(_at_start(spec, world) >= 0.0, f"{_listed(fixed)} {verb} fixed")


def _names(spec: ConditionSpec, task: Task) -> list[str]:
    """The texts in a condition; frames as the bodies that they are fixed to."""
    parents = {frame.name: frame.parent for frame in task.true.scene.frames}
    texts = [value for value in spec.body.model_dump().values() if isinstance(value, str)]
    return [parents.get(text, text) for text in texts]


def _drawn(task: Task, bodies: list[str]) -> bool:
    """Whether samples can change one of these bodies, or a frame."""
    paths = [path.split(".") for path in task.spec.vary]
    return any(path[0] in ("frames", "params") or (path[0] == "scene" and path[1] in ("*", *bodies)) for path in paths)


def _listed(names: list[str]) -> str:
    return " and ".join(f"'{name}'" for name in dict.fromkeys(names))


def _at_start(spec: ConditionSpec, world: World) -> float:
    """The margin at the first tick, as far as it follows from poses; the least of different units."""
    window = StateWindow(world.start.map(lambda a: a[np.newaxis]), None, (), (), ())
    reading = opened(spec, world, CONDITIONS)(window)
    return float(reading.margins[0]) if bool(reading.applies[0]) else -np.inf


def _world(task: Task) -> World:
    """The world as written, at rest."""
    q, scene = start_position(task), task.true.scene
    m = len(scene.movable)

    def rows(value: Callable[[int], Array], width: int) -> Array:
        return np.array([value(k) for k in range(m)]).reshape(m, width)

    start = WorldState(
        time=np.array(0.0),
        position=q,
        velocity=np.zeros_like(q),
        effort=np.zeros_like(q),
        body_position=rows(lambda k: scene.movable[k].X_WO.p, 3),
        body_quat_xyzw=rows(lambda k: quat_from_matrix(scene.movable[k].X_WO.R), 4),
        body_linear=np.zeros((m, 3)),
        body_angular=np.zeros((m, 3)),
    )
    steps = tuple(step.id for step in task.spec.steps if step.id is not None)
    return World(task.robot, scene, start, steps=steps, period=task.spec.simulation.control_period)
