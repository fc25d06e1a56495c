"""Bodies that fall or topple before the first step: nothing is below them, or below their centre of mass.

Geometry at the start alone: a body that falls further than settling allows is refused by the run. It topples where its
centre of mass is beyond the area in which it touches what is below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.geometry import Array, Transform
from manipcli.core.text import escape
from manipcli.core.units import readable
from manipcli.model.kinematics import Kinematics
from manipcli.preflight.preflight import Check, Subject
from manipcli.scene.drop_test import SETTLED_SHIFT, bottom, drop_height, top
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box
from manipcli.shapes.proximity import coal_shape, contact_patch, distance
from manipcli.task.plan_task import start_position
from manipcli.task.task import Task

NEAR: Final = 1e-3
"""[m] Gap below which two parts touch."""
LEVEL: Final = 0.9
"""Least vertical part of the normal of a contact that carries a body from below."""
BEYOND: Final = 2e-3
"""[m] A centre of mass less far beyond the area of support may be rounding."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """TASK330: bodies in the air. TASK331: bodies whose centre of mass is not above what carries them."""
    task = subject.task
    scene, settle = task.true.scene, task.spec.simulation.settle
    falls = -0.5 * float(scene.gravity[2]) * settle**2
    if falls <= SETTLED_SHIFT or np.any(scene.gravity[:2] != 0.0):
        return
    for body in scene.movable:
        written = task.spec.scene.get(body.name)
        if written is None:
            continue
        fall = _fall(body, scene, written.rests_on or written.inside or "")
        if (fall is None or fall > NEAR) and _held(body, task):
            continue
        if fall is None or fall > SETTLED_SHIFT:
            how = "with nothing below it" if fall is None else f"{readable(fall, 'm')} above what is below it"
            message = f"'{escape(body.name)}' starts in the air, {how}"
            hint = "place it with `rests_on: BODY` and `at: [x, y]`, lower its pose, or write `fixed: true`"
            place = task.file.place("scene", body.name, "pose" if written.pose is not None else "at")
            yield Diagnostic("TASK330", message, place, hint)
        elif (beyond := _beyond(body, scene, fall)) > BEYOND:
            message = f"'{escape(body.name)}' topples at the start: its centre of mass is "
            message += f"{readable(beyond, 'm')} beyond the area on which it stands"
            hint = "move it further onto what carries it"
            place = task.file.place("scene", body.name, "pose" if written.pose is not None else "at")
            yield Diagnostic("TASK331", message, place, hint, "warning")


def _fall(body: Body, scene: Scene, support: str) -> float | None:
    """[m] until the body touches another one below it, `support` first; None: there is none."""
    least: float | None = None
    for other in sorted(scene.bodies, key=lambda other: other.name != support):
        if other.name == body.name or not _below(body, other):
            continue
        fall = drop_height(body, body.X_WO, other, other.X_WO)
        if fall is not None and (least is None or fall < least):
            least = fall
        if least is not None and least <= NEAR:
            break
    return least


def _below(body: Body, other: Body) -> bool:
    """Whether the bounding boxes overlap, seen from above, and the other body does not begin above this one."""
    (low, high), (its_low, its_high) = (_seen_from_above(each) for each in (body, other))
    return bool(np.all(low <= its_high) and np.all(its_low <= high)) and bottom(other, other.X_WO) < top(
        body, body.X_WO
    )


def _seen_from_above(body: Body) -> tuple[Array, Array]:
    """(2) least and greatest x and y [m] of the bounding box in the world."""
    half = np.abs(body.X_WO.R[:2]) @ body.size / 2.0
    middle = body.X_WO.apply(body.centre)[:2]
    return middle - half, middle + half


def _beyond(body: Body, scene: Scene, fall: float) -> float:
    """[m] from the area in which the body is carried to its centre of mass, seen from above.

    0 where it is inside, where something beside the body touches it, which may hold it, and where a shape that touches
    is not a box: the area of contact of others is not known exactly.
    """
    X_WB = Transform.of(xyz=(0.0, 0.0, -fall)) @ body.X_WO
    corners: list[Array] = []
    for other in scene.bodies:
        if other.name == body.name or not _below(body, other):
            continue
        for a in body.geometries:
            for b in other.geometries:
                shapes = coal_shape(a.shape), coal_shape(b.shape)
                patch = contact_patch(shapes[0], X_WB @ a.X_LS, shapes[1], other.X_WO @ b.X_LS, margin=NEAR)
                if patch is None:
                    continue
                points, normal = patch
                if abs(normal[2]) < LEVEL or not (isinstance(a.shape, Box) and isinstance(b.shape, Box)):
                    return 0.0
                corners += [point[:2] for point in points]
    centre = (X_WB @ body.X_OI).p[:2]
    return _distance(centre, np.array(corners)) if corners else 0.0


def _distance(point: Array, corners: Array) -> float:
    """[m] from a point (2) to the convex hull of the corners (k, 2); 0 inside.

    The greatest, over directions, of the distance by which the point is beyond all corners.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return max(0.0, float(np.max(directions @ point - np.max(directions @ corners.T, axis=1))))


def _held(body: Body, task: Task) -> bool:
    """Whether the robot touches the body at the start, and may hold it."""
    kinematics, q = Kinematics(task.true.robot), start_position(task)
    for link in task.true.robot.links:
        X_WL = kinematics.forward(q, link.name)
        for a in link.collisions:
            for b in body.geometries:
                gap = distance(coal_shape(a.shape), X_WL @ a.X_LS, coal_shape(b.shape), body.X_WO @ b.X_LS).distance
                if gap < NEAR:
                    return True
    return False


CHECK = Check(name="unsupported", codes=("TASK330", "TASK331"), findings=findings)
