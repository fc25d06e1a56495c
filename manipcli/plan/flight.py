"""Flight of what is poured: down the tilting wall of a cup, over its rim, and free down to a container's opening.

All in the upright plane of the horizontal unit vector w, in which the cup tips, and z; the cup turns about a point T.
With e_u the axis of the cup, e_w = w turned with it, theta(t) the tilt, and X e_w + Y e_u the centre of a ball from T,

    a_u = Y'' - X theta'' - Y theta'^2,    a_w = Y theta'' + 2 Y' theta' - X theta'^2
    a_u = -g cos(theta) + F,               a_w = g sin(theta) - N         (forces per mass)

A ball of inertia k m r^2 that rolls has F = -k (Y'' + r theta''); it slips where that exceeds mu N. At the rim it
pivots about the edge while gravity presses it there harder than its curve lifts it, v^2 / r; then it flies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.scene import Interior
from manipcli.shapes.primitives import Cylinder

SPHERE: Final = 0.4
"""Inertia of a solid sphere by m r^2; other bodies slide."""
STEP: Final = 5e-4
"""[s] Step of the integration: a millimetre at the rim changes by less than 0.01 mm with half of it."""
PATIENCE: Final = 5.0
"""[s] What has not left so long after the end of the tilt stays in the cup."""
SPEED_ERROR: Final = 0.15
"""Share of the way from the lip to the landing that is uncertain: what rolls may slip, bounce, or meet an edge."""
PLACE_ERROR: Final = 0.005
"""[m] What is uncertain besides: the arm, and how far to the side of the lip it leaves a wall made of flat boxes."""


@dataclass(frozen=True, slots=True)
class Tilting:
    """The tilt theta [rad] of a cup at times [s] (k): both rise from 0."""

    times: Array
    angles: Array

    def then(self, other: Tilting) -> Tilting:
        """This, and the other one from its end on."""
        times = np.concatenate([self.times, self.times[-1] + other.times[1:]])
        return Tilting(times, np.concatenate([self.angles, self.angles[-1] + other.angles[1:]]))


@dataclass(frozen=True, slots=True)
class Contents:
    """What lies at the wall of an upright cup.

    Attributes:
        x, y: [m] its centre from T, along w and upwards.
        rim: [m] height of the rim above T.
        radius: [m] of what rolls; half of its width, where it slides.
        inertia: by m r^2; 0 where it slides.
        friction: coefficient between it and the cup.
    """

    x: float
    y: float
    rim: float
    radius: float
    inertia: float
    friction: float


@dataclass(frozen=True, slots=True)
class Leaving:
    """How something leaves a rim: time [s], tilt [rad], its centre (2,) [m] from T and velocity (2,) [m/s], (w, z)."""

    time: float
    tilt: float
    position: Array
    velocity: Array

    @property
    def speed(self) -> float:
        return float(np.linalg.norm(self.velocity))


def leaving(contents: Contents, tilting: Tilting, gravity: float) -> Leaving | None:
    """How the contents leave the rim; None if they stay in the cup."""
    rate = np.gradient(tilting.angles, tilting.times)
    bend = np.gradient(rate, tilting.times)
    times = np.arange(0.0, float(tilting.times[-1]) + PATIENCE, STEP)
    curves = [np.interp(times, tilting.times, curve) for curve in (tilting.angles, rate, bend)]
    curves[2][times > tilting.times[-1]] = 0.0
    x, y, v, k = contents.x, contents.y, 0.0, contents.inertia
    for time, theta, omega, alpha in zip(times.tolist(), *(curve.tolist() for curve in curves), strict=True):
        drive = x * alpha + y * omega * omega - gravity * math.cos(theta)
        normal = gravity * math.sin(theta) - (y * alpha + 2.0 * v * omega - x * omega * omega)
        most = contents.friction * max(0.0, normal)
        grip = k * (drive + contents.radius * alpha) / (1.0 + k)  # rolls
        if k == 0.0:
            grip = most if v > 0.0 else min(most, max(-most, drive))
        drive -= min(most, max(-most, grip))
        v += STEP * drive
        if y <= contents.y and v <= 0.0:
            v = 0.0
        y += STEP * v
        if y >= contents.rim:
            return _over_the_edge(contents, time, theta, omega, y, v, gravity)
    return None


def _over_the_edge(c: Contents, time: float, theta: float, omega: float, y: float, v: float, gravity: float) -> Leaving:
    """The pivot about the edge, which moves as at its start, until the contents leave it.

    beta is how far the centre has turned about the edge from the normal of the wall; the normal is theta beyond z.
    """
    e_w, e_u = np.array([math.cos(theta), -math.sin(theta)]), np.array([math.sin(theta), math.cos(theta)])
    edge = (c.x + c.radius) * e_w + y * e_u
    carried = (c.x + c.radius) * -omega * e_u + y * omega * e_w
    slope = theta - math.pi / 2.0  # of the wall, below the horizontal
    beta, rate = 0.0, v / c.radius + omega
    while rate > 0.0 and gravity * math.cos(slope + beta) > c.radius * rate * rate:
        rate += STEP * gravity * math.sin(slope + beta) / (c.radius * (1.0 + c.inertia))
        beta += STEP * rate
        time += STEP
    along, out = slope + beta, c.radius * rate
    outward = np.array([math.sin(along), math.cos(along)])
    velocity = carried + out * np.array([math.cos(along), -math.sin(along)])
    return Leaving(time, theta, edge + c.radius * outward, velocity)


def fall(height: float, velocity: Array, gravity: float) -> tuple[float, float]:
    """Time [s] and way along w [m] of a free fall to `height` [m] below the start; 0 above all of the path.

    With velocity (w, z): t = (v_z + sqrt(v_z^2 + 2 g h)) / g.
    """
    rise = float(velocity[1])
    time = (rise + math.sqrt(max(0.0, rise * rise + 2.0 * gravity * height))) / gravity
    return max(0.0, time), max(0.0, time) * float(velocity[0])


def hollow_along(interior: Interior, R_WO: Array, w: Array) -> float:
    """[m] How far the rim of a hollow is from its middle in the horizontal direction `w` (3,) of the world."""
    if interior.walls is not None:
        return interior.walls.reach(((R_WO @ interior.X_OS.R).T @ w)[:2])
    if isinstance(interior.shape, Cylinder):
        return interior.shape.radius
    local = np.abs((R_WO @ interior.X_OS.R).T @ w)
    flat = [size / 2.0 / part for size, part in zip(interior.shape.size[:2], local[:2], strict=True) if part > 1e-9]
    return float(min(flat))


def room(interior: Interior, p_S: Array) -> float:
    """[m] From a point (3,) in S to the wall of the opening, level; negative: outside."""
    shape = interior.shape
    if interior.walls is not None:
        return float(interior.walls.room(np.array([p_S[0], p_S[1], interior.rim])))
    if isinstance(shape, Cylinder):
        return shape.radius - math.hypot(p_S[0], p_S[1])
    d = np.abs(p_S[:2]) - np.array(shape.size[:2]) / 2.0
    return -float(np.linalg.norm(np.maximum(d, 0.0)) + min(float(np.max(d)), 0.0))
