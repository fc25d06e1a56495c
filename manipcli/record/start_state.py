"""State of a running task at the start of a step, from which another run can begin; its attachment in logs."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, fields
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.core.text import escape

_BELIEF: Final = ("uncertain", "believed", "covariances")
START_STATE: Final = "start_state.json"
"""The attachment of a run that begins with the state of another run."""
LARGEST: Final = 1e6
"""No position, velocity or reference of a run that was not damaged is larger [SI]."""
UNIT: Final = 1e-6
"""Largest difference of the length of a quaternion from 1; logs have 64-bit numbers."""


@dataclass(frozen=True, slots=True)
class StartState:
    """The state of a run at one control tick.

    Attributes:
        log: name of the log that it is from.
        sha256: of that file.
        step: id of the step that begins with it.
        time: [s] in that log.
        joints: (n) names of the moving joints.
        position, velocity: (n) [rad or m, per second].
        reference: (n) positions commanded by the active controllers; NaN for uncommanded joints.
        bodies: (m) names of the movable bodies.
        poses: (m, 7) x y z [m] and quaternion xyzw of each body's frame O in the world.
        twists: (m, 6) velocity of O [m/s] and angular velocity [rad/s], in the world.
        active: names of the active controllers that command joints; `inactive`: of the others.
        held: the body in the hand; "" without one.
        closed: the hand was closed to hold something, and not opened since.
        uncertain: names of the uncertain bodies; () if all poses are known exactly.
        believed: (m, 7) the poses of all bodies as the robot believes them; (0, 7) without uncertain ones.
        covariances: (u, 36) of the beliefs about the uncertain ones, see `Belief`.
    """

    log: str
    sha256: str
    step: str
    time: float
    joints: tuple[str, ...]
    position: Array
    velocity: Array
    reference: Array
    bodies: tuple[str, ...]
    poses: Array
    twists: Array
    active: tuple[str, ...]
    inactive: tuple[str, ...]
    held: str
    closed: bool
    uncertain: tuple[str, ...] = ()
    believed: Array = field(default_factory=lambda: np.zeros((0, 7)))
    covariances: Array = field(default_factory=lambda: np.zeros((0, 36)))

    @property
    def planned(self) -> Array:
        """(m, 7) the poses of all bodies for planning: the believed ones."""
        return self.believed if self.uncertain else self.poses

    def to_json(self) -> bytes:
        """The attachment; numbers are exact, and an unknown reference is null."""
        names = [each.name for each in fields(self) if self.uncertain or each.name not in _BELIEF]
        values = {name: getattr(self, name) for name in names}
        return json.dumps({name: _plain(value) for name, value in values.items()}, indent=1).encode()

    @staticmethod
    def from_json(content: bytes) -> StartState:
        """The inverse of `to_json`.

        Raises:
            ValueError: the content is damaged.
        """
        try:
            read = json.loads(content)
            state = StartState(
                log=str(read["log"]),
                sha256=str(read["sha256"]),
                step=str(read["step"]),
                time=float(read["time"]),
                joints=tuple(map(str, read["joints"])),
                position=_array(read["position"]),
                velocity=_array(read["velocity"]),
                reference=_array(read["reference"]),
                bodies=tuple(map(str, read["bodies"])),
                poses=_array(read["poses"]).reshape(-1, 7),
                twists=_array(read["twists"]).reshape(-1, 6),
                active=tuple(map(str, read["active"])),
                inactive=tuple(map(str, read["inactive"])),
                held=str(read["held"]),
                closed=bool(read["closed"]),
                uncertain=tuple(map(str, read.get("uncertain", ()))),
                believed=_array(read.get("believed", ())).reshape(-1, 7),
                covariances=_array(read.get("covariances", ())).reshape(-1, 36),
            )
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise ValueError(f"has a damaged {START_STATE}") from error
        if state.damage:
            raise ValueError(f"has a damaged {START_STATE}: {state.damage}")
        return state

    @property
    def damage(self) -> str:
        """Why no run can begin with it: sizes, or numbers that no run reaches; "" if one can."""
        n, m, u = len(self.joints), len(self.bodies), len(self.uncertain)
        sizes: list[tuple[Array, tuple[int, ...]]] = [
            (self.position, (n,)), (self.velocity, (n,)), (self.reference, (n,)),
            (self.poses, (m, 7)), (self.twists, (m, 6)),
            (self.believed, (m if u else 0, 7)), (self.covariances, (u, 36)),
        ]  # fmt: skip
        if any(values.shape != size for values, size in sizes):
            return "its lists have different lengths"
        known = [values for values, _ in sizes if values is not self.reference]
        if not (np.isfinite(self.time) and all(np.isfinite(values).all() for values in known)):
            return "a number is missing or not finite"
        if any((np.abs(values) > LARGEST).any() for values, _ in sizes):
            return f"a number is above {LARGEST:g}"
        if any((np.abs(np.linalg.norm(a[:, 3:], axis=1) - 1.0) > UNIT).any() for a in (self.poses, self.believed)):
            return "a quaternion is not of length 1"
        if not set(self.uncertain) <= set(self.bodies):
            return "an uncertain body is not one of its bodies"
        if self.held and self.held not in self.bodies:
            return f"it holds '{escape(self.held)}', which is not one of its bodies"
        return ""


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return [_plain(row) for row in value.tolist()]
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _array(value: object) -> Array:
    return frozen(np.array(value, dtype=np.float64))
