"""Parts that touch, as files name them: a body, `robot` (any of its links), `robot/LINK`."""

from __future__ import annotations

from manipcli.conditions.condition import CheckContext, Problem
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.model.batch_kinematics import still_links
from manipcli.model.state import Contact

ROBOT = "robot"


def between(pair: tuple[str, str], contact: Contact) -> bool:
    """Whether the contact is one of the two with each other."""
    first, second = pair
    a, b = contact.a, contact.b
    return (is_part(first, a) and is_part(second, b)) or (is_part(first, b) and is_part(second, a))


def is_part(written: str, part: str) -> bool:
    """Whether `part` of a contact is what was written, or one of its links."""
    return written == part or (written == ROBOT and part.startswith(f"{ROBOT}/"))


def unknown_part(context: CheckContext, name: str, loc: Loc) -> tuple[Problem, ...]:
    """Empty if `name` is a body, the robot, or one of its links."""
    bodies = tuple(body.name for body in context.scene.bodies)
    links = tuple(f"{ROBOT}/{link.name}" for link in context.robot.links)
    if name == ROBOT or name in bodies or name in links:
        return ()
    message = f"'{name}' is neither a body of the scene nor a part of the robot"
    if f"{ROBOT}/{name}" in links:
        return (Problem(loc, message, f"links are written with the robot: '{ROBOT}/{name}'"),)
    known = links if name.startswith(f"{ROBOT}/") else (ROBOT, *bodies)
    return (Problem(loc, message, did_you_mean(name, known)),)


def impossible_pair(context: CheckContext, pair: tuple[str, str], loc: Loc) -> tuple[Problem, ...]:
    """Empty if both parts exist and the simulation lets them touch each other."""
    unknown = tuple(found for k, name in enumerate(pair) for found in unknown_part(context, name, (*loc, k)))
    if unknown:
        return unknown
    if all(name.partition("/")[0] == ROBOT for name in pair):
        message = "the robot does not collide with itself in the simulation, so nothing can be said of that"
        return (Problem(loc, message, "leave the pair out: the planner keeps the robot off itself"),)
    if pair[0] == pair[1]:
        return (Problem(loc, f"'{pair[0]}' cannot touch itself"),)
    fixed = {body.name for body in context.scene.bodies if body.fixed}
    fixed |= {f"{ROBOT}/{link}" for link in still_links(context.robot)}
    if fixed.issuperset(pair):
        return (Problem(loc, f"'{pair[0]}' and '{pair[1]}' are both fixed, so nothing can be said of their contact"),)
    return ()
