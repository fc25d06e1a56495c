"""State in a log at one time, as text and JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass

from manipcli.core.geometry import Transform
from manipcli.model.state import Contact, ContactPoint
from manipcli.report.display_quantity import CUSTOMARY
from manipcli.report.json import Json, dumps, number
from manipcli.report.table import table

_HUGE = 1e9
_RATE = {"rad": "rad/s", "m": "m/s"}
_EFFORT = {"rad": "N m", "m": "N"}


@dataclass(frozen=True, slots=True)
class JointMoment:
    """State of a joint in SI units, with `unit` rad or m ("" if unknown); None for values that are not recorded."""

    name: str
    unit: str
    position: float | None
    velocity: float | None
    effort: float | None
    reference: float | None = None

    @property
    def error(self) -> float | None:
        """Reference minus position."""
        return None if self.reference is None or self.position is None else self.reference - self.position


@dataclass(frozen=True, slots=True)
class PoseMoment:
    """A body or frame: its pose in `parent`, and its speed [m/s] or None."""

    name: str
    parent: str
    pose: Transform
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class Moment:
    """State in a log at one time.

    Attributes:
        log: path of the log.
        asked: requested time [s] from the beginning of the log.
        time: time [s] of the state, the last one not after `asked`.
        end: end of the log [s].
        step, verb, phase: active step and phase; empty without one.
        contacts: contacts; None if the log does not record them.
        missing: parts that are not known, one sentence each.
        ours: whether manipcli wrote the log.
        tool: pose of the tool frame; None if the log does not define it.
        contacts_time: when the contacts were recorded [s]; their points are those of this time.
    """

    log: str
    asked: float
    time: float
    end: float
    step: str
    verb: str
    phase: str
    joints: tuple[JointMoment, ...]
    poses: tuple[PoseMoment, ...]
    contacts: tuple[Contact, ...] | None
    missing: tuple[str, ...]
    ours: bool = True
    tool: PoseMoment | None = None
    contacts_time: float | None = None


def render_text(moment: Moment) -> str:
    """Time and step, then joints, bodies and contacts; in customary units, with radians in parentheses."""
    lines = [f"missing: {text}" for text in moment.missing]
    if lines:
        lines.append("")
    when = f"t = {moment.time:.3f} s of {moment.end:.3f} s"
    idle = ": no active step" if moment.ours else ""
    on = f": step '{moment.step}' ({moment.verb})" if moment.step else idle
    phase = f", phase '{moment.phase}'" if moment.phase else ""
    lines.append(when + on + phase)
    if moment.joints:
        lines += ["", _joints(moment.joints)]
    if moment.tool is not None:
        lines += ["", _poses((moment.tool,), "robot")]
    if moment.poses:
        lines += ["", _poses(moment.poses, "body")]
    if moment.contacts is not None:
        lines += ["", _contacts(moment.contacts) if moment.contacts else "no contacts"]
    return "\n".join(lines)


def render_json(moment: Moment) -> str:
    """The state as one JSON object; numbers are SI."""
    contacts: Json = None
    if moment.contacts is not None:
        contacts = [
            {
                "a": c.a,
                "b": c.b,
                "force": number(c.force),
                "distance": number(c.distance),
                "points": [_point_json(point) for point in c.points],
            }
            for c in moment.contacts
        ]
    return dumps(
        {
            "log": moment.log,
            "asked": moment.asked,
            "time": number(moment.time),
            "end": number(moment.end),
            "step": moment.step or None,
            "verb": moment.verb or None,
            "phase": moment.phase or None,
            "joints": [
                {
                    "name": joint.name,
                    "unit": joint.unit or None,
                    "position": number(joint.position),
                    "velocity": number(joint.velocity),
                    "effort": number(joint.effort),
                    "reference": number(joint.reference),
                    "error": number(joint.error),
                }
                for joint in moment.joints
            ],
            "tool": None if moment.tool is None else _pose_json(moment.tool),
            "poses": [_pose_json(pose) for pose in moment.poses],
            "contacts_time": number(moment.contacts_time),
            "contacts": contacts,
            "missing": list(moment.missing),
        }
    )


def _point_json(point: ContactPoint) -> Json:
    return {
        "position": [number(value) for value in point.position],
        "normal": [number(value) for value in point.normal],
        "force": number(point.force),
        "friction": [number(value) for value in point.friction],
    }


def _pose_json(pose: PoseMoment) -> Json:
    return {
        "name": pose.name,
        "parent": pose.parent,
        "xyz": [number(value) for value in pose.pose.p],
        "quat_xyzw": [number(value) for value in pose.pose.quat_xyzw],
        "speed": number(pose.speed),
    }


def _joints(joints: tuple[JointMoment, ...]) -> str:
    rows = [
        [
            joint.name,
            _shown(joint.position, joint.unit),
            "" if joint.position is None or joint.unit != "rad" else f"({_fixed(joint.position, 4)} rad)",
            _shown(joint.velocity, _RATE.get(joint.unit, "")),
            _shown(joint.effort, _EFFORT.get(joint.unit, "")),
            _shown(joint.reference, joint.unit),
            _shown(joint.error, joint.unit),
        ]
        for joint in joints
    ]
    header = ["joint", "position", "", "velocity", "effort", "reference", "error"]
    used = [k for k in range(len(header)) if k == 0 or any(row[k] for row in rows)]
    return table(
        [header[k] for k in used], [[row[k] for k in used] for row in rows], right=[h for h in header[1:] if h]
    )


def _poses(poses: tuple[PoseMoment, ...], what: str) -> str:
    rows = []
    for pose in poses:
        xyz = ", ".join(_fixed(1000.0 * value, 2) for value in pose.pose.p)
        rpy = ", ".join(_fixed(math.degrees(value), 2) for value in pose.pose.rpy)
        rows.append([pose.name, pose.parent, f"{xyz} mm", f"{rpy} deg", _shown(pose.speed, "m/s")])
    header = [what, "in", "x, y, z", "roll, pitch, yaw", "speed"]
    used = [k for k in range(len(header)) if k == 0 or any(row[k] for row in rows)]
    return table([header[k] for k in used], [[row[k] for k in used] for row in rows], right=["speed"])


def _contacts(contacts: tuple[Contact, ...]) -> str:
    rows = [[c.a, c.b, _shown(c.force, "N"), _friction(c), _shown(-c.distance, "m")] for c in contacts]
    header = ["touches", "", "force", "friction", "depth"]
    used = [k for k in range(len(header)) if header[k] != "friction" or any(row[k] for row in rows)]
    return table(
        [header[k] for k in used], [[row[k] for k in used] for row in rows], right=[header[k] for k in used[2:]]
    )


def _friction(contact: Contact) -> str:
    """Magnitude of the sum of the friction forces; "" without contact points."""
    if not contact.points:
        return ""
    return _shown(
        math.hypot(*(math.fsum(axis) for axis in zip(*(p.friction for p in contact.points), strict=True))), "N"
    )


def _shown(value: float | None, unit: str) -> str:
    """A value in its customary unit with fixed decimals; a value near zero is shown as zero."""
    if value is None:
        return ""
    name, scale = CUSTOMARY.get(unit, (unit, 1.0))
    return f"{_fixed(scale * value, 3)} {name}".rstrip()


def _fixed(value: float, digits: int) -> str:
    """Fixed decimals without a negative zero; exponent notation for values that are not plausible."""
    if abs(value) >= _HUGE:
        return f"{value:.4g}"
    return f"{round(value, digits) + 0.0:.{digits}f}"
