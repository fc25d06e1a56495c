"""Types of fields that name something of the task or its robot; the JSON Schema for a task lists its names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

NameKind = Literal[
    "body", "movable", "container", "part", "frame", "joint", "scene_joint", "group", "pose", "link", "step",
    "controller", "sensor",
]  # fmt: skip
"""What a name is of. `movable` and `container` are bodies; `part`: a body, `robot` or `robot/LINK`; `frame`: `world`,
`base`, `tool`, a body, a part of one, a named frame; `joint`: of the robot; `step`: a step or a block of steps."""
MARK: Final = "x-names"
"""Keyword of a schema that holds the kind, before names are listed or left out."""


@dataclass(frozen=True, slots=True)
class Names:
    """Metadata of an annotated string: what it names."""

    kind: NameKind

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return {**handler(schema), MARK: self.kind}


BodyName = Annotated[str, Names("body")]
MovableName = Annotated[str, Names("movable")]
ContainerName = Annotated[str, Names("container")]
PartName = Annotated[str, Names("part")]
FrameName = Annotated[str, Names("frame")]
JointName = Annotated[str, Names("joint")]
SceneJointName = Annotated[str, Names("scene_joint")]
GroupName = Annotated[str, Names("group")]
PoseName = Annotated[str, Names("pose")]
LinkName = Annotated[str, Names("link")]
StepName = Annotated[str, Names("step")]
ControllerName = Annotated[str, Names("controller")]
SensorRef = Annotated[str, Names("sensor")]
