"""What the hand holds things with: how hard it pressed, and what friction can carry at that."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.units import readable
from manipcli.model.grasp import pressing
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.scene.scene import Scene

AMPLE = 3.0
"""Friction that carries this many times the weight is not what a held thing was lost for."""


class GraspMargin:
    """Remembers each grasp, to say why what was taken is no longer there.

    Args:
        robot, scene: the world as it is.
    """

    def __init__(self, robot: RobotModel, scene: Scene) -> None:
        self._robot = robot
        self._scene = scene
        self._pressed: dict[str, list[tuple[float, str]]] = {}

    def taken(self, body: str, contacts: Sequence[Contact]) -> None:
        """The hand has closed on a body, and touches this."""
        self._pressed[body] = pressing(contacts, body)

    def told(self, name: str) -> str:
        """The force N of the hand on a body at the grasp, the mu N that friction can carry, its weight m g, and the
        acceleration mu N / m - g that is left; where that is ample, the links that pressed.

        The friction of a contact is the product of the two surfaces', as in Bullet.
        """
        taken = self._pressed.get(name)
        if taken is None:
            return ""
        pressed = sum(force for force, _ in taken)
        body = self._scene.body(name)
        friction = body.friction * self._robot.friction
        weight = body.mass * float(np.linalg.norm(self._scene.gravity))
        grasp = f"the hand took it with {readable(pressed, 'N')}, of which friction {friction:.3g}"
        shares = f"({body.friction:.3g} x {self._robot.friction:.3g} of the hand)"
        told = f"{grasp} {shares} carries {readable(friction * pressed, 'N')}; it alone weighs {readable(weight, 'N')}"
        if friction * pressed > AMPLE * weight:
            by = ", ".join(f"{link.partition('/')[2]} ({readable(force, 'N')})" for force, link in taken)
            return f"{told}: enough force, so look at where it was held, by {by}"
        left = (friction * pressed - weight) / body.mass
        return told if left <= 0.0 else f"{told}, which leaves {left:.2g} m/s2 to accelerate it with"
