"""What runs would refuse or ignore about a robot, found from its robot file alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.description.lint.rigid import box_about, too_heavy
from manipcli.model.collision import CollisionChecker, CollisionHit
from manipcli.model.configuration import configuration
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import CLOSE
from manipcli.preflight.hand_findings import hand_findings
from manipcli.scene.scene import Scene
from manipcli.simulate.engines import ENGINES
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec

_EMPTY = Scene(bodies=(), frames=(), gravity=np.zeros(3))


def robot_findings(file: Located[RobotSpec], robot: RobotModel) -> Iterator[Diagnostic]:
    """Warnings about what engines with physics refuse, heavy links and poses in collision; notes on ignored pairs."""
    yield from _refused(robot)
    yield from _heavy(file, robot)
    yield from _poses(file, robot)
    yield from hand_findings(file, robot)


def _refused(robot: RobotModel) -> Iterator[Diagnostic]:
    """What an engine with physics refuses about the robot; not what it refuses about a task or an installation."""
    refusals = [each.refuses(robot, _EMPTY, None) for each in ENGINES if each.physics == "full"]
    found = dict.fromkeys(finding for each in refusals for finding, at in each if at == ("robot",))
    for finding in found:
        yield replace(finding, severity="warning")


def _heavy(file: Located[RobotSpec], robot: RobotModel) -> Iterator[Diagnostic]:
    """A warning for every link that is too heavy for its size, as it is simulated."""
    for link in robot.links:
        shapes = link.collisions or link.visuals
        why = "" if link.inertial is None else too_heavy(link.inertial.mass, box_about(shapes) if shapes else None)
        if why and link.inertial is not None:
            message = f"link '{link.name}' has mass {digits(link.inertial.mass)} kg: {why}"
            hint = f"state its mass: `inertials: {{links: {{{link.name}: {{mass: ...}}}}}}`, or its density"
            mended = any(row.link == link.name for row in robot.inertials)
            place = file.place("inertials", "links", link.name) if mended else link.place
            yield Diagnostic("ROBOT359", message, place or file.place("description"), hint, "warning")


def _poses(file: Located[RobotSpec], robot: RobotModel) -> Iterator[Diagnostic]:
    """A warning for every pair of links that overlap in a named pose; other joints are as in `home`, if it exists.

    At the start, in `home` or with all joints at zero, also for links of the arm that are closer than plans keep them.
    Ignored: adjacent links, pairs that overlap with all joints at zero, and pairs of `collision_ignore`.
    """
    checker = CollisionChecker(Kinematics(robot), _EMPTY, ignore=robot.collision_ignore)
    for a, b in sorted(checker.spaced):
        message = f"links '{a}' and '{b}' are within {1000.0 * CLOSE:g} mm of each other with all joints at zero"
        message += ", with one link between them: they may touch"
        hint = f"to state it, add `collision_ignore: [[{a}, {b}]]`"
        yield Diagnostic("ROBOT348", message, file.place("description"), hint, "note")
    rest = configuration(robot)
    overlapping, near = checker.at(), checker.at(margin=CLOSE)
    for pose in robot.poses:
        for hit in overlapping.every(configuration(robot, pose.name, rest=rest)):
            change = "change the pose, or list the pair under `collision_ignore` if the links may touch"
            yield _finding(hit, f"pose '{pose.name}'", file, ("poses", pose.name), change)
    home = any(pose.name == "home" for pose in robot.poses)
    loc = ("poses", "home") if home else ("description",)
    fingers = _hands(robot)
    for hit in near.every(rest):
        if (home and hit.distance < 0.0) or fingers.intersection(_links(hit)):
            continue
        change = "change the pose" if home else "add a pose `home`, where tasks start"
        hint = f"{change}, or list the pair under `collision_ignore` if the real links are apart"
        yield _finding(hit, "pose 'home'" if home else "start with all joints at zero", file, loc, hint)


def _finding(hit: CollisionHit, where: str, file: Located[RobotSpec], loc: tuple[str, ...], hint: str) -> Diagnostic:
    a, b = _links(hit)
    how = f"overlap by {hit.amount}" if hit.distance < 0.0 else f"are {hit.amount} apart, plans keep 4 mm"
    message = f"{where}: links '{a}' and '{b}' {how}"
    return Diagnostic("ROBOT347", message, file.place(*loc), hint, "warning")


def _links(hit: CollisionHit) -> tuple[str, str]:
    return hit.a.removeprefix("robot/"), hit.b.removeprefix("robot/")


def _hands(robot: RobotModel) -> frozenset[str]:
    """The links below the joints of all groups but the first: those of hands may meet."""
    moved = {name for group in robot.groups[1:] for name in group.joints}
    children = [joint.child for joint in robot.moving_joints if joint.name in moved or joint.mimic is not None]
    return frozenset(link for child in children for link in robot.descendants(child))
