"""Which parts collide as joints are moved: as planning checks it, with the bodies of a task at their start."""

from __future__ import annotations

from html import escape

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.model.collision import CollisionChecker, CollisionHit
from manipcli.model.hand.words import gap_text
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene

GOOD, BAD, GAP = "#2b8a3e", "#e03131", "#9c36b5"
"""Colours of the text."""
MOST = 12
"""Pairs that are listed."""


class Collisions:
    """Collisions of a robot with itself and a scene.

    Args:
        robot: the robot; pairs under its `collision_ignore` may touch.
        scene: the scene; None: nothing but the robot.
    """

    def __init__(self, robot: RobotModel, scene: Scene | None) -> None:
        bodies = Scene((), (), np.array([0.0, 0.0, -9.81])) if scene is None else scene
        self._query = CollisionChecker(Kinematics(robot), bodies, ignore=robot.collision_ignore).at()

    def at(self, q: Array) -> tuple[CollisionHit, ...]:
        """Every pair of parts that overlaps at joint positions `q` (n), the deepest first."""
        if not self._query.touches(q):
            return ()
        return tuple(sorted(self._query.every(q), key=lambda hit: hit.distance))


def status_html(hits: tuple[CollisionHit, ...], gap: float | None) -> str:
    """Two lines, so that nothing below moves: whether parts overlap with the deepest pair, and the gap [m] if known."""
    first = number_of(len(hits), "collision") if hits else "no collision"
    second = _pair(hits[0]) if hits else "&nbsp;"
    if gap is not None:
        first += f' &middot; <span style="color: {GAP}">opening {gap_text(gap)} mm</span>'
    colour = BAD if hits else GOOD
    return f'<div style="padding: 0 0.8em 0.5em; color: {colour}">{first}<br><small>{second}</small></div>'


def list_html(hits: tuple[CollisionHit, ...]) -> str:
    """The pairs below the deepest one, with the depths of their overlaps."""
    lines = [_pair(hit) for hit in hits[1:MOST]]
    if len(hits) > MOST:
        lines.append(f"and {len(hits) - MOST} more")
    return f'<div style="padding: 0 0.8em; color: {BAD}"><small>{"<br>".join(lines)}</small></div>' if lines else ""


def _pair(hit: CollisionHit) -> str:
    a, b = (escape(part.removeprefix("robot/")) for part in (hit.a, hit.b))
    return f"{a} and {b}: {hit.amount}"
