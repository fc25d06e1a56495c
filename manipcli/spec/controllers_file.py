"""Spec of a controllers file. The key `type` of an entry is a short name, or the long name that ROS uses."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.robot import Version


class ControllersSpec(Model):
    """Controllers: which joints each one commands, and its control law."""

    # Files in one of ROS's forms are rewritten to this form first.

    types: ClassVar[Mapping[str, type[ControllerSpec]]] = MappingProxyType({})
    """Specs of the members by type; `unions.controllers_model` fills it."""

    version: Version = None
    compat: Literal["ros1", "ros2"] | None = Field(
        None,
        description="Whose behaviour to follow where ROS 1 and ROS 2 differ, if the robot file has no `compat`. "
        "Default: `ros2` for a file in the form of ROS 2, otherwise the safer behaviour in each case.",
    )
    controllers: dict[str, ControllerSpec] = Field(description="The controllers, by name.")
