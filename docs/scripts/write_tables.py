"""Writes the tables and controllers of task.md, robot.md, controllers.md and sensors.md in docs/reference/.

A table of fields is below a line `<!-- fields of BLOCK -->`; the blocks are models in `manipcli/spec/`. The sections of
controllers are between `<!-- begin of controllers -->` and `<!-- end of controllers -->`: each is the docstring of the
member's module and the fields of its spec. The text around them stays.

python docs/scripts/write_tables.py
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from inspect import cleandoc
from pathlib import Path
from textwrap import dedent
from typing import Any, Final, get_args

from pydantic import BaseModel
from write_steps import table

from manipcli.control.controller import ControllerMember
from manipcli.control.controllers import CONTROLLERS
from manipcli.plan.path_planners import PATH_PLANNERS
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensors import SENSORS
from manipcli.spec import (
    agree,
    baseline,
    clearance,
    controllers,
    inertials,
    mounted_sensor,
    plan,
    reactions,
    robot,
    sensors,
    task,
    vary,
)
from manipcli.spec.base import about
from manipcli.spec.controllers import ControllerSpec, GainsSpec
from manipcli.task.vocabulary import task_spec

FOLDER: Final = Path(__file__).parents[1] / "reference"
PAGES: Final = tuple(FOLDER / name for name in ("task.md", "robot.md", "controllers.md", "sensors.md"))
_MODULES: Final = (
    *(task, clearance, robot, controllers, reactions, vary, baseline, agree, plan, inertials),
    *(sensors, mounted_sensor),
)
_TABLE: Final = re.compile(r"(<!-- fields of (\w+) -->\n)(?:\|.*\n)*")
_TYPES: Final = re.compile(r"(<!-- types of controllers -->\n)(?:\|.*\n)*")
_SECTIONS: Final = re.compile(r"(<!-- begin of controllers -->\n).*(<!-- end of controllers -->)", re.DOTALL)


def renewed(page: str) -> str:
    """The text of a page with its tables and sections as the code has them."""
    page = _TABLE.sub(lambda found: f"{found[1]}{_fields(_model(found[2]))}\n", page)
    page = _TYPES.sub(lambda found: f"{found[1]}{_types()}\n", page)
    sections = "\n\n".join(part for member in CONTROLLERS for part in _section(member))
    return _SECTIONS.sub(lambda found: f"{found[1]}\n{sections}\n\n{found[2]}", page)


def _fields(model: type[BaseModel]) -> str:
    """The fields of a model; of a sensor without those that all have."""
    sensor = model in [member.spec for member in SENSORS]
    return table(model, beside=mounted_sensor.MountedFilteredSpec) if sensor else table(model)


def _model(name: str) -> type[BaseModel]:
    engines = {member.spec.__name__: member.spec for member in (*ENGINES, *PATH_PLANNERS, *SENSORS)}
    simulation = task_spec().model_fields["simulation"].default
    if name in engines or name == type(simulation).__name__:
        return engines.get(name, type(simulation))
    found: type[BaseModel] = next(getattr(module, name) for module in _MODULES if hasattr(module, name))
    return found


def _types() -> str:
    rows = [f"| [`{member.name}`](#{member.name}) | {about(member.spec)} |" for member in CONTROLLERS]
    return "\n".join(["| type | what it does |", "|---|---|", *rows])


def _section(member: ControllerMember[Any]) -> Iterator[str]:
    yield f"## {member.name}"
    # Lines between empty lines; those that are indented are code.
    for part in cleandoc(sys.modules[member.build.__module__].__doc__ or "").split("\n\n"):
        code = dedent(part)
        words = {"controllers:": "yaml", "manager[": "python"}
        kind = next((word for start, word in words.items() if code.startswith(start)), "text")
        yield part if code == part else f"```{kind}\n{code}\n```"
    yield table(member.spec, beside=ControllerSpec)
    for field in member.spec.model_fields.values():
        for kind in get_args(field.annotation):
            if isinstance(kind, type) and issubclass(kind, GainsSpec) and kind is not GainsSpec:
                yield "Its gains also have these fields:"
                yield table(kind, beside=GainsSpec)


if __name__ == "__main__":
    for path in PAGES:
        path.write_text(renewed(path.read_text(encoding="utf-8")), encoding="utf-8")
