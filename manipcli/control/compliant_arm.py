"""The compliant controller of an arm whose joints take efforts: an impedance whose numbers each motion sets.

It is `cartesian_impedance` along the axes of the reference, and a force (`pressing.py`) by what is felt
(`felt_force.py`). A new `Compliance` makes no step in the force along the axis: the shift of the reference is carried
over in proportion to the stiffness; without a new force it is given up smoothly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeGuard

import numpy as np

from manipcli.control.controller import BuildContext, Controller, JointState
from manipcli.control.controllers.cartesian_impedance import CartesianImpedanceController
from manipcli.control.felt_force import FeltForce
from manipcli.control.pressing import PressingReference, Relaxing
from manipcli.core.geometry import Array, Transform
from manipcli.plan.compliance import Compliance


class Compliant(Controller, Protocol):
    """A controller that takes the numbers of a compliant motion."""

    pressing: PressingReference | None
    tool: Array

    def comply(self, compliance: Compliance) -> None:
        """Obey this compliance from the next update on; without a step in the force."""
        ...


def complies(controller: Controller) -> TypeGuard[Compliant]:
    """Whether it is a compliant controller of an arm."""
    return isinstance(controller, CompliantArm)


class CompliantArm(CartesianImpedanceController):
    """The impedance of an arm, of which each motion sets stiffness and force.

    Args:
        name: of the controller.
        joints: of the arm.
        felt: the felt force, updated before it.
        link, offset: the tool frame T is at `offset` X_LT in the link.
        context: robot and kinematics.

    Attributes:
        pressing: the force; None without one.
        tool: (3,) [m] the origin of the compliant frame in the world, at the last update.
    """

    def __init__(
        self, name: str, joints: Sequence[str], felt: FeltForce, link: str, offset: Transform, context: BuildContext
    ) -> None:
        described = [context.robot.joint(joint) for joint in joints]
        super().__init__(
            name=name, joints=joints, kinematics=context.kinematics(), link=link, offset=offset,
            stiffness=Compliance.of().stiffness, axes="tool", limits=[joint.limits for joint in described],
            types=[joint.type for joint in described], compat=context.compat, stop_planner=context.stop_planner,
        )  # fmt: skip
        self.pressing: PressingReference | None = None
        self._felt, self._tool = felt, offset
        self._relaxing: Relaxing | None = None
        self._compliance = Compliance.of()
        self._shift: Array = np.zeros(3)
        self._fresh = True

    def comply(self, compliance: Compliance) -> None:
        """Obey this compliance from the next update on; what is felt at the activation is felt as zero."""
        before, self._compliance = self._compliance, compliance
        if compliance is before and not self._fresh:
            return
        self._stiffness = self._six("stiffness", compliance.stiffness)
        self._scale = 2.0 * np.sqrt(self._stiffness)
        self._updates = 0
        self._offset = self._tool if compliance.X_TC is None else self._tool @ compliance.X_TC
        if self._fresh:
            self._shift[:] = 0.0
            self._felt.tare()
        self._shift *= before.stiffness[:3] / np.maximum(self._stiffness[:3], 1e-9)
        force, last, self._relaxing, self._fresh = compliance.force, self.pressing, None, False
        self.pressing = None
        if force is not None:
            along, shift = float(np.abs(force.axis) @ self._stiffness[:3]), float(force.axis @ self._shift)
            contact = shift if last is not None and last.touching else None
            self.pressing = PressingReference(force, along, shift=shift, contact=contact)
        elif self._shift.any():
            self._relaxing = Relaxing(self._shift.copy())

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
        super().deactivate(time, reason)
        self._fresh, self.pressing, self._relaxing = True, None, None
        self._shift[:] = 0.0

    def _refer(self, time: float, period: float, measured: JointState) -> None:
        super()._refer(time, period, measured)
        if self._relaxing is not None:
            self._shift[:] = self._relaxing.update(period)
        elif self.pressing is not None and not self._felt.taring:
            axis, felt = self.pressing.pressing.axis, self._along(self.pressing)
            stretch = float(axis @ self._stretch[:3])
            self._shift[:] = self.pressing.update(period, felt, stretch) * axis

    def _along(self, pressing: PressingReference) -> float:
        """[N] the felt force along the axis of the force."""
        X, force = self._compliance.X_TC, self._felt.wrench[:3]
        return float(pressing.pressing.axis @ (force if X is None else X.R.T @ force))
