"""Where what is poured passes the rim of its cup, how fast, and where it lands, as the physics has it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.model.grasp import LINK
from manipcli.model.state import Contact, WorldState, body_pose
from manipcli.plan.flight import room
from manipcli.scene.scene import Scene
from manipcli.spec.counted import selections

SHOWN: Final = 3
"""Bodies that a text describes one by one."""


@dataclass(slots=True)
class _Poured:
    """One body.

    Attributes:
        below, centre, velocity: [m] how far its centre is below the rim, its centre (3,) [m] and velocity (3,) [m/s],
            when last seen in the cup.
        out: [m/s] its velocity along the axis of the cup, towards the rim.
        left: its velocity (3,) [m/s] at the rim; None: it is in the cup.
        passed: its centre (3,) [m] at the rim; None: it is in the cup.
        over: where that is, of the receiving container.
        at: [s] that time, at which it was first seen out of the cup.
        tilt: [rad] of the cup at that time.
        landed: where; "" while it flies.
    """

    below: float = math.inf
    centre: Array | None = None
    velocity: Array | None = None
    out: float = 0.0
    left: Array | None = None
    at: float = 0.0
    passed: Array | None = None
    over: str = ""
    tilt: float = 0.0
    landed: str = ""


class PourWatch:
    """Follows the contents of a cup from its rim to where they land.

    Args:
        scene: of the physics.
        cup, into: the containers.
        bodies: the contents.
    """

    def __init__(self, scene: Scene, cup: str, into: str, bodies: Sequence[str]) -> None:
        self._scene, self._cup, self._into = scene, cup, into
        self._bodies = {name: _Poured() for name in bodies}
        self._known = scene.body(cup).interior is not None

    def look(self, state: WorldState, contacts: Iterable[Contact]) -> None:
        """Called with a state that has velocities, and with the contacts in it."""
        open_ = [(name, one) for name, one in self._bodies.items() if not one.landed]
        if not open_ or not self._known:
            return
        hollow = self._scene.body(self._cup).interior
        assert hollow is not None  # known
        X_WS = _pose(self._scene, state, self._cup) @ hollow.X_OS
        names = [body.name for body in self._scene.movable]
        for name, one in open_:
            X_WO = _pose(self._scene, state, name)
            centre = X_WO.apply(self._scene.body(name).centre)
            if one.left is None:
                p_S = X_WS.inverse().apply(centre)
                below = hollow.rim - float(p_S[2])
                velocity = np.array(state.body_linear[names.index(name)])
                if below >= 0.0:
                    one.below, one.centre, one.velocity = below, centre, velocity
                    one.out = float(velocity @ X_WS.R[:, 2])
                    continue
                share = one.below / (one.below - below) if math.isfinite(one.below) else 1.0
                before = velocity if one.velocity is None else one.velocity
                one.left = before + share * (velocity - before)
                one.at = float(state.time)
                one.passed = centre if one.centre is None else one.centre + share * (centre - one.centre)
                one.over = self._over(state, one.passed, one.left)
                one.tilt = math.acos(min(1.0, max(-1.0, float(X_WS.R[2, 2]))))
            else:
                ground = self._met(name, contacts)
                if ground:
                    one.landed = self._place(state, centre, one.left, ground)

    @property
    def left(self) -> tuple[str, ...]:
        """What has left the cup."""
        return tuple(name for name, one in self._bodies.items() if one.left is not None)

    def leaving(self, within: float) -> tuple[str, ...]:
        """What has left the cup, or will within that time [s] at its velocity."""
        return tuple(name for name, one in self._bodies.items() if one.left is not None or one.below < within * one.out)

    def with_times(self, text: str) -> str:
        """The text of a pour that is done; for bodies of a `count` also when the first and last left the cup."""
        times = sorted(one.at for one in self._bodies.values() if one.left is not None)
        if not times or not selections(self._bodies):
            return text
        over = f"first over the rim at {times[0]:.2f} s, last at {times[-1]:.2f} s"
        return f"{text}; {over}" if text else over

    def text(self) -> str:
        """What left the rim and did not land in the container; "" for nothing."""
        told = []
        for name, one in self._bodies.items():
            if one.left is not None and not one.landed.startswith("in "):
                speed = f"{float(np.linalg.norm(one.left)):.2f} m/s"
                end = f"landed {one.landed}" if one.landed else "has not landed"
                told.append(
                    f"'{name}' left the rim{one.over} at {speed}, tilted {math.degrees(one.tilt):.0f} deg, and {end}"
                )
        more = len(told) - SHOWN
        return "; ".join(told[:SHOWN]) + (f"; and {more} more" if more > 0 else "")

    def _met(self, name: str, contacts: Iterable[Contact]) -> str:
        """The body that it touches, which is neither of the contents, nor the cup, nor the robot."""
        for contact in contacts:
            if name in (contact.a, contact.b):
                other = contact.b if contact.a == name else contact.a
                if other != self._cup and other not in self._bodies and not other.startswith(LINK):
                    return other
        return ""

    def _over(self, state: WorldState, p: Array, velocity: Array) -> str:
        """` 59 mm before the middle of 'mug' and 94 mm above its rim`."""
        hollow = self._scene.body(self._into).interior
        if hollow is None:
            return ""
        X_WS = _pose(self._scene, state, self._into) @ hollow.X_OS
        away = p - X_WS.apply([0.0, 0.0, hollow.rim])
        level = float(np.linalg.norm(velocity[:2]))
        ahead = float(away[:2] @ velocity[:2]) / level if level > 0.0 else float(np.linalg.norm(away[:2]))
        side, high = ("beyond" if ahead >= 0.0 else "before"), ("above" if away[2] >= 0.0 else "below")
        lengths = readable(abs(ahead), "m"), readable(abs(float(away[2])), "m")
        return f" {lengths[0]} {side} the middle of '{self._into}' and {lengths[1]} {high} its rim"

    def _place(self, state: WorldState, centre: Array, left: Array, ground: str) -> str:
        """`41 mm beyond the rim of 'mug', on 'desk'`."""
        receiver = self._scene.body(self._into)
        if receiver.interior is None:
            return f"on '{ground}' at [{centre[0]:.3f}, {centre[1]:.3f}, {centre[2]:.3f}] m"
        X_WS = _pose(self._scene, state, self._into) @ receiver.interior.X_OS
        p_S = X_WS.inverse().apply(centre)
        inside = room(receiver.interior, p_S)
        if inside >= 0.0:
            top = receiver.interior.rim
            return f"in '{self._into}'" if p_S[2] <= top else f"above the rim of '{self._into}', on '{ground}'"
        side = "beyond" if float((centre - X_WS.p)[:2] @ left[:2]) >= 0.0 else "before"
        return f"{readable(-inside, 'm')} {side} the rim of '{self._into}', on '{ground}'"


def _pose(scene: Scene, state: WorldState, name: str) -> Transform:
    pose = body_pose(scene, state, name)
    return Transform.of(xyz=pose.position, quat_xyzw=pose.quat_xyzw)
