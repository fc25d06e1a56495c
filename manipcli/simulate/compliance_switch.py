"""Switching of the arm to its compliant controller before a compliant motion, and back before the next one without."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from manipcli.control.compliant_arm import Compliant, complies
from manipcli.control.manager import ControllerManager
from manipcli.control.pressing import LEAST, PressingReference
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, frozen
from manipcli.plan.compliance import Pressing
from manipcli.plan.motion import Motion, Switch
from manipcli.plan.trajectory import JointTrajectory
from manipcli.simulate.session import Session

MEAN = 1.0
"""[s] Time constant of the mean from which the tool drops."""
TOO_LONG = 0.05
"""[s] A force above the most is too much for longer than this: an impact of rigid bodies lasts a tick or a few."""
BLEND = 0.5
"""[s] Time in which a trajectory that begins elsewhere than planned joins its plan."""
HOLDING_SPEED = 0.002
"""[m/s] At which a force that a guarded motion stopped at follows what it presses on."""
HOLDING_REACH = 0.05
"""[m] As far as it follows."""
TOGETHER = 1e-12
"""[rad or m] Below this a trajectory begins where it was planned."""


class ComplianceSwitch:
    """The compliant controller of a session's arm; its controllers change without a step of the reference.

    Args:
        session: of the run.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._mean, self._passed, self._over = math.nan, False, 0.0

    @property
    def _manager(self) -> ControllerManager:
        return self._session.manager

    @property
    def _arm(self) -> Compliant | None:
        return next((own for own in self._manager.controllers if complies(own)), None)

    @property
    def _pressing(self) -> PressingReference | None:
        arm = self._arm
        return None if arm is None else arm.pressing

    def ends_held(self, motion: Motion) -> bool:
        """Whether a motion ends when its force has been held; in an engine without forces it ends after its time."""
        return motion.compliance is not None and motion.compliance.ends_held and not self._session.engine.ideal

    @property
    def presses_yet(self) -> bool:
        """Whether the force of the motion has not been held for its time."""
        own = self._pressing
        return own is not None and own.held < (own.pressing.hold or 0.0)

    @property
    def failure(self) -> str:
        """Why the force cannot be reached; "" where it may be."""
        own = self._pressing
        return "" if own is None else own.missed

    def passed(self, motion: Motion) -> bool:
        """Whether the motion is over because the tool is beyond its plane, dropped, or feels too much; asked at every
        tick."""
        until = None if motion.compliance is None else motion.compliance.until
        if until is None or (arm := self._arm) is None:
            return False
        along = float(until.normal @ arm.tool)
        if math.isnan(self._mean):
            self._mean = along
        self._mean += (along - self._mean) * min(1.0, self._session.period / MEAN)
        self._passed = along >= until.offset or (until.drop is not None and along - self._mean >= until.drop)
        over = float(np.linalg.norm(arm.felt[:3])) > until.most
        self._over = self._over + self._session.period if over else 0.0
        return self._passed or self._over > TOO_LONG

    @property
    def felt(self) -> str:
        """What was felt in the motion, in words."""
        own = self._pressing
        return "the arm has no goal" if own is None else own.text

    def result(self, motion: Motion) -> tuple[str, str]:
        """What was felt in a motion with a force that has ended, and why that is a failure; "" where it is none."""
        own = self._pressing
        until = None if motion.compliance is None else motion.compliance.until
        if until is not None and until.otherwise and not self._passed:
            return "", until.otherwise
        if motion.compliance is None or motion.compliance.force is None or own is None:
            return "", ""
        if until is not None:
            return f"{motion.label}: {own.text}", ""
        return own.text, "" if motion.compliance.ends_held else own.unsteady

    def before(self, motion: Motion) -> JointTrajectory | None:
        """Switch as a motion needs it; its trajectory, which begins at the present reference of the arm.

        Raises:
            InvalidArgument: no controller complies, or the switch was refused.
        """
        arm, trajectory = self._arm, motion.trajectory
        self._mean, self._passed, self._over = math.nan, False, 0.0
        if self._session.engine.ideal:
            return trajectory  # without physics nothing yields
        if motion.compliance is None:
            if arm is None or not arm.replaces or (trajectory is None and motion.switch is None):
                return trajectory
            if not self._manager.is_active(arm.name):  # a step has switched
                arm.replaces = ()
                return trajectory
            if trajectory is not None and not set(trajectory.names) & set(arm.joints):
                return trajectory
            self._switch(arm.replaces)
            arm.replaces = ()
            return self._joined(trajectory, arm, self._session.state.position)
        if arm is None:
            raise InvalidArgument("CTRL152", f"no compliant controller moves the arm for the motion '{motion.label}'")
        fresh = not self._manager.is_active(arm.name)
        if fresh:
            arm.replaces = self._switch((arm.name,))
        if motion.compliance.here:
            arm.deactivate(self._session.time)
        arm.comply(motion.compliance)
        if fresh:
            return self._joined(trajectory, arm, self._session.state.position)
        reference = np.array(self._session.state.position)
        reference[self._session.robot.indices(arm.joints)] = arm.output.position
        return self._joined(trajectory, arm, reference, stays=motion.compliance.relative)

    def holding(self, motion: Motion) -> Callable[[], str]:
        """Holds the force that is felt now along one axis, once a guarded motion has stopped; says what it holds."""
        arm, compliance = self._arm, motion.compliance
        if arm is None or compliance is None or compliance.force is not None:
            return str
        felt = arm.felt[:3]
        k = int(np.argmax(np.abs(felt)))
        force = abs(float(felt[k]))
        if force < LEAST:
            return str
        pressing = Pressing(frozen(np.sign(felt[k]) * np.eye(3)[k]), force, HOLDING_SPEED, HOLDING_REACH)

        def hold() -> str:
            arm.comply(replace(compliance, force=pressing))
            return f"; it stays and presses with {force:.3g} N"

        return hold

    def relax(self) -> None:
        """Give up the force with which the arm presses, if it does: the arm stays compliant at its reference."""
        if self._arm is not None:
            self._arm.relax()

    def _switch(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """The controllers that were deactivated."""
        done = self._manager.carry_out(Switch(to=names), time=self._session.time)
        if not done.ok:
            raise InvalidArgument("CTRL152", "; ".join(done.messages))
        return done.deactivated

    def _joined(
        self, trajectory: JointTrajectory | None, arm: Compliant, position: Array, *, stays: bool = False
    ) -> JointTrajectory | None:
        """The trajectory from `position` (n), which it leaves with minimum jerk for its plan unless it `stays` off."""
        if trajectory is None:
            return None
        off = position[self._session.robot.indices(trajectory.names)] - trajectory.positions[0]
        off[[name not in arm.joints for name in trajectory.names]] = 0.0
        if np.abs(off).max() < TOGETHER:
            return trajectory
        if stays:
            own = trajectory
            return JointTrajectory.of_arrays(
                own.names, own.times, own.positions + off, own.velocities, own.accelerations
            )
        span = max(min(BLEND, trajectory.duration), self._session.period)
        u = np.clip((trajectory.times - trajectory.times[0]) / span, 0.0, 1.0)
        curves = (
            1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2),
            -30.0 * u**2 * (1.0 - u) ** 2 / span,
            -60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / span**2,
        )
        given = (trajectory.positions, trajectory.velocities, trajectory.accelerations)
        q, v, a = (None if row is None else row + np.outer(c, off) for row, c in zip(given, curves, strict=True))
        assert q is not None
        return JointTrajectory.of_arrays(trajectory.names, trajectory.times, q, v, a)
