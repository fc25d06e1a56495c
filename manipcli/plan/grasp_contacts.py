"""Contacts of a planned grasp: where the closed fingers and the palm touch the object, and how hard they can press."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import ROBOT, Planner
from manipcli.shapes.primitives import Shape
from manipcli.shapes.proximity import coal_shape, contact_patch

if TYPE_CHECKING:
    from manipcli.shapes.proximity import CollisionGeometry

MARGIN: Final = 1e-3
"""[m] Parts nearer than this touch: the predicted fingers stop at a step of the closing hand."""
POINTS: Final = 6
"""Maximum number of contact points of a link, those furthest apart."""
PALM: Final = -1
"""The index of what is no finger."""


class GraspContact(NamedTuple):
    """A point of contact.

    Attributes:
        point: (3,) [m] in the world.
        normal: (3,) unit vector in the world, into the object.
        link: that touches.
        finger: its index in `finger_links`, or `PALM`.
    """

    point: Array
    normal: Array
    link: str
    finger: int


def grasp_contacts(planner: Planner, state: PlanningState, joints: tuple[str, ...]) -> tuple[GraspContact, ...]:
    """Contacts of the carried object with the hand as predicted; none where nothing is carried.

    Args:
        planner, state: the robot with the object in its hand.
        joints: of the hand.
    """
    if state.carried is None:
        return ()
    robot, body = planner.robot, planner.scene.body(state.carried.body)
    X_WO = planner.body_pose(state, body.name)
    touching = {
        name.removeprefix(ROBOT)
        for hit in planner.grasping(state, body.name, margin=MARGIN).every(state.position)
        for name in (hit.a, hit.b)
    }
    finger_of = {link: k for k, links in enumerate(finger_links(robot, joints)) for link in links}
    found: list[GraspContact] = []
    for link in robot.links:
        if link.name not in touching:
            continue
        X_WL = planner.kinematics.forward(state.position, link.name)
        own: list[tuple[Array, Array]] = []
        for part in link.collisions:
            for shape in body.geometries:
                patch = contact_patch(
                    _shape(part.shape), X_WL @ part.X_LS, _shape(shape.shape), X_WO @ shape.X_LS, margin=MARGIN
                )
                if patch is not None:
                    own += [(point, patch[1]) for point in patch[0]]
        finger = finger_of.get(link.name, PALM)
        found += [GraspContact(point, normal, link.name, finger) for point, normal in _spread(own)]
    return tuple(found)


def finger_links(robot: RobotModel, joints: Sequence[str]) -> tuple[frozenset[str], ...]:
    """The links of each finger of a hand; a finger that mimics another's joint is one of its own."""
    driven = {*joints, *(joint.name for joint in robot.joints if joint.mimic and joint.mimic.joint in joints)}
    moved = {joint.name: robot.descendants(joint.child) for joint in robot.joints if joint.name in driven}
    return tuple(
        links for links in moved.values() if not any(links < others for others in moved.values())
    )  # of a chain of joints, all links below its first


def _spread(contacts: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """At most `POINTS` of the contacts, each the furthest from those before it."""
    if len(contacts) <= POINTS:
        return contacts
    points = np.array([point for point, _ in contacts])
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    while len(chosen) < POINTS:
        away = np.linalg.norm(points[:, None] - points[chosen], axis=2).min(axis=1)
        chosen.append(int(np.argmax(away)))
    return [contacts[k] for k in chosen]


@functools.lru_cache(maxsize=256)
def _shape(shape: Shape) -> CollisionGeometry:
    return coal_shape(shape)
