"""Playback of several robots of one log: one drawing, with the namespaces before their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.text import listed
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.description.urdf.urdf import Parts
from manipcli.model.build_robot import bare_robot
from manipcli.model.robot import RobotModel
from manipcli.replay.playback import Playback
from manipcli.scene.scene import Body, Scene

BASE = "robots"
"""Link that carries the robots, at the origin of the world."""


def together(name: str, parts: Mapping[str, Playback]) -> Playback:
    """One playback of all robots.

    Args:
        name: of the playback.
        parts: the playback of each namespace (`/r1`), all at the same times.
    """
    first = next(iter(parts.values()))
    robots = {_prefix(space): part.robot for space, part in parts.items() if part.robot is not None}
    # Columns are those of the drawn robots; without any, of all joints.
    shown = {space: part for space, part in parts.items() if not robots or part.robot is not None}
    bodies: list[Body] = []
    for space, part in parts.items():
        for body in part.scene.bodies if part.scene is not None else ():
            bodies.append(replace(body, name=_prefix(space) + body.name))
    notes = [f"{len(parts)} robots in the log: {listed(parts)}; --robot {next(iter(parts))} shows one alone"]
    common = set.intersection(*(set(part.notes) for part in parts.values()))
    notes += [note for note in first.notes if note in common]
    notes += [f"{space}: {note}" for space, part in parts.items() for note in part.notes if note not in common]

    bases = {robot.X_WB.matrix.tobytes() for robot in robots.values()}
    if len(robots) > 1 and len(bases) == 1:
        notes.append(f"{listed(parts)} are drawn at one place: the log does not say where each base is")
    return replace(
        first,
        name=name,
        robot=_one_robot(robots) if robots else None,
        scene=Scene(tuple(bodies), (), frozen([0.0, 0.0, 0.0])),
        joint_names=tuple(_prefix(space) + joint for space, part in shown.items() for joint in part.joint_names),
        position=_beside([part.position for part in shown.values()]),
        velocity=_beside([part.velocity for part in shown.values()]),
        effort=_beside([part.effort for part in shown.values()]),
        reference=_beside([part.reference for part in shown.values()]),
        body_position=_beside([part.body_position for part in parts.values()]),
        body_quat_xyzw=_beside([part.body_quat_xyzw for part in parts.values()]),
        notes=tuple(notes),
        keep=tuple(part.keep for part in parts.values()),
    )


def _beside(columns: Sequence[Array]) -> Array:
    return frozen(np.concatenate(columns, axis=1))


def _prefix(space: str) -> str:
    return f"{space.strip('/')}/"


def _one_robot(robots: Mapping[str, RobotModel]) -> RobotModel:
    """The robots on one link, each at its base pose, their names with prefixes."""
    links, joints = [Link(BASE, None, (), ())], list[Joint]()
    for prefix, robot in robots.items():
        links += [replace(link, name=prefix + link.name) for link in robot.links]
        joints.append(
            Joint(
                prefix + BASE, "fixed", BASE, prefix + robot.root, robot.X_WB, np.array([1.0, 0.0, 0.0]), JointLimits()
            )
        )
        joints += [
            replace(
                joint,
                name=prefix + joint.name,
                parent=prefix + joint.parent,
                child=prefix + joint.child,
                mimic=None if joint.mimic is None else replace(joint.mimic, joint=prefix + joint.mimic.joint),
            )
            for joint in robot.joints
        ]
    name = " and ".join(robot.name for robot in robots.values())
    merged = bare_robot(Parts(name, BASE, tuple(links), tuple(joints), (), ()))
    return replace(merged, X_WB=Transform.identity())
