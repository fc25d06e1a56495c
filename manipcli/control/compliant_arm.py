"""The compliant controllers of an arm: an impedance where its joints take efforts, an admittance where positions.

The numbers are those of each motion (`Compliance`), along the axes of the reference R. With the shift s of
`compliant_shift.py` and the felt force f of `felt_force.py`:

Impedance: `cartesian_impedance`, whose spring is stretched by s besides.

Admittance: the commanded pose is displaced from R by x, which a virtual mass obeys,

    M x'' + D x' + K (x - s) = -f,    D = 2 zeta sqrt(CONTACT M),

so that f = K s in contact with something that does not move. D is critical for a contact of the stiffness `CONTACT`,
which is much more than for the spring K. The joints follow by x = J dq, corrected at every update for what remains.
Hogan, Impedance control (1985); Seraji, Adaptive admittance control (1994).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, Protocol, TypeGuard

import numpy as np

from manipcli.control.compliant_shift import CompliantShift
from manipcli.control.controller import BuildContext, Controller, ControllerOutput, JointState
from manipcli.control.felt_force import FeltForce
from manipcli.control.impedance_controller import CartesianImpedanceController
from manipcli.control.pressing import PressingReference
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.plan.compliance import Compliance
from manipcli.plan.pose_error import rotation_vector

CONTACT: Final = np.array([2e4, 2e4, 2e4, 200.0, 200.0, 200.0])
"""[N/m, N m/rad] Stiffness of a contact for which the admittance is damped."""
MASS: Final = np.array([10.0, 10.0, 10.0, 0.1, 0.1, 0.1])
"""[kg, kg m2] The virtual inertia of the admittance."""
SINGULAR: Final = 1e-3
"""Directions in which the joints move the tool less than this [m or rad per rad] do not yield."""


class Compliant(Controller, Protocol):
    """A controller that takes the numbers of a compliant motion."""

    tool: Array
    """(3,) [m] the origin of the compliant frame in the world, at the last update."""
    replaces: tuple[str, ...]
    """The controllers that were deactivated for it, and are activated again after it."""

    @property
    def pressing(self) -> PressingReference | None:
        """The force with which it presses; None without one."""
        ...

    @property
    def felt(self) -> Array:
        """(6,) what the tool exerts, in the axes of the compliant frame [N, N m]."""
        ...

    def comply(self, compliance: Compliance) -> None:
        """Obey this compliance from the next update on, without a step in the force."""
        ...

    def relax(self) -> None:
        """Give up its force from the next update on, without a step."""
        ...


def complies(controller: Controller) -> TypeGuard[Compliant]:
    """Whether it is a compliant controller of an arm."""
    return isinstance(controller, ImpedanceArm | AdmittanceArm)


def replaced(controllers: Iterable[Controller]) -> tuple[str, ...]:
    """The controllers that a compliant one has replaced, and that return before the next motion without compliance."""
    return tuple(name for own in controllers if complies(own) for name in own.replaces)


class ImpedanceArm(CartesianImpedanceController):
    """The impedance of an arm, of which each motion sets stiffness and force.

    Args:
        name: of the controller.
        joints: of the arm.
        felt: the felt force, updated before it.
        link, offset: the tool frame T is at `offset` X_LT in the link.
        context: robot and kinematics.
    """

    def __init__(
        self, name: str, joints: Sequence[str], felt: FeltForce, link: str, offset: Transform, context: BuildContext
    ) -> None:
        described = [context.robot.joint(joint) for joint in joints]
        self._law = CompliantShift(felt)
        super().__init__(
            name=name, joints=joints, kinematics=context.kinematics(), link=link, offset=offset,
            stiffness=self._law.compliance.stiffness, axes="tool", limits=[joint.limits for joint in described],
            types=[joint.type for joint in described], compat=context.compat, stop_planner=context.stop_planner,
        )  # fmt: skip
        self._tool = offset
        self.replaces: tuple[str, ...] = ()
        self._shift = self._law.value

    @property
    def pressing(self) -> PressingReference | None:
        """The force with which it presses; None without one."""
        return self._law.pressing

    @property
    def felt(self) -> Array:
        """(6,) what the tool exerts, in the axes of the compliant frame [N, N m]."""
        return self._law.wrench()

    def comply(self, compliance: Compliance) -> None:
        """Obey this compliance from the next update on; what is felt at the activation is felt as zero."""
        if self._law.obey(compliance):
            self._stiffness = self._six("stiffness", compliance.stiffness)
            self._scale = 2.0 * np.sqrt(self._stiffness)
            self._updates = 0
            self._offset = self._tool if compliance.X_TC is None else self._tool @ compliance.X_TC

    def relax(self) -> None:
        """Give up its force from the next update on, without a step."""
        self._law.relax()

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
        super().deactivate(time, reason)
        self._law.reset()

    def _refer(self, time: float, period: float, measured: JointState) -> None:
        super()._refer(time, period, measured)
        self._law.update(period, self._stretch[:3])


class AdmittanceArm(JointTrajectoryController):
    """The admittance of an arm, of which each motion sets stiffness and force; see `ImpedanceArm` for the arguments."""

    def __init__(
        self, name: str, joints: Sequence[str], felt: FeltForce, link: str, offset: Transform, context: BuildContext
    ) -> None:
        described = [context.robot.joint(joint) for joint in joints]
        super().__init__(
            name=name, joints=joints, command_interfaces=("position",), limits=[joint.limits for joint in described],
            types=[joint.type for joint in described], compat=context.compat, stop_planner=context.stop_planner,
        )  # fmt: skip
        self._kinematics, self._link, self._tool = context.kinematics(), link, offset
        self._frame = offset
        self._law = CompliantShift(felt)
        self._columns = context.robot.indices(self.joints)
        self._q = np.zeros(len(context.robot.joint_names))
        self._displaced = np.zeros(len(self.joints))
        self._x, self._rate = np.zeros((2, 6))
        self.tool: Array = np.full(3, np.nan)
        self.replaces: tuple[str, ...] = ()

    @property
    def pressing(self) -> PressingReference | None:
        """The force with which it presses; None without one."""
        return self._law.pressing

    @property
    def felt(self) -> Array:
        """(6,) what the tool exerts, in the axes of the compliant frame [N, N m]."""
        return self._law.wrench()

    def comply(self, compliance: Compliance) -> None:
        """Obey this compliance from the next update on; what is felt at the activation is felt as zero."""
        if self._law.obey(compliance):
            self._frame = self._tool if compliance.X_TC is None else self._tool @ compliance.X_TC

    def relax(self) -> None:
        """Give up its force from the next update on, without a step."""
        self._law.relax()

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
        super().deactivate(time, reason)
        self._law.reset()
        self._displaced[:], self._x[:], self._rate[:] = 0.0, 0.0, 0.0

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s]."""
        output = super().update(time, period, measured, contact_force=contact_force)
        self._law.update(period, self._law.value - self._x[:3])
        self._yield(period)
        q, columns, kinematics = self._q, self._columns, self._kinematics
        q[columns] = output.command
        R_WR, p_WR, _ = kinematics.pose_and_jacobian(q, self._link, self._frame)
        angle = float(np.sqrt(self._x[3:] @ self._x[3:]))
        turned = R_WR if angle < 1e-9 else R_WR @ matrix_from_axis_angle(self._x[3:] / angle, angle)
        q[columns] += self._displaced
        R, p, J = kinematics.pose_and_jacobian(q, self._link, self._frame)
        self.tool, J = p, J[:, columns]
        error = np.concatenate([p_WR + R_WR @ self._x[:3] - p, rotation_vector(turned @ R.T)])
        self._displaced += J.T @ np.linalg.solve(J @ J.T + SINGULAR**2 * np.eye(6), error)
        output.commands[0][:] += self._displaced
        return output

    def _yield(self, period: float) -> None:
        """Advance the virtual mass, implicitly in its speed."""
        stiffness = self._law.compliance.stiffness
        damping = 2.0 * np.sqrt(np.maximum(CONTACT, stiffness) * MASS)
        away = self._x.copy()
        away[:3] -= self._law.value
        force = -self._law.wrench() - stiffness * away
        self._rate = (MASS * self._rate + period * force) / (MASS + period * damping + period**2 * stiffness)
        self._x += period * self._rate
