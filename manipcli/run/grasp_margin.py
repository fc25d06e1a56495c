"""Grasp margin: the grip force at a grasp, and the load that friction can carry with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.units import readable
from manipcli.model.grasp import friction_coefficient, friction_load, pressing
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.scene.scene import Scene

AMPLE = 3.0
"""Ratio of friction to weight above which the grip force is not the cause of a lost object."""


class GraspMargin:
    """Stores the contact forces of each grasp, to explain a lost object.

    Args:
        robot, scene: the true world.
    """

    def __init__(self, robot: RobotModel, scene: Scene) -> None:
        self._robot = robot
        self._scene = scene
        self._pressed: dict[str, list[tuple[float, str]]] = {}

    def taken(self, body: str, contacts: Sequence[Contact]) -> None:
        """Store the contacts at the end of a grasp of a body."""
        self._pressed[body] = pressing(contacts, body)

    def spare(self, name: str) -> float | None:
        """[N] By how much friction at the grasp carries more than the weight; None for a body that was not grasped."""
        taken = self._pressed.get(name)
        if taken is None:
            return None
        body = self._scene.body(name)
        carried = friction_load(friction_coefficient(self._robot, body), (force for force, _ in taken))
        return carried - body.mass * float(np.linalg.norm(self._scene.gravity))

    def summary(self, name: str) -> str:
        """The grip force N at the grasp, its friction limit mu N, the weight m g, and the acceleration mu N / m - g.

        If friction is ample, the links in contact instead of the acceleration. The friction coefficient mu of a contact
        is the product of those of the two surfaces, as in Bullet. "" for a body that was not grasped.
        """
        taken = self._pressed.get(name)
        if taken is None:
            return ""
        pressed = sum(force for force, _ in taken)
        body = self._scene.body(name)
        friction = friction_coefficient(self._robot, body)
        carried = friction_load(friction, (force for force, _ in taken))
        weight = body.mass * float(np.linalg.norm(self._scene.gravity))
        grasp = f"grip force {readable(pressed, 'N')}: friction {friction:.3g}"
        shares = f"('{name}' {body.friction:.3g} x hand {self._robot.friction:.3g})"
        text = f"{grasp} {shares} carries {readable(carried, 'N')}, its weight is {readable(weight, 'N')}"
        if carried > AMPLE * weight:
            by = ", ".join(f"{link.partition('/')[2]} ({readable(force, 'N')})" for force, link in taken)
            return f"{text}; the force is sufficient, check the contact points: {by}"
        left = (carried - weight) / body.mass
        return text if left <= 0.0 else f"{text}; maximum lift acceleration before slip: {left:.2g} m/s2"
