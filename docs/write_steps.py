"""Writes docs/steps.md: what all steps have, and from their members an example and a table of fields each.

python docs/write_steps.py
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from inspect import cleandoc, getdoc
from pathlib import Path
from textwrap import dedent
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, BeforeValidator
from pydantic.fields import FieldInfo

from manipcli.core.units import readable
from manipcli.plan.step import StepMember
from manipcli.plan.steps import STEPS
from manipcli.spec.base import Model, about
from manipcli.spec.baseline import BaselineSpec
from manipcli.spec.condition import ConditionSpec, ExpectationSpec, WatchSpec
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec
from manipcli.spec.quantity import Unit
from manipcli.spec.reactions import ReplanSpec
from manipcli.spec.robot import (
    ActuatorSpec,
    AttachSpec,
    GroupSpec,
    LimitsSpec,
    PoseSpec,
    ToolSpec,
    TransmissionSpec,
)
from manipcli.spec.task import BodySpec, FrameSpec, RecordSpec, SimulationSpec, StepSpec
from manipcli.spec.vary import DistributionSpec, VarySpec

PAGE = Path(__file__).with_name("steps.md")
ELSEWHERE: dict[type, str] = {
    ConditionSpec: "a [condition](conditions.md)",
    ExpectationSpec: "[conditions](conditions.md)",
    WatchSpec: "[conditions](conditions.md)",
    StepSpec: "[steps](steps.md)",
    SimulationSpec: "a [mapping](task.md#simulation)",
    BodySpec: "[bodies](task.md#scene)",
    FrameSpec: "[frames](task.md#frames)",
    PoseSpec: "a [pose](task.md#poses)",
    RecordSpec: "a [mapping](task.md#record)",
    ReplanSpec: "a [mapping](task.md#replan)",
    VarySpec: "[distributions](task.md#vary)",
    DistributionSpec: "one of the first four",
    BaselineSpec: "a [mapping](task.md#baseline)",
    GroupSpec: "[groups](robot.md#groups)",
    ToolSpec: "a [mapping](robot.md#tool)",
    LimitsSpec: "[limits](robot.md#limits)",
    TransmissionSpec: "[transmissions](robot.md#transmissions-and-actuators)",
    ActuatorSpec: "[actuators](robot.md#transmissions-and-actuators)",
    AttachSpec: "[mappings](robot.md#attach)",
    GainsSpec: "[gains](controllers.md#gains)",
    ConstraintsSpec: "a [mapping](controllers.md#constraints)",
}
"""Blocks that are told in one place, and what stands for them everywhere else."""
INTRODUCTION = """\
# Steps

<!-- Written by docs/write_steps.py: change that, or the docstrings and fields of manipcli/plan/steps/. -->

`steps:` of a task is a list; each item has exactly one verb, and beside it what every step may have:

```yaml
steps:
  - pick: {object: cup}
  - pour: {object: cup, into: tray}
    id: pour
    until: {inside: {object: ball, of: tray}}
    timeout: 15 s
    on_fail: {retry: 2, with: {tilt: 140 deg}, then: continue}
  - move: {to: home}
```

Numbers are SI (m, rad, s, N), or text with a unit (`12 cm`, `90 deg`), or of `params:` (`$tilt`, `2 * $tilt + 5 deg`).
A range is one number of 0 or more, or `[least, most]` of such, of which the planner takes what it can: the middle
first, then the ends. The whole task is planned, step after step, before anything moves.

## What every step may have

"""


def page() -> str:
    """The whole text."""
    parts = [INTRODUCTION + table(StepSpec), "## The steps\n\n" + _contents()]
    parts += [part for one in STEPS for part in _section(one)]
    return "\n\n".join(parts)


def example(one: StepMember[Any]) -> str:
    """How it is written: the list in the docstring of its module."""
    _, _, after = cleandoc(sys.modules[one.plan.__module__].__doc__ or "").partition("\n\n")
    return dedent(after.partition("\n\n")[0]).strip("\n")


def _contents() -> str:
    return "\n".join(f"- [`{one.name}`](#{one.name}): {about(one.spec)}" for one in STEPS)


def _section(one: StepMember[Any]) -> Iterator[str]:
    yield f"### {one.name}"
    yield getdoc(one.spec) or ""
    yield f"```yaml\n{example(one)}\n```"
    yield table(one.spec)


def table(spec: type[BaseModel], *, beside: type[BaseModel] | None = None) -> str:
    """The fields of a block and of the blocks in it; without those that `beside`, which it is made of, has already."""
    known = {} if beside is None else beside.model_fields
    fields = {key: field for key, field in spec.model_fields.items() if key not in known}
    return "\n".join(["| field | type | default | meaning |", "|---|---|---|---|", *_rows(fields)])


def _rows(fields: Mapping[str, FieldInfo], before: str = "") -> Iterator[str]:
    for key, field in fields.items():
        if field.annotation is NoneType:
            continue
        name = f"{before}{field.alias or key}"
        kind = Annotated[field.annotation, *(field.metadata or [None])]
        default = "needed" if field.is_required() else _default(field.default, _unit(kind))
        meaning = field.description or ""
        if default != "-":
            meaning, _, again = meaning.partition(" Default ")
            meaning += f" {again}" if ": " in again else ""  # what the default means is not in its column
        yield f"| `{name}` | {_type(kind)} | {default} | {meaning} |"
        for block, within in _blocks(kind):
            yield from _rows(block.model_fields, f"{name}{within}.")


def _elsewhere(kind: object) -> str:
    """What stands for a block that has its own table; empty for others."""
    if isinstance(kind, type) and issubclass(kind, GainsSpec) and kind is not GainsSpec:
        return f"{ELSEWHERE[GainsSpec]}, and the fields below"
    return ELSEWHERE.get(kind, "") if isinstance(kind, type) else ""


def _parts(kind: object) -> tuple[object, ...]:
    """The types that a type is made of: of `Annotated` also what is said about it."""
    return () if get_origin(kind) is Literal else get_args(kind)


def _blocks(kind: object, within: str = "") -> Iterator[tuple[type[BaseModel], str]]:
    """The mappings with keys of their own in a type, but those that are told elsewhere."""
    if isinstance(kind, type) and issubclass(kind, Model) and not _elsewhere(kind):
        yield kind, within
    inside = {tuple: "[]", dict: ".NAME"}.get(get_origin(kind), within)
    for part in _parts(kind):
        yield from _blocks(part, inside)


def _unit(kind: object) -> str:
    """The symbol of the SI unit of the numbers in a type; empty where they have none, or one of several."""
    if isinstance(kind, Unit):
        return kind.dimensions[0].symbol if len(kind.dimensions) == 1 else ""
    return next((unit for part in _parts(kind) if (unit := _unit(part))), "")


def _default(value: object, unit: str) -> str:
    if isinstance(value, str | bool) and value != "":
        return f"`{str(value).lower() if isinstance(value, bool) else value}`"
    if isinstance(value, tuple) and value:
        return f"`[{', '.join(_default(one, unit).strip('`') for one in value)}]`"
    return f"`{readable(value, unit)}`" if isinstance(value, int | float) else "-"


_WORDS = {
    str: "text",
    bool: "true or false",
    int: "whole number",
    float: "number",
    Any: "anything",
}


def _type(kind: object) -> str:
    """What may be written, in words."""
    origin, parts = get_origin(kind), _parts(kind)
    if origin is Annotated:
        said = [one for part in parts[1:] for one in (part.metadata if isinstance(part, FieldInfo) else [part])]
        named = [re.sub(r"\ban? ", "", one.name) for one in said if isinstance(one, Unit)]
        named = ["number or percentage" if name == "plain number" else name for name in named]
        named = [name.replace("torque or energy or force", "torque or force") for name in named]
        short = [_type(one.json_schema_input_type) for one in said if isinstance(one, BeforeValidator)]
        return ", ".join([*(named or short or [_type(parts[0])]), *_bounds(said, _unit(kind))])
    if origin in (Union, UnionType):
        return ", or ".join(_type(part) for part in parts if part is not NoneType)
    if origin is Literal:
        return " or ".join(f"`{word}`" for word in get_args(kind))
    if origin is dict:
        return f"mapping of: {_type(parts[1])}"
    if origin is tuple:
        return f"list of: {_type(parts[0])}" if Ellipsis in parts else _fixed(tuple(map(_type, parts)))
    return _elsewhere(kind) or _WORDS.get(kind, "mapping")


def _fixed(items: tuple[str, ...]) -> str:
    """A list of fixed length; what bounds all of its items alike is said once."""
    word, _, bounds = next(iter(items), "").partition(", ")
    alike = bounds.startswith(tuple(_BOUNDS.values())) and len(set(items)) == 1
    return f"[{', '.join([word] * len(items))}], each {bounds}" if alike else f"[{', '.join(items)}]"


_BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def _bounds(said: list[Any], unit: str) -> Iterator[str]:
    for one in said:
        for key, word in _BOUNDS.items():
            if hasattr(one, key):
                yield f"{word} {readable(value, unit, digits=4) if (value := getattr(one, key)) else 0}"


if __name__ == "__main__":
    PAGE.write_text(page() + "\n", encoding="utf-8")
