"""Grasp frames of an object: poses of the tool at which the hand closes on it, the preferred first.

`usual` are the frames that are tried first: along the line from robot to object, from above, with half a turn of the
hand. `further` are all others, lazily: around the object, sloping between side and top, higher and lower, other rolls
of the hand; for a mesh, antipodal pairs of points on its triangles. Each frame's +z is the direction of approach, its
y the direction in which the fingers close.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen, matrix_from_axis_angle
from manipcli.core.units import readable
from manipcli.plan.antipodal import antipodal_pairs
from manipcli.scene.scene import Body, Frame

Direction = Literal["side", "top"]

YAWS_DEG = (0.0, 15.0, -15.0, 35.0, -35.0)
"""Candidate rotations of the approach about the vertical, relative to the straight line from robot to object."""
UPRIGHT = 0.99
"""Cosine above which two axes count as parallel: upright objects, tools that point straight down."""
ALIKE = 0.5
"""Cosine above which two tool directions are similar enough to compare their rotation about them."""
HIGHER = (2 / 3, 5 / 6)
"""Shares of an object's height at which it is grasped from above if its middle is out of reach: the palm touches."""
AROUND_DEG: Final = (60.0, -60.0, 90.0, -90.0, 120.0, -120.0, 150.0, -150.0, 180.0)
"""Further rotations about the vertical: the rest of the circle around an object."""
PITCHES_DEG: Final = (30.0, 60.0)
"""Further approaches between side (0) and top (90)."""
STRAIGHT_FIRST_DEG: Final = (0.0, 90.0, 60.0, 30.0, 75.0, 45.0, 15.0)
"""The same with side and top, for an arm that has a yaw of its own in each."""
ALONG: Final = (0.75, 0.25)
"""Further shares of the height at which an object is grasped from the side."""
ROLLS_DEG: Final = (45.0, -45.0, 22.5, -22.5, 67.5, -67.5)
"""Further yaws of a hand that comes from the top, relative to the object's."""
TILTED: Final = math.radians(15.0)
"""How far an approach to an antipodal pair may be from the stated pitch."""
BELOW: Final = 0.2
"""Largest upward component of the approach to an antipodal pair: the hand does not come from below."""
TURNS: Final = 8
"""Approaches to one antipodal pair, evenly around its line."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspFrame:
    """Tool pose `X_WT` of a grasp, `height` [m] of the tool above the object's bottom, and its `name` in reports."""

    X_WT: Transform
    height: float
    name: str


@dataclass(frozen=True, slots=True, eq=False)
class GraspFrames:
    """The frames of one object for one robot.

    Attributes:
        body: the object.
        X_WO, X_WB: where it is, and where the robot's base is.
        R_WT: (3, 3) present orientation of the tool; grasps near it come first.
        direction: from where the hand comes; None for any.
        yaw: [rad] of the approach; None for any.
        pitch: [rad] of an approach between side (0) and top (pi / 2), downwards; None for any.
        height: [m] of the tool above the object's bottom; None: its middle, or others.
    """

    body: Body
    X_WO: Transform
    X_WB: Transform
    R_WT: Array
    direction: Direction | None
    yaw: float | None
    height: float | None
    pitch: float | None = None

    @property
    def bottom(self) -> float:
        """[m] z of the object's lowest point in its own frame."""
        return float(self.body.centre[2] - self.body.size[2] / 2)

    def usual(self) -> tuple[GraspFrame, ...]:
        """The frames at the height that is asked for, or at the middle."""
        return tuple(self._at(self._middle, R_WT) for R_WT in _orientations(self))

    def higher(self) -> tuple[GraspFrame, ...]:
        """The frames from the top with the tool higher at an upright object, if no height is asked for."""
        if self.height is not None or not self._tall:
            return ()
        from_above = [R_WT for R_WT in _orientations(self) if R_WT[2, 2] < -UPRIGHT]
        return tuple(
            self._at(self.bottom + share * float(self.body.size[2]), R_WT) for share in HIGHER for R_WT in from_above
        )

    def pitches(self) -> Iterator[GraspFrame]:
        """Frames between side and top whose yaw only begins a search, by pitch, height and roll of the hand."""
        straight = {"side": (0.0,), "top": (90.0,), None: STRAIGHT_FIRST_DEG}[self.direction]
        pitches = np.radians(straight) if self.pitch is None else (self.pitch,)
        shares = HIGHER if self.height is None and self._tall else ()
        heights = [self._middle, *(self.bottom + share * float(self.body.size[2]) for share in shares)]
        for rolls, z in itertools.product(((0.0, 180.0), (90.0, -90.0)), heights):
            for pitch in pitches:
                yield from self._level(z, self._nominal, rolls, float(pitch))

    def further(self) -> Iterator[GraspFrame]:
        """All other frames."""
        if self.body.kind in ("mesh", "urdf") and self.height is None and self.yaw is None:
            yield from self._antipodal()
        if self.pitch is not None:
            yield from self._pitched_further(self.pitch)
            return
        if self.direction != "top":
            yield from self._around()
        if self.direction is None:
            yield from self._sloping()
        if self.direction != "top" and self.height is None and self._tall:
            for share, yaw in itertools.product(ALONG, self._yaws(YAWS_DEG)):
                yield from self._level(self.bottom + share * float(self.body.size[2]), yaw, (0.0, 180.0))
        if self.direction != "top":
            for yaw in self._yaws(YAWS_DEG[:1]):
                yield from self._level(self._middle, yaw, (90.0, -90.0))
        if self.direction != "side" and self.yaw is None:
            for offset in ROLLS_DEG:
                for turn in (0.0, 180.0):
                    R_WT = _pitched(float(self.X_WO.rpy[2]) + math.radians(offset + turn), math.pi / 2)
                    yield self._at(self._middle, R_WT)

    def turned(self, frame: GraspFrame, X_WT: Transform) -> GraspFrame:
        """The same frame with another orientation."""
        return GraspFrame(X_WT, frame.height, _name(X_WT.R, frame.height))

    @property
    def _tall(self) -> bool:
        return self.body.kind != "sphere" and bool(self.X_WO.R[2, 2] > UPRIGHT)

    @property
    def _middle(self) -> float:
        return float(self.body.centre[2]) if self.height is None else self.bottom + self.height

    @property
    def _nominal(self) -> float:
        """[rad] Yaw of the approach away from the robot's base, or as asked for."""
        away = self.X_WO.p - self.X_WB.p
        return math.atan2(away[1], away[0]) if self.yaw is None else self.yaw

    def _yaws(self, offsets_deg: tuple[float, ...]) -> list[float]:
        offsets = offsets_deg if self.yaw is None else (0.0,)
        return [self._nominal + math.radians(offset) for offset in offsets]

    def _at(self, z: float, R_WT: Array) -> GraspFrame:
        x, y = self.body.centre[:2]
        height = z - self.bottom
        return GraspFrame(Transform.of(xyz=self.X_WO.apply([x, y, z]), R=R_WT), height, _name(R_WT, height))

    def _level(self, z: float, yaw: float, rolls_deg: tuple[float, ...], pitch: float = 0.0) -> Iterator[GraspFrame]:
        for roll in rolls_deg:
            turned = matrix_from_axis_angle(np.array([0.0, 0.0, 1.0]), math.radians(roll))
            yield self._at(z, np.asarray(_pitched(yaw, pitch) @ turned))

    def _around(self) -> Iterator[GraspFrame]:
        """From the other sides: square to the faces of a box, then around the circle."""
        if self.yaw is not None:
            return
        yaws = [self._nominal + math.radians(offset) for offset in AROUND_DEG]
        if self.body.kind in ("box", "tray"):
            yaws = [float(self.X_WO.rpy[2]) + math.radians(turn) for turn in (0.0, 90.0, -90.0, 180.0)] + yaws
        for yaw in yaws:
            yield from self._level(self._middle, yaw, (0.0, 180.0))

    def _pitched_further(self, pitch: float) -> Iterator[GraspFrame]:
        """At the stated pitch, from the other sides and with other rolls of the hand."""
        for rolls, offsets in (((0.0, 180.0), AROUND_DEG), ((90.0, -90.0), YAWS_DEG)):
            for yaw in self._yaws(offsets):
                yield from self._level(self._middle, yaw, rolls, pitch)

    def _sloping(self) -> Iterator[GraspFrame]:
        """Between side and top."""
        for pitch, yaw in itertools.product(PITCHES_DEG, self._yaws((0.0, 35.0, -35.0, 90.0, -90.0, 180.0))):
            yield from self._level(self._middle, yaw, (0.0, 180.0), math.radians(pitch))

    def _antipodal(self) -> Iterator[GraspFrame]:
        """At pairs of opposite points of its triangles, from each side of their line that the hand may come from."""
        away = np.array([math.cos(self._nominal), math.sin(self._nominal), -1.0]) / math.sqrt(2.0)
        for pair in antipodal_pairs(self.body):
            y = self.X_WO.R @ pair.axis
            p_WT = self.X_WO.apply(pair.middle)
            x = np.cross(y, away)
            length = float(np.linalg.norm(x))
            first = np.cross(x / length, y) if length > 1e-6 else np.linalg.svd(y[None])[2][2]
            turns = [matrix_from_axis_angle(y, 2.0 * math.pi * k / TURNS) @ first for k in range(TURNS)]
            for z in sorted(turns, key=lambda z: -round(float(z @ away), 6)):
                if z[2] > BELOW or not self._from_here(float(z[2])):
                    continue
                for side in (y, -y):
                    R_WT = np.column_stack([np.cross(side, z), side, z])
                    height = float(pair.middle[2]) - self.bottom
                    name = f"{_name(R_WT, height)}, at opposite points {readable(pair.width, 'm')} apart"
                    yield GraspFrame(Transform.of(xyz=p_WT, R=R_WT), height, name)

    def _from_here(self, z: float) -> bool:
        """Whether an approach with this vertical component is from where the hand may come."""
        if self.pitch is not None:
            return abs(math.asin(max(-1.0, min(1.0, -z))) - self.pitch) < TILTED
        return self.direction is None or (z < -0.9 if self.direction == "top" else abs(z) < 0.3)


def part_alone(body: Body, part: Frame) -> Body:
    """The part of a body as an object of its own, whose frame is that of the part: a box of its size, or a point."""
    X_PO = part.X_PF.inverse()
    return replace(
        body,
        kind="sphere" if part.size is None else "box",
        geometries=tuple(replace(each, X_LS=X_PO @ each.X_LS) for each in body.geometries),
        size=frozen(np.zeros(3) if part.size is None else part.size),
        centre=frozen(np.zeros(3)),
    )


def first_fitting(frames: Iterator[GraspFrame], fits: Callable[[Transform], bool], most: int) -> Iterator[GraspFrame]:
    """The first `most` frames at which the open hand does not overlap the object."""
    return itertools.islice((frame for frame in frames if fits(frame.X_WT)), most)


def _name(R_WT: Array, height: float) -> str:
    """The approach, the height above the object's bottom, and the roll of the hand, as reported for a candidate."""
    z = R_WT[:, 2]
    yaw = math.atan2(z[1], z[0])
    if abs(z[2]) > UPRIGHT:
        side, yaw = "from the top", math.atan2(R_WT[1, 0], R_WT[0, 0])
    elif abs(z[2]) > 0.1:
        side = f"{math.degrees(math.asin(-z[2])):.0f} deg from above"
    else:
        side = f"from the side{', rolled' if R_WT[2, 0] > 0.0 else ''}"
    return f"{side}, yaw {math.degrees(yaw):.0f} deg, {readable(height, 'm')} above its bottom"


def _pitched(yaw: float, pitch: float) -> Array:
    """The tool's orientation (3, 3) coming from a side (pitch 0) or from above (pi / 2), the fingers closing level."""
    c, s, level, down = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
    return _frame(np.array([-c * down, -s * down, -level]), np.array([c * level, s * level, -down]))


def _orientations(frames: GraspFrames) -> list[Array]:
    """R_WT (3, 3) of the usual frames, the preferred first; each also rotated by half a turn about z.

    The one nearer to the present orientation comes first: it leaves more range of the wrist for later steps.
    """
    found = []
    if frames.pitch is not None:
        for yaw in frames._yaws(YAWS_DEG):
            R_WT = _pitched(yaw, frames.pitch)
            found += _nearer_first(R_WT, R_WT @ np.diag([-1.0, -1.0, 1.0]), frames.R_WT)
        return found
    if frames.direction != "top":
        for yaw in frames._yaws(YAWS_DEG):
            z = np.array([math.cos(yaw), math.sin(yaw), 0.0])
            x = np.array([0.0, 0.0, -1.0])
            found += _nearer_first(_frame(x, z), _frame(-x, z), frames.R_WT)
    if frames.direction != "side":
        nominal = float(frames.X_WO.rpy[2]) if frames.yaw is None else frames.yaw
        z = np.array([0.0, 0.0, -1.0])
        both = []
        for offset in (0.0, 90.0) if frames.yaw is None else (0.0,):
            yaw = nominal + math.radians(offset)
            x = np.array([math.cos(yaw), math.sin(yaw), 0.0])
            both.append(_nearer_first(_frame(x, z), _frame(-x, z), frames.R_WT))
        found += [pair[k] for k in (0, 1) for pair in both]
    return found


def _nearer_first(first: Array, second: Array, R: Array) -> list[Array]:
    """Both rotations (3, 3), the second first if `R` has about the same z axis and is clearly nearer to the second."""
    alike = first[:, 2] @ R[:, 2] > ALIKE
    return [second, first] if alike and np.sum(second * R) > np.sum(first * R) + 1e-3 else [first, second]


def _frame(x: Array, z: Array) -> Array:
    """The rotation with these two unit axes."""
    return np.column_stack([x, np.cross(z, x), z])
