"""Specs of sensors that are mounted on a link or fixed in the scene, and of those that measure numbers."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.names import FrameName, LinkName
from manipcli.spec.quantity import Frequency
from manipcli.spec.robot import PoseSpec
from manipcli.spec.sensors import SensorSpec


class FilteredSpec(SensorSpec):
    """A sensor that measures numbers."""

    filter: Annotated[Frequency, Field(gt=0)] | None = Field(
        None, description="Cut-off frequency of a first-order low pass before sampling [Hz]. Default: none."
    )


class MountedSpec(SensorSpec):
    """A sensor at a pose in a link of the robot or, in a task, in a frame of the scene."""

    link: LinkName | None = Field(None, description="Link that carries it; in a robot file it is required.")
    frame: FrameName | None = Field(
        None,
        description="Only in a task, instead of `link`: `world`, `base`, a body or a named frame. Default `world`.",
    )
    at: PoseSpec = Field(PoseSpec(), description="Pose of the sensor frame S in `link` or `frame`. Default: identity.")


class MountedFilteredSpec(MountedSpec, FilteredSpec):
    """A mounted sensor that measures numbers."""
