"""The object that a map moves: its place in the task file, and the overrides that put it elsewhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Array, frozen
from manipcli.core.text import did_you_mean
from manipcli.scene.scene import SEPARATOR, Body
from manipcli.spec.counted import group
from manipcli.task.task import Task

HALF_SIDE = 0.3
"""[m] Half the side of the square around an object whose support is not known or has no edge."""
LARGEST = 3.0
"""[m] A larger support has no edge within reach."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where an object is in the task file.

    Attributes:
        body: its name in the file.
        key: `at`, or `pose` where the file has one.
        frame: what x and y refer to, in words; "" for the world.
        at: x, y [m] in the file.
        z: [m] of a `pose`.
        rpy: roll, pitch, yaw [rad] of a `pose`; of an `at` only the yaw.
        origin: (2,) [m] of the frame in the world.
        turned: [rad] yaw of the frame in the world.
    """

    body: str
    key: str
    frame: str
    at: tuple[float, float]
    z: float
    rpy: tuple[float, float, float]
    origin: Array
    turned: float

    def overrides(self, x: float, y: float, yaw: float | None) -> tuple[str, ...]:
        """What puts the object there, as after `--set`; `yaw` None: that of the file."""
        where = f"scene.{self.body}"
        if self.key == "at":
            turned = () if yaw is None else (f"{where}.yaw={yaw!r}",)
            return (f"{where}.at=[{x!r}, {y!r}]", *turned)
        rotation = "" if yaw is None else f", rpy: [{self.rpy[0]!r}, {self.rpy[1]!r}, {yaw!r}]"
        if yaw is None:
            return (f"{where}.pose.xyz=[{x!r}, {y!r}, {self.z!r}]",)
        return (f"{where}.pose={{xyz: [{x!r}, {y!r}, {self.z!r}]{rotation}}}",)

    def from_world(self, points: Array) -> Array:
        """Points (k, 2) [m] of the world as x, y of the file."""
        c, s = math.cos(self.turned), math.sin(self.turned)
        turned: Array = (points - self.origin) @ np.array([[c, -s], [s, c]])
        return turned

    def surface(self, task: Task) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lower and upper x, and lower and upper y [m], of what the object rests on or is inside of.

        Without an edge within reach (the floor, a `pose`), of a square around the object.
        """
        spec = task.spec.scene[self.body]
        support = spec.rests_on or spec.inside
        bodies = {body.name: body for body in task.true.scene.bodies}
        if self.key == "at" and support in bodies and max(bodies[support].size[:2]) <= LARGEST:
            corners = self.from_world(outline(bodies[support]))
        else:
            corners = np.array(self.at) + np.array([[-HALF_SIDE, -HALF_SIDE], [HALF_SIDE, HALF_SIDE]])
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return (x0, x1), (y0, y1)


def placement_of(task: Task, name: str) -> Placement:
    """The placement of a body; of a member of a `count` that of all, of a link that a joint moves that of the whole.

    Raises:
        InvalidInput: there is no such body, or it has no place of its own.
    """
    scene = task.spec.scene
    root = name.partition(SEPARATOR)[0]
    owner = group(root, scene) or root
    if owner not in scene:
        hint = did_you_mean(name, scene, kind="bodies")
        raise InvalidInput([Diagnostic("USE196", f"the scene of task '{task.name}' has no body '{name}'", hint=hint)])
    spec = scene[owner]
    if spec.count is not None and spec.inside is not None:
        message = f"the place of each '{owner}' follows from its container '{spec.inside}'"
        raise InvalidInput([Diagnostic("USE196", message, hint=f"move the container: --object {spec.inside}")])
    own = [body for body in task.true.scene.bodies if body.name == owner or group(body.name, scene) == owner]
    X_WO, p = own[0].X_WO, np.mean([body.X_WO.p[:2] for body in own], axis=0)
    if spec.pose is not None:
        X_FO = spec.pose.transform
        at, z, rpy = (float(X_FO.p[0]), float(X_FO.p[1])), float(X_FO.p[2]), tuple(float(v) for v in X_FO.rpy)
    else:
        at, z, rpy = spec.at or (0.0, 0.0), 0.0, (0.0, 0.0, spec.yaw)
    turned = float(X_WO.rpy[2]) - rpy[2]
    c, s = math.cos(turned), math.sin(turned)
    frame = f"'{spec.inside}'" if spec.inside else "" if spec.frame in (None, "world") else f"'{spec.frame}'"
    return Placement(
        body=owner,
        key="at" if spec.pose is None else "pose",
        frame=frame,
        at=at,
        z=z,
        rpy=(rpy[0], rpy[1], rpy[2]),
        origin=frozen(p - np.array([[c, -s], [s, c]]) @ np.array(at)),
        turned=turned,
    )


def outline(body: Body) -> Array:
    """Corners (4, 2) [m] in the world of the bounding box of a body, seen from above."""
    half = body.size / 2.0
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = [body.centre + np.array([sx * half[0], sy * half[1], 0.0]) for sx, sy in signs]
    return frozen([body.X_WO.apply(corner)[:2] for corner in corners])


def object_of(task: Task, index: int, step: str, named: str | None) -> str:
    """The object that a step acts on, or the one that is `named`.

    Raises:
        InvalidInput: the step acts on no object.
    """
    found = named or getattr(task.spec.steps[index].body, "object", None)
    if not isinstance(found, str):
        known: Sequence[str] = [name for name, body in task.spec.scene.items() if not body.fixed]
        message = f"step '{step}' acts on no object, so that there is nothing to move"
        hint = f"name it: --object {known[0]}" if known else "the scene has no movable body"
        raise InvalidInput([Diagnostic("USE196", message, task.file.place("steps", index), hint)])
    return found
