"""Fingers of a hand that touch nothing, or that count as their convex hulls though they are concave."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import listed
from manipcli.model.robot import RobotModel
from manipcli.plan.grasp_contacts import finger_links
from manipcli.shapes.convex_parts import concave
from manipcli.shapes.primitives import Geometry, Mesh
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec

HOLLOW: Final = 0.75
"""A finger that fills less than this share of its convex hull is worth splitting: published ones often fill 0.85."""


def hand_joints(robot: RobotModel) -> tuple[str, ...]:
    """The joints that the poses `open` and `closed` set."""
    posed = [pose.joints for pose in robot.poses if pose.name in ("open", "closed")]
    return tuple(dict.fromkeys(name for joints in posed for name in joints))


def hand_findings(file: Located[RobotSpec], robot: RobotModel) -> Iterator[Diagnostic]:
    """A warning for every finger without a collision shape, and a note about concave collision meshes of fingers."""
    joints = hand_joints(robot)
    links = {link.name: link for link in robot.links}
    fingers = [sorted(finger) for finger in finger_links(robot, joints)]
    bare = [finger for finger in fingers if not any(links[name].collisions for name in finger)]
    if bare:
        names = listed([name for finger in bare for name in finger])
        what = "the hand has no collision shapes and touches"
        if len(bare) < len(fingers):
            what = f"{len(bare)} of {len(fingers)} fingers have no collision shapes and touch"
        message = f"{what} nothing: {names}"
        seen = any(links[name].visuals for finger in bare for name in finger)
        hint = "add `collision: from_visual` to use its visual shapes"
        yield Diagnostic(
            "ROBOT349",
            message,
            file.place("description"),
            hint if seen else "add <collision> shapes to the description",
            "warning",
        )
    hollow = [name for name in sorted({*chain(*fingers)}) if any(map(_hollow, links[name].collisions))]
    if hollow:
        message = f"the collision meshes of {listed(hollow)} are concave and count as their convex hulls: "
        message += "what a jaw seems to enclose, it overlaps"
        hint = f"add `collision_parts: [{', '.join(hollow)}]` to split them into convex parts"
        yield Diagnostic("ROBOT358", message, file.place("description"), hint, "note")


def _hollow(geometry: Geometry) -> bool:
    shape = geometry.shape
    return isinstance(shape, Mesh) and shape.part is None and concave(shape.path, HOLLOW)
