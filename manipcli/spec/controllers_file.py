"""The controllers file as a whole. Each entry is a controller; the key `type` says which type, by our short name or by
ROS's long one."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.robot import Version


class ControllersSpec(Model):
    """Controllers: who moves which joints, and by what law."""

    # The file as a whole, after ROS's own forms have been rewritten to this one.

    types: ClassVar[Mapping[str, type[ControllerSpec]]] = MappingProxyType({})
    """The specs of the members, by the word under `type`; `unions.controllers_model` fills it."""

    version: Version = None
    controllers: dict[str, ControllerSpec] = Field(description="The controllers, by name.")
