"""Encoders of messages that are written once at the start or on events."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import PurePath

from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.record.cdr import NS_PER_S, CdrWriter
from manipcli.record.recording import TaskEvent
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Sphere, drawn_once

WORLD = "world"
ALIGN = 8
"""Largest alignment of a number [byte]."""
_STAMP, _COUNT, _NUMBERS = struct.Struct("<iI"), struct.Struct("<I"), struct.Struct("<ddI")
GREY = (0.7, 0.7, 0.7, 1.0)
CUBE, SPHERE, CYLINDER, MESH_RESOURCE = 1, 2, 3, 10
INFO, WARN, ERROR = 20, 30, 40
_LEVELS = {"failed": ERROR, "aborted": ERROR, "error": ERROR, "timeout": WARN, "interrupted": WARN, "canceled": WARN}


def string_message(text: str) -> bytes:
    """std_msgs/String."""
    writer = CdrWriter()
    writer.text(text)
    return writer.data


def static_transforms(robot: RobotModel, scene: Scene) -> tuple[tuple[str, str, Transform], ...]:
    """(parent, child, X_PC) of all fixed frames: robot base, fixed joints, fixed bodies, named frames."""
    found = [] if robot.root == WORLD else [(WORLD, robot.root, robot.X_WB)]
    found += [(joint.parent, joint.child, joint.X_PJ) for joint in robot.joints if not joint.moves]
    found += [(WORLD, body.name, body.X_WO) for body in scene.bodies if body.fixed]
    found += [(frame.parent, frame.name, frame.X_PF) for frame in scene.frames]
    return tuple(found)


def tf_message(transforms: Sequence[tuple[str, str, Transform]], ns: int) -> bytes:
    """tf2_msgs/TFMessage of (parent, child, X_PC)."""
    writer = CdrWriter()
    writer.u32(len(transforms))
    for parent, child, X_PC in transforms:
        writer.header(ns, parent)
        writer.text(child)
        writer.f64s((*X_PC.p, *X_PC.quat_xyzw))
    return writer.data


def pose_with_covariance(X_WO: Transform, covariance: Array, ns: int) -> bytes:
    """geometry_msgs/PoseWithCovarianceStamped in the world."""
    writer = CdrWriter()
    writer.header(ns, WORLD)
    writer.f64s((*X_WO.p, *X_WO.quat_xyzw, *covariance.flat))
    return writer.data


def marker_message(scene: Scene, ns: int) -> bytes:
    """visualization_msgs/MarkerArray: every shape of every body, in the body's own frame."""
    writer = CdrWriter()
    writer.u32(sum(len(drawn_once(body.geometries)) for body in scene.bodies))
    for body in scene.bodies:
        for k, geometry in enumerate(drawn_once(body.geometries)):
            _marker(writer, body.name, k, geometry, ns)
    return writer.data


def _marker(writer: CdrWriter, frame: str, k: int, geometry: Geometry, ns: int) -> None:
    kind, scale, resource = _shape(geometry)
    writer.header(ns, frame)
    writer.text(frame)
    for value in (k, kind, 0):
        writer.i32(value)
    writer.f64s((*geometry.X_LS.p, *geometry.X_LS.quat_xyzw))
    writer.f64s(scale)
    for channel in geometry.rgba or GREY:
        writer.f32(channel)
    writer.time(0)
    writer.u8(1)
    writer.u32(0)
    writer.u32(0)
    writer.text("")
    writer.header(0, "")
    writer.text("")
    writer.u32(0)
    writer.u32(0)
    writer.text("")
    writer.text(resource)
    writer.text("")
    writer.u32(0)
    writer.u8(1 if resource and geometry.rgba is None else 0)


def _shape(geometry: Geometry) -> tuple[int, tuple[float, float, float], str]:
    """Marker type, scale (full lengths, or a mesh's factors), mesh resource."""
    match geometry.shape:
        case Box(size=size):
            return CUBE, size, ""
        case Sphere(radius=radius):
            return SPHERE, (2 * radius, 2 * radius, 2 * radius), ""
        case Cylinder(radius=radius, length=length):
            return CYLINDER, (2 * radius, 2 * radius, length), ""
        case Mesh(uri=uri, scale=scale):
            return MESH_RESOURCE, scale, portable_name(uri)


def portable_name(file: str) -> str:
    """The name of a file in a log: as written, or the last part of an absolute path, which depends on the machine."""
    return PurePath(file).name if PurePath(file).is_absolute() or file.startswith("file:") else file


def event_message(ns: int, event: TaskEvent) -> bytes:
    """manipcli_msgs/TaskEvent."""
    writer = CdrWriter()
    writer.header(ns, WORLD)
    for value in (event.kind, event.step, event.verb, event.outcome, event.text, event.place):
        writer.text(value)
    return writer.data


def log_message(ns: int, event: TaskEvent) -> bytes:
    """rcl_interfaces/Log: the event as a readable line; its level follows the outcome."""
    file, line = event.place, 0
    parts = event.place.split(":")
    if len(parts) >= 2 and parts[1].isdecimal():
        file, line = parts[0], min(int(parts[1]), 2**32 - 1)
    step = f"'{event.step}'" if event.step else ""
    verb = f"({event.verb})" if event.verb else ""
    message = " ".join(word for word in (event.kind.replace("_", " "), step, verb, event.outcome) if word)
    writer = CdrWriter()
    writer.time(ns)
    writer.u8(_LEVELS.get(event.outcome, INFO))
    writer.text("manipcli")
    writer.text(f"{message}: {event.text}" if event.text else message)
    writer.text(file)
    writer.text(event.kind)
    writer.u32(line)
    return writer.data


def live_command_message(ns: int, tick: int, op: str, name: str, id_: str, json: str) -> bytes:
    """manipcli_msgs/LiveCommand."""
    writer = CdrWriter()
    writer.header(ns, WORLD)
    writer.u32(tick)
    for value in (op, name, id_, json):
        writer.text(value)
    return writer.data


class ContactEncoder:
    """Encoder of manipcli_msgs/Contacts. The constant bytes of each pair are built once, because sets of pairs can
    alternate at the control rate while fingers close."""

    def __init__(self) -> None:
        writer = CdrWriter()
        self._stamp = writer.header(0, WORLD)
        writer.u32(0)
        self._head = writer.data[:-4]
        self._known: dict[tuple[str, str, int], bytes] = {}

    def encode(self, ns: int, contacts: Sequence[Contact]) -> bytes:
        data = bytearray(self._head)
        _STAMP.pack_into(data, self._stamp, *divmod(ns, NS_PER_S))
        data += _COUNT.pack(len(contacts))
        for a, b, force, distance, points in contacts:
            key = (a, b, len(data) % ALIGN)
            data += self._known.get(key) or self._names(key)
            data += _NUMBERS.pack(force, distance, len(points))
            if points:
                numbers: list[float] = []
                for position, normal, press, friction in points:
                    numbers += (*position, *normal, press, *friction)
                data += struct.pack(f"<4x{len(numbers)}d", *numbers)  # 4 bytes align the first number
        return bytes(data)

    def _names(self, key: tuple[str, str, int]) -> bytes:
        """The names of a pair that begin at this remainder of `ALIGN`, and the alignment of its numbers."""
        a, b, begin = key
        writer = CdrWriter()
        while len(writer.data) % ALIGN != begin:
            writer.u8(0)
        start = len(writer.data)
        writer.text(a)
        writer.text(b)
        end = writer.f64(0.0)
        names = self._known[key] = writer.data[start:end]
        return names
