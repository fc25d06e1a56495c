"""What every condition promises, over the registry: an example that loads anywhere, units, a place in the docs."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import pytest

from manipcli.conditions.condition import Condition
from manipcli.conditions.members import CONDITIONS
from manipcli.core.units import parse_unit
from manipcli.spec.condition import COMBINATIONS, QUANTIFIERS
from manipcli.spec.load import load_task_text
from manipcli.spec.resolved import resolved
from manipcli.spec.schema import task_schema
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

ROOT = Path(__file__).parents[2]
HEAD = "task: t\nrobot: r\ncontrollers: c\nsteps:\n  - id: lift_1\n    wait: 1 s\n"
each = pytest.mark.parametrize("member", CONDITIONS.members, ids=CONDITIONS.names)


def load(text: str) -> TaskSpec:
    spec = load_task_text(HEAD + text, "t.yaml", model=task_spec()).spec
    assert load_task_text(resolved(spec), "again.yaml", model=task_spec()).spec == spec
    return spec


@each
def test_its_example_can_stand_wherever_a_condition_can(member: Condition[Any]) -> None:
    one = "{" + member.example + "}"
    until = load(f"    until: {one}\n").steps[0].until
    assert until is not None
    assert (until.name, type(until.body)) == (member.name, member.spec)
    plain, timed, never, every = load(
        f"expect:\n  - {member.example}\n  - {member.example}\n    during: lift_1\n  - never: {one}\n"
        f"  - always: {{all: [{{not: {one}}}, {{any: [{one}]}}]}}\n"
    ).expect
    assert plain.body == timed.body == never.condition.body == until.body
    assert [one.name for one in every.condition.members] == ["not", "any"]


@each
def test_it_says_what_it_asks_and_in_which_units(member: Condition[Any]) -> None:
    assert (member.spec.__doc__ or "").strip().endswith((".", "`."))
    assert all(field.description for field in member.spec.model_fields.values())
    assert member.units
    for unit in member.units:
        assert unit == "" or parse_unit(unit).to_si(1.0) == 1.0
    assert member.example.startswith(f"{member.name}:")


def test_no_word_means_two_things() -> None:
    words = [*CONDITIONS.names, *COMBINATIONS, *QUANTIFIERS]
    assert len(set(words)) == len(words)


def test_the_schema_offers_every_word_under_one_of() -> None:
    schema = json.loads(task_schema(task_spec()))
    offered = {choice["$ref"].rpartition("/")[2] for choice in schema["properties"]["expect"]["items"]["oneOf"]}
    words = [*CONDITIONS.names, *COMBINATIONS, *QUANTIFIERS]
    assert {word for name in offered for word in schema["$defs"][name]["required"]} == set(words)
    assert len(schema["$defs"]["Condition"]["oneOf"]) == len(CONDITIONS.members) + len(COMBINATIONS)
    assert schema["$defs"]["AlwaysExpectation"]["properties"]["always"]["$ref"] == "#/$defs/Condition"
    assert schema["$defs"]["CollisionSpec"]["anyOf"][0]["type"] == ["array", "string"]  # or `$name`


def test_the_page_of_conditions_is_that_of_the_registry() -> None:
    written = runpy.run_path(str(ROOT / "docs" / "scripts" / "write_conditions.py"))["page"]()
    told = "run docs/scripts/write_conditions.py"
    assert (ROOT / "docs" / "reference" / "conditions.md").read_text(encoding="utf-8") == f"{written}\n", told
