"""What moves with a body: its contents; with a link of a jointed thing, the links and the loads on it as well."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.model.collision import Pair
from manipcli.scene.joints import carried_by
from manipcli.scene.scene import Body, Scene

Contents = Callable[[str], tuple[str, ...]]
"""The movable bodies in a container."""
Touching = Callable[[str], Set[Pair]]
"""The pairs of a movable body with what it touches."""


def aboard(
    scene: Scene, body: str, bodies: Sequence[Transform], contents: Contents, touching: Touching
) -> tuple[str, ...]:
    """The movable bodies that move with a body, in the order of the scene.

    With a body that no joint moves, these are its contents. With a link of a jointed thing they are also the links
    below it, with their contents, and what rests on all these alone: what touches nothing else but them.

    Args:
        scene: the scene.
        body: that moves.
        bodies: X_WO of the movable bodies.
        contents, touching: see there.
    """
    if not any(joint.child == body for joint in scene.joints):
        return contents(body)
    moving = {body, *carried_by(scene.joints, body)}
    moving |= {name for link in tuple(moving) for name in contents(link)}
    jointed = {joint.child for joint in scene.joints}
    poses = {each.name: X_WO for each, X_WO in zip(scene.movable, bodies, strict=True)}
    others = [each for each in scene.movable if each.name not in moving | jointed]
    while riders := {each.name for each in others if _rests(scene, each, poses, moving, touching)}:
        moving |= riders
        others = [each for each in others if each.name not in riders]
    return tuple(each.name for each in scene.movable if each.name in moving and each.name != body)


def _rests(scene: Scene, body: Body, poses: dict[str, Transform], moving: Set[str], touching: Touching) -> bool:
    """Whether a body touches some of the moving ones, and nothing else."""
    if not any(_near(body, poses[body.name], scene.body(name), poses[name]) for name in moving):
        return False
    met = {name for pair in touching(body.name) if body.name in pair for name in pair} - {body.name}
    return bool(met) and met <= moving


def _near(a: Body, X_WA: Transform, b: Body, X_WB: Transform) -> bool:
    """Whether the balls about the bounding boxes of two bodies overlap."""
    apart = float(np.linalg.norm(X_WA.apply(a.centre) - X_WB.apply(b.centre)))
    return apart <= (float(np.linalg.norm(a.size)) + float(np.linalg.norm(b.size))) / 2.0 + 0.01
