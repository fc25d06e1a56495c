"""Checks of axes, limits and mimics of joints."""

from collections.abc import Iterator
from math import radians
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.rigid import elements_by_name
from manipcli.description.lint.samples import LIMIT, another, one_joint
from manipcli.description.urdf.numbers import finite

MANY_TURNS: Final = 20.0
"""[rad]: more than three revolutions."""
FAR_SLIDE: Final = 20.0
"""[m]"""
MIMIC_TOLERANCE: Final = 0.02
"""Share of the range: descriptions round their numbers."""
MAX_JOINTS: Final = 127
"""Moving and fixed joints; beyond it PyBullet's `getJointState` fails, with thousands the process crashes."""


@check(
    "URDF104", "fixed-axis", "physics", "warning", bad=one_joint('<axis xyz="0 0 1"/><mimic joint="k"/>', kind="fixed")
)
def _fixed_axis(subject: Subject) -> Iterator[Diagnostic]:
    """A fixed joint has an axis or a mimic.

    They have no effect. Usually the joint was a moving one before; a joint that should follow another does not move.
    """
    for joint in subject.description.root.all("joint"):
        if joint.attributes.get("type") != "fixed":
            continue
        name = joint.attributes.get("name", "")
        axis, mimic = joint.first("axis"), joint.first("mimic")
        if axis is not None:
            message = f"the axis of joint '{name}' has no effect: the joint is fixed"
            yield Diagnostic("URDF104", message, axis.place, None, "note")
        if mimic is not None:
            leader = mimic.attributes.get("joint", "")
            message = f"the <mimic> of '{leader}' at joint '{name}' has no effect: the joint is fixed"
            yield Diagnostic("URDF104", message, mimic.place, "change the joint type, or delete <mimic>", "warning")


@check("URDF105", "default-axis", "physics", "note", bad=one_joint())
def _default_axis(subject: Subject) -> Iterator[Diagnostic]:
    """A moving joint has no axis; x is used.

    x is the default of URDF. If z was meant, the mistake shows only when the robot moves.
    """
    for joint in subject.description.root.all("joint"):
        axis = joint.first("axis")
        if joint.attributes.get("type") in ("revolute", "continuous", "prismatic") and (
            axis is None or "xyz" not in axis.attributes
        ):
            message = f"joint '{joint.attributes.get('name', '')}' has no axis; x is used"
            yield Diagnostic("URDF105", message, joint.place, '<axis xyz="..."/>', "note")


@check("URDF106", "continuous-limits", "physics", "note", bad=one_joint(kind="continuous"))
def _continuous_limits(subject: Subject) -> Iterator[Diagnostic]:
    """A continuous joint has lower and upper limits.

    They are ignored: a joint with limits is revolute.
    """
    for joint in subject.description.root.all("joint"):
        limit = joint.first("limit")
        if limit is None or joint.attributes.get("type") != "continuous":
            continue
        stated = [
            key for key in ("lower", "upper") if finite(limit.attributes.get(key, "0").strip()) not in (0.0, None)
        ]
        if stated:
            shown = " and ".join(f"{key}={limit.attributes[key].strip()}" for key in stated)
            message = f"joint '{joint.attributes.get('name', '')}' is continuous: {shown} is ignored"
            yield Diagnostic("URDF106", message, limit.place, 'if the limits are meant, use type="revolute"', "note")


@check(
    "URDF107",
    "safety-limits",
    "physics",
    "warning",
    bad=one_joint(LIMIT + '<safety_controller soft_lower_limit="-2" soft_upper_limit="0.9" k_velocity="1"/>'),
)
def _safety_limits(subject: Subject) -> Iterator[Diagnostic]:
    """The soft limits of a safety_controller are outside the limits, or cross.

    Soft limits slow a joint down before its hard limits. Outside of these they never act, and the joint hits its hard
    limit at full speed.
    """
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        safety = written[joint.name].first("safety_controller") if joint.name in written else None
        if safety is None or joint.type not in ("revolute", "prismatic"):
            continue
        soft = [finite(safety.attributes.get(f"soft_{side}_limit", "0").strip()) for side in ("lower", "upper")]
        lower, upper = soft
        limits = joint.limits
        if lower is None or upper is None or limits.lower is None or limits.upper is None or lower == upper == 0.0:
            continue
        if lower > upper:
            message = f"joint '{joint.name}': soft lower limit {lower:g} is above soft upper limit {upper:g}"
        elif lower < limits.lower - 1e-9 or upper > limits.upper + 1e-9:
            message = (
                f"joint '{joint.name}': soft limits {lower:g} to {upper:g} are outside the limits "
                f"{limits.lower:g} to {limits.upper:g}"
            )
        else:
            continue
        yield Diagnostic("URDF107", message, safety.place, "choose soft limits inside the limits", "warning")


@check(
    "URDF109",
    "limits-in-degrees",
    "physics",
    "warning",
    bad=one_joint('<limit lower="-180" upper="180" velocity="1" effort="1"/>'),
)
def _limits_in_degrees(subject: Subject) -> Iterator[Diagnostic]:
    """A joint has limits that look like degrees or millimetres.

    URDF uses radians and metres: a limit of 180 lets a joint rotate 28 times, or slide 180 m.
    """
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        lower, upper = joint.limits.lower or 0.0, joint.limits.upper or 0.0
        element = written[joint.name]
        place = (element.first("limit") or element).place
        most = max(abs(lower), abs(upper))
        if joint.type == "prismatic" and most > FAR_SLIDE:
            message = f"joint '{joint.name}' slides from {lower:g} to {upper:g} m: are these millimetres?"
            hint = f'lower="{lower / 1000.0:g}" upper="{upper / 1000.0:g}"'
            yield Diagnostic("URDF109", message, place, hint, "warning")
        if joint.type != "revolute" or most <= MANY_TURNS or most > 720.0:
            continue
        message = f"joint '{joint.name}' rotates from {lower:g} to {upper:g} rad: are these degrees?"
        hint = f'lower="{radians(lower):.4f}" upper="{radians(upper):.4f}"; for many revolutions use type="continuous"'
        yield Diagnostic("URDF109", message, place, hint, "warning")


@check(
    "URDF334",
    "zero-outside",
    "readiness",
    "note",
    bad=one_joint('<limit lower="0.5" upper="1" velocity="1" effort="1"/>'),
)
def _zero_outside(subject: Subject) -> Iterator[Diagnostic]:
    """Zero is outside the limits of a joint.

    Programs that start a robot with all joints at zero start it outside its limits. In manipcli, the pose `home` of
    the robot file sets the start.
    """
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        lower, upper = joint.limits.lower, joint.limits.upper
        if joint.independent and lower is not None and upper is not None and not lower <= 0.0 <= upper:
            message = f"joint '{joint.name}': zero is outside its limits {lower:g} to {upper:g}"
            element = written[joint.name]
            place = (element.first("limit") or element).place
            yield Diagnostic("URDF334", message, place, "add a named pose `home` to the robot file", "note")


@check(
    "URDF335", "mimic-limits", "readiness", "warning", bad=one_joint(more=another('<mimic joint="j" multiplier="2"/>'))
)
def _mimic_limits(subject: Subject) -> Iterator[Diagnostic]:
    """The limits of a mimic joint are narrower than the range it has to follow.

    At the limit either the coupling or the limit is violated; a plan for the leading joint does not consider it.
    """
    joints = {joint.name: joint for joint in subject.parts.joints}
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        mimic, own = joint.mimic, joint.limits
        if mimic is None or mimic.joint not in joints or own.lower is None or own.upper is None:
            continue
        leader = joints[mimic.joint].limits
        if leader.lower is None or leader.upper is None:
            continue
        ends = sorted(mimic.multiplier * end + mimic.offset for end in (leader.lower, leader.upper))
        slack = MIMIC_TOLERANCE * max(own.upper - own.lower, ends[1] - ends[0])
        if ends[0] >= own.lower - slack and ends[1] <= own.upper + slack:
            continue
        message = (
            f"joint '{joint.name}' has limits {own.lower:.4g} to {own.upper:.4g}, "
            f"but mimics '{mimic.joint}' from {ends[0]:.4g} to {ends[1]:.4g}"
        )
        element = written[joint.name]
        place = (element.first("limit") or element).place
        yield Diagnostic("URDF335", message, place, "widen the limits", "warning")


@check(
    "URDF332",
    "too-many-joints",
    "readiness",
    bad=one_joint(
        more="".join(
            f'<link name="l{k}"/><joint name="j{k}" type="fixed"><parent link="base"/><child link="l{k}"/></joint>'
            for k in range(127)
        )
    ),
)
def _too_many_joints(subject: Subject) -> Iterator[Diagnostic]:
    """The robot has more than 127 joints.

    From 128 joints on, fixed joints included, PyBullet cannot read a joint; with thousands it hangs or crashes.
    """
    joints = subject.description.root.all("joint")
    if len(joints) > MAX_JOINTS:
        message = f"the robot has {len(joints)} joints; Bullet allows {MAX_JOINTS}, fixed joints included"
        hint = "merge links that are fixed to each other"
        yield Diagnostic("URDF332", message, joints[MAX_JOINTS].place, hint)
