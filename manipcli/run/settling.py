"""Settling of the bodies before the start of a run: alone they barely move, those of a `count` fall until at rest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import SimulationFailed
from manipcli.core.geometry import Transform
from manipcli.model.state import WorldState
from manipcli.scene.containing import contains
from manipcli.scene.drop_test import SETTLED_SHIFT, bottom, top
from manipcli.scene.scene import Body
from manipcli.simulate.executor import Executor
from manipcli.simulate.session import Session
from manipcli.spec.counted import group
from manipcli.spec.scene import BodySpec
from manipcli.task.task import Task

SETTLED_SPEED: Final = 0.02
"""Bodies slower than this [m/s] have settled."""
LONGEST: Final = 10.0
"""[s] Longest time in which the bodies of a `count` come to rest."""
LOOK: Final = 0.1
"""[s] Between two looks whether they are at rest."""


def settle(task: Task, session: Session) -> None:
    """Let all bodies settle, and refuse a start from which a body slides, falls or is thrown.

    Bodies of a `count` may move; they have settled when none is faster than `SETTLED_SPEED`, at all looks of the time
    that other bodies get.

    Raises:
        SimulationFailed: names the body, and how far or how fast it moved, or what it fell out of.
    """
    least = task.spec.simulation.settle
    try:
        _hold(session, least)
        heaped = dict(_heaped(task))
        passed, calm = least, 0.0
        while heaped and calm < least and passed < LONGEST:
            _hold(session, LOOK)
            passed += LOOK
            calm = calm + LOOK if max(_speeds(session, heaped)) < SETTLED_SPEED else 0.0
    except SimulationFailed as failed:
        what, mark, advice = failed.cause.partition("; ")
        cause = f"{what} while settling before the start{mark}{advice}"
        raise SimulationFailed(cause, time=failed.time) from failed
    state = session.engine.read()
    for k, body in enumerate(task.true.scene.movable):
        shift = float(np.linalg.norm(state.body_position[k] - body.X_WO.p))
        speed = float(np.linalg.norm(state.body_linear[k]))
        joint = next((joint for joint in task.true.scene.joints if joint.child == body.name), None)
        if joint is not None:  # the origin of a link is on its hinge
            X_WO = Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k])
            shift = float(np.linalg.norm(X_WO.apply(body.centre) - body.X_WO.apply(body.centre)))
            speed = float(np.linalg.norm(state.body_linear[k] + np.cross(state.body_angular[k], X_WO.R @ body.centre)))
        if k in heaped:
            _check_heaped(task, body, heaped[k], state)
        elif not shift < SETTLED_SHIFT:
            why = "it overlaps another body, has no support, or was hit"
            if joint is not None:
                why = f"its weight, its spring or a contact moves joint '{joint.name}'; choose another `start`"
            raise SimulationFailed(
                f"'{body.name}' moved {1000 * shift:.1f} mm while settling, the limit is {1000 * SETTLED_SHIFT:g} mm: "
                f"{why}",
                time=0.0,
            )
        if not speed < SETTLED_SPEED:
            after = f" of {LONGEST:g} s" if k in heaped else ""
            raise SimulationFailed(
                f"'{body.name}' still moves at {speed:.3g} m/s after settling{after}, the limit is "
                f"{SETTLED_SPEED:g} m/s",
                time=0.0,
            )


def _hold(session: Session, duration: float) -> None:
    Executor(session).hold(duration)


def _heaped(task: Task) -> Iterator[tuple[int, BodySpec]]:
    """The bodies of a `count`, by index among the movable ones, each with what is written."""
    scene = task.spec.scene
    for k, body in enumerate(task.true.scene.movable):
        owner = group(body.name, scene)
        if owner is not None:
            yield k, scene[owner]


def _speeds(session: Session, bodies: dict[int, BodySpec]) -> list[float]:
    """[m/s] of these bodies."""
    linear = session.engine.read().body_linear
    return [float(np.linalg.norm(linear[k])) for k in bodies]


def _check_heaped(task: Task, body: Body, written: BodySpec, state: WorldState) -> None:
    """Raises SimulationFailed if a body of a `count` is not in its container, or is below what it rested on."""
    scene = task.true.scene
    movable = {each.name: k for k, each in enumerate(scene.movable)}

    def pose(each: Body) -> Transform:
        k = movable.get(each.name)
        return each.X_WO if k is None else Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k])

    around = scene.body(written.inside or written.rests_on or "")
    if written.inside is not None:
        lost, where = not contains(around, pose(around), body, pose(body)), "out of"
    else:
        lost, where = bottom(body, pose(body)) < top(around, pose(around)) - SETTLED_SHIFT, "off"
    if lost:
        x, y, z = pose(body).p
        raise SimulationFailed(
            f"'{body.name}' fell {where} '{around.name}' while settling, to [{x:.3f}, {y:.3f}, {z:.3f}] m", time=0.0
        )
