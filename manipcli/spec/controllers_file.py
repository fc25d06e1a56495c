"""The controllers file as a whole. One entry a controller; the key `type` says which (the short name, or ROS's long
one)."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.controllers import GripperSpec, JointTrajectorySpec
from manipcli.spec.other_controllers import (
    CartesianImpedanceSpec,
    ComputedTorqueSpec,
    ForceTorqueBroadcasterSpec,
    ForwardCommandSpec,
    JointStateBroadcasterSpec,
    PidSpec,
)
from manipcli.spec.robot import Version

AnyController = Annotated[
    JointTrajectorySpec
    | GripperSpec
    | ComputedTorqueSpec
    | CartesianImpedanceSpec
    | ForwardCommandSpec
    | PidSpec
    | JointStateBroadcasterSpec
    | ForceTorqueBroadcasterSpec,
    Field(discriminator="type"),
]
"""One of the types of controllers; which, says `type`."""


class ControllersSpec(Model):
    """Controllers: who moves which joints, and by what law."""

    # The file as a whole, after ROS's own forms have been rewritten to this one.
    version: Version = None
    controllers: dict[str, AnyController] = Field(description="The controllers, by name.")
