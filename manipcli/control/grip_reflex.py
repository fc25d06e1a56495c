"""Reflex of a hand: while it holds, it presses more where its taxels with shear report beginning slip.

The share of the friction cone that all taxels of the hand use together follows from what they measured, see
`model/friction_share.py`. While it is above the onset, the force grows with the rate

    dF/dt = min(RATE, GAIN (|T| / (mu onset) - N) / k)

where N and T are the sums of the normal and tangential forces and k is the number of links with taxels that press; from
the share (1 + onset) / 2 on, where the object slides and T is mu N whatever the load, with RATE. The force never falls
before the next goal. The PID goes on: the efforts u_0 that held F_0 when the reflex began are scaled,
u = PID + u_0 (F - F_0) / F_0. F_0 is the force of the goal, or what the taxels measured before, if that is more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.model.configuration import with_mimics
from manipcli.model.friction_share import friction_share, joint_forces
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import Reflex

RATE: Final = 100.0
"""[N/s] Largest growth of the force."""
GAIN: Final = 30.0
"""[1/s] Growth of the force per missing force; its product with the delays of sensor and hand is below 1."""
TOUCHES: Final = 0.1
"""Share of F_0 below which a sensor touches nothing: what it reports is noise."""
MEMORY: Final = 0.05
"""[s] Time constant of the measured force F_0."""
IDLE: Final = 1e-9
"""[N m or N] A joint with less effort does not press."""


@dataclass(frozen=True, slots=True, eq=False)
class Pad:
    """A sensor of taxels with shear on a hand.

    Attributes:
        link: that carries it.
        R_LS: (3, 3) rotation of its frame in the link.
        reading: (3 n) [N] what it measured last; always the same array.
    """

    link: str
    R_LS: Array
    reading: Array


class GripReflex:
    """The reflex of one hand; without pads, or without a goal that asks for it, it does nothing.

    Args:
        joints: number of joints of the hand.

    Attributes:
        extra: (joints) [N m or N] what it adds to the efforts of the fingers; always the same array.
        force: [N] that it commands now: F above.
    """

    def __init__(self, joints: int) -> None:
        self.extra = np.zeros(joints)
        self.force = 0.0
        self._pads: tuple[Pad, ...] = ()
        self._robot: RobotModel | None = None
        self._columns: list[int] = []
        self._kinematics: Kinematics
        self.begin(None, None)

    def attach(self, robot: RobotModel, joints: tuple[str, ...], pads: Sequence[Pad]) -> None:
        """Attach the pads, at least one, of the hand with these joints."""
        self._robot, self._columns, self._pads = robot, robot.indices(joints), tuple(pads)
        self._kinematics = Kinematics(robot)

    def begin(self, reflex: Reflex | None, force: float | None) -> None:
        """A goal with this force [N] begins: the hand presses with no more than it."""
        self._reflex = reflex if self._pads and force is not None else None
        self.force = self._first = force or 0.0
        self.extra[:] = 0.0
        self._pressed = self._presses = False
        self._held = self.extra
        self._most = np.inf
        self._limit = ""
        self._rotations: list[Array] = []
        self._told, self._count, self._measured = self.force, 0, self.force

    def update(self, period: float, position: Array, command: Array, effort: Array) -> bool:
        """One control tick of a hand that holds.

        Args:
            period: [s] of the tick.
            position: (joints) measured, rad or m.
            command: (joints) of the tick before, N m or N.
            effort: (joints) its limits.

        Returns:
            whether `extra` counts: whether it has pressed since the goal.
        """
        reflex = self._reflex
        if reflex is None:
            return self._pressed
        if not self._rotations:
            self._rotations = self._turned(position)
        normal, tangential = joint_forces([pad.reading for pad in self._pads], self._rotations)
        least = TOUCHES * self._first
        links = len({pad.link for pad in self._pads if pad.reading[: len(pad.reading) // 3].sum() > least})
        if not links:
            return self._pressed
        share = float(friction_share(normal, tangential, reflex.friction))
        grows = False
        if share > reflex.onset:
            if not self._pressed:
                self._first_press(reflex, command, effort)
            before = self.force
            missing = (float(tangential) / (reflex.friction * reflex.onset) - float(normal)) / links
            rate = RATE if share > 0.5 * (1.0 + reflex.onset) else min(RATE, GAIN * missing)
            self.force = max(before, min(before + period * rate, self._most))
            np.multiply(self._held, self.force / self._first - 1.0, out=self.extra)
            grows = self.force > before
        elif not self._pressed:
            self._measured += period / (period + MEMORY) * (float(normal) / links - self._measured)
        self._count += grows and not self._presses
        self._presses = grows
        return self._pressed

    def report(self) -> str:
        """`reflex: 8 N to 14.2 N in 2 presses`: what it did since the last call; "" for nothing."""
        if self.force <= self._told:
            return ""
        times = "" if self._count < 2 else f" in {self._count} presses"
        text = f"reflex: {readable(self._told, 'N')} to {readable(self.force, 'N')}{times}"
        self._told, self._count = self.force, 0
        return text if self.force < self._most else f"{text}, {self._limit}"

    def _first_press(self, reflex: Reflex, command: Array, effort: Array) -> None:
        """Take the efforts that hold F_0, and the largest force with the efforts' limits."""
        self._pressed = True
        self.force = self._told = self._first = max(self._first, self._measured)
        self._held = command.copy()
        presses = np.abs(command) > IDLE
        most = self._first * float(np.min(effort[presses] / np.abs(command[presses]), initial=np.inf))
        self._most, self._limit = most, "the effort limit of the hand"
        if reflex.force is not None and reflex.force < most:
            self._most, self._limit = reflex.force, "its limit"

    def _turned(self, position: Array) -> list[Array]:
        """(3, 3) of each pad, in a frame of the hand: the joints above it turn all pads alike."""
        robot = self._robot
        assert robot is not None  # there are pads
        q = np.zeros(len(robot.joint_names))
        q[self._columns] = position
        q = with_mimics(robot, q)
        return [self._kinematics.forward(q, pad.link).R @ pad.R_LS for pad in self._pads]
