"""Checks of collision shapes: missing or overlapping."""

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.rigid import elements_by_name, moved_bodies
from manipcli.description.lint.samples import CUBE, INERTIAL, LIMIT, another, one_joint
from manipcli.description.lint.zero_overlap import overlaps_at_zero


@check(
    "URDF300", "no-collision", "readiness", "warning", bad=one_joint(tip=INERTIAL + CUBE.replace("collision", "visual"))
)
def _no_collision(subject: Subject) -> Iterator[Diagnostic]:
    """A moving link has a visual but no collision shape.

    The link passes through everything, in planning and in simulation.
    """
    # Of each rigid group: the links with visuals only; in a group without shapes, the joint's child if it has mass.
    links = elements_by_name(subject.description.root, "link")
    for joint, body in moved_bodies(subject.parts):
        elements = [(name, links[name]) for name in body if name in links]
        solid = any(element.first("collision") is not None for _, element in elements)
        seen = [name for name, element in elements if element.first("visual") and not element.first("collision")]
        if not seen and not solid and joint.child in links and links[joint.child].first("inertial") is not None:
            seen = [joint.child]
        for name in seen:
            message = f"link '{name}' has no <collision> and is moved by joint '{joint.name}'"
            yield Diagnostic("URDF300", message, links[name].place, "add a box or a cylinder", "warning")


@check(
    "URDF333",
    "self-collision",
    "readiness",
    "warning",
    bad=one_joint(
        more=another(link=INERTIAL + CUBE)
        + f'<link name="last">{INERTIAL}{CUBE}</link><joint name="l" type="revolute"><origin xyz="0 0 -0.9"/>'
        + f'<parent link="other"/><child link="last"/>{LIMIT}</joint>'
    ),
)
def _self_collision(subject: Subject) -> Iterator[Diagnostic]:
    """Links that are not neighbours overlap with all joints at zero.

    The cause is often a misplaced or oversized shape. Planning then ignores collisions of the pair in every
    configuration.
    """
    links = elements_by_name(subject.description.root, "link")
    for a, b, depth in overlaps_at_zero(subject.parts):
        message = f"links '{a}' and '{b}' overlap (their hulls by {depth * 1000.0:.1f} mm) with all joints at zero"
        hint = "check their <origin> and sizes, or list the pair under collision_ignore in the robot file"
        yield Diagnostic("URDF333", message, links[a].place if a in links else None, hint, "warning")
