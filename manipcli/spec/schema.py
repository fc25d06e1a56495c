"""JSON Schema of task, robot and controllers files, for editors and reference; deterministic."""

from __future__ import annotations

import json
from functools import cache

from pydantic import BaseModel

from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.quantity import SIGNED
from manipcli.spec.robot import RobotSpec
from manipcli.spec.schema_names import TaskNames, list_names
from manipcli.spec.source.tree import Plain
from manipcli.spec.structure.json_schema import add_structure
from manipcli.spec.task import TaskSpec

_DRAFT = "https://json-schema.org/draft/2020-12/schema"
_LIMITS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
_REFERENCE = r"\$[A-Za-z_]"
_LIST = r"^\s*\$[A-Za-z_]\w*\s*$"


def task_schema(model: type[TaskSpec], names: TaskNames | None = None) -> str:
    """Schema of a task file (`unions.task_model`): verbs are `oneOf`; any number may be an expression with `$name`.

    With the `names` of one task, it knows these, and its parameters.
    """
    schema = _schema(model, "manipcli task")
    _allow_expressions(schema)
    add_structure(schema)
    list_names(schema, names)
    return _dump(schema)


def robot_schema(model: type[RobotSpec]) -> str:
    """Schema of a robot file (`unions.robot_model`)."""
    return _dump(_schema(model, "manipcli robot"))


def controllers_schema(model: type[ControllersSpec]) -> str:
    """Schema of a controllers file in our form (`unions.controllers_model`)."""
    return _dump(_schema(model, "manipcli controllers"))


def _schema(model: type[BaseModel], title: str) -> dict[str, Plain]:
    schema: dict[str, Plain] = json.loads(_generated(model))
    _tidy(schema, named=False)
    return {"$schema": _DRAFT, **schema, "title": title}


@cache
def _generated(model: type[BaseModel]) -> str:
    """The schema by pydantic, which takes half a second for tasks: once per process, also for many tasks."""
    return json.dumps(model.model_json_schema())


def _tidy(node: Plain, *, named: bool) -> None:
    """Replaces pydantic's keywords for limits by those of JSON Schema, and removes titles that repeat a key.

    Args:
        node: schema, changed in place.
        named: whether its keys are names of properties or definitions instead of keywords.
    """
    if isinstance(node, list):
        for item in node:
            _tidy(item, named=False)
    if not isinstance(node, dict):
        return
    if not named:
        node.pop("title", None)
        for own, word in _LIMITS.items():
            if own in node:
                node[word] = node.pop(own)
        _sign(node)
    for key, value in node.items():
        if key not in ("default", "enum", "const") or named:
            _tidy(value, named=not named and key in ("properties", "$defs"))


def _sign(node: dict[str, Plain]) -> None:
    """Refuses a minus before a quantity in text that must not be negative, unless arithmetic follows."""
    pattern = node.get("pattern")
    least = node.get("minimum", node.get("exclusiveMinimum"))
    if isinstance(pattern, str) and pattern.startswith(SIGNED) and isinstance(least, int | float) and least >= 0:
        rest = pattern.removeprefix(SIGNED)
        node["pattern"] = rf"{SIGNED}[^-+*/]*(?:\s[-+*/]\s|\))|^[+(\s]*{rest}"


def _allow_expressions(node: Plain) -> None:
    if isinstance(node, list):
        for item in node:
            _allow_expressions(item)
    if not isinstance(node, dict):
        return
    kind = node.get("type")
    if kind in ("number", "integer", "boolean"):
        node["type"], node["pattern"] = [kind, "string"], _REFERENCE
    if kind == "array":
        node["type"], node["pattern"] = [kind, "string"], _LIST
    if isinstance(node.get("enum"), list) and kind == "string":
        node["anyOf"] = [{"enum": node.pop("enum")}, {"pattern": _REFERENCE}]
    for key, value in node.items():
        if key not in ("default", "enum", "const", "anyOf") or (key == "anyOf" and kind is None):
            _allow_expressions(value)


def _dump(schema: dict[str, Plain]) -> str:
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
