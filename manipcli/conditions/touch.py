"""Parts of a contact as YAML files name them: a body, `robot` (any of its links), `robot/LINK`."""

from __future__ import annotations

from manipcli.conditions.condition import CheckContext, Problem
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.model.batch_kinematics import still_links
from manipcli.model.state import Contact

ROBOT = "robot"


def between(pair: tuple[str, str], contact: Contact) -> bool:
    """Whether the contact is between the two parts of the pair."""
    first, second = pair
    a, b = contact.a, contact.b
    return (is_part(first, a) and is_part(second, b)) or (is_part(first, b) and is_part(second, a))


def is_part(written: str, part: str) -> bool:
    """Whether `part` of a contact is the written part, or one of its links."""
    return written == part or (written == ROBOT and part.startswith(f"{ROBOT}/"))


def unknown_part(context: CheckContext, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if `name` is not a body, the robot, or one of its links."""
    bodies = tuple(body.name for body in context.scene.bodies)
    links = tuple(f"{ROBOT}/{link.name}" for link in context.robot.links)
    if name == ROBOT or name in bodies or name in links:
        return ()
    message = f"'{name}' is not a body of the scene or a part of the robot"
    if f"{ROBOT}/{name}" in links:
        return (Problem(loc, message, f"name a link with its robot: '{ROBOT}/{name}'"),)
    known = links if name.startswith(f"{ROBOT}/") else (ROBOT, *bodies)
    return (Problem(loc, message, did_you_mean(name, known)),)


def impossible_pair(context: CheckContext, pair: tuple[str, str], loc: Loc) -> tuple[Problem, ...]:
    """Problems if a part does not exist, or if the simulation has no contacts between the two."""
    unknown = tuple(p for k, name in enumerate(pair) for p in unknown_part(context, name, (*loc, k)))
    if unknown:
        return unknown
    if pair[0] == pair[1] != ROBOT:
        return (Problem(loc, f"'{pair[0]}' cannot touch itself"),)
    if all(name.partition("/")[0] == ROBOT for name in pair):
        return _apart(context, pair, loc)
    fixed = {body.name for body in context.scene.bodies if body.fixed}
    fixed |= {f"{ROBOT}/{link}" for link in still_links(context.robot)}
    if fixed.issuperset(pair):
        return (
            Problem(loc, f"'{pair[0]}' and '{pair[1]}' are both fixed: the engine reports no contact between them"),
        )
    return ()


def _apart(context: CheckContext, pair: tuple[str, str], loc: Loc) -> tuple[Problem, ...]:
    """A problem if no links of two parts of the robot collide in the simulation."""
    from manipcli.model.self_collision import checked_pairs

    if not context.self_collision:
        message = "two links of the robot never touch: the task has `simulation: {self_collision: false}`"
        return (Problem(loc, message, "remove the pair, or `self_collision: false`"),)
    links = [Contact(f"{ROBOT}/{a}", f"{ROBOT}/{b}", 0.0, 0.0) for a, b in checked_pairs(context.robot)]
    if any(between(pair, contact) for contact in links):
        return ()
    message = f"'{pair[0]}' and '{pair[1]}' never touch in the simulation: they have no pair of links that is checked"
    return (Problem(loc, message, "`manipcli check ROBOT.yaml --collisions` shows all pairs, and which are checked"),)
