"""`tolerance` of a pose of the tool, as it is written.

- move: {pose: {...}, tolerance: {distance: 1 mm, rotation: 2 deg}}
- move: {pose: {...}, tolerance: {about: {axis: z}}}
- move: {pose: {...}, tolerance: {about: {axis: [0, 0, 1], within: 30 deg}}}
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from manipcli.core.geometry import Transform
from manipcli.plan.inverse_kinematics import ANGLE_TOLERANCE, POSITION_TOLERANCE
from manipcli.plan.pose_error import RESOLUTION, Open, PoseTolerance
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Angle, AngleTolerance, Length

AXES = "xyz"


class AboutSpec(Model):
    """An axis about which the tool may be rotated from its pose."""

    axis: Literal["x", "y", "z"] | tuple[float, float, float] = Field(
        description="`x`, `y` or `z` of the tool at the goal, or a direction in `frame`."
    )
    within: AngleTolerance = Field(math.pi, description="How far, to both sides [rad]. Default: freely.")

    @model_validator(mode="after")
    def _directed(self) -> AboutSpec:
        if not isinstance(self.axis, str) and not any(self.axis):
            raise problem("conflict", "the axis has length 0", at=("axis",), hint="the vertical is [0, 0, 1]")
        return self


class ToleranceSpec(Model):
    """How far from its pose the tool may be planned. An exact solution is preferred where there is one."""

    distance: Annotated[Length, Field(ge=POSITION_TOLERANCE, le=1.0)] = Field(
        RESOLUTION.distance, description="Of its origin [m], at least 0.01 mm."
    )
    rotation: Annotated[Angle, Field(ge=ANGLE_TOLERANCE, le=math.pi)] = Field(
        RESOLUTION.rotation, description="Of its orientation [rad], at least 0.1 mrad."
    )
    about: AboutSpec | None = Field(None, description="An axis about which it may be rotated further. Default: none.")

    def of(self, X_WF: Transform, X_WG: Transform, open_: Open) -> PoseTolerance:
        """The tolerance of a goal X_WG that leaves `open_` open and is given in frame F."""
        if self.about is None:
            return PoseTolerance(self.distance, self.rotation, open_)
        if isinstance(self.about.axis, str):
            axis = X_WG.R[:, AXES.index(self.about.axis)]
        else:
            axis = X_WF.R @ np.array(self.about.axis) / np.linalg.norm(self.about.axis)
        return PoseTolerance(self.distance, self.rotation, open_, axis, self.about.within)
