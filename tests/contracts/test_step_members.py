"""What every step promises, over the registry: an example that loads, texts for its fields, a place in the docs."""

from __future__ import annotations

import runpy
from pathlib import Path
from textwrap import indent
from typing import Any

import pytest

from manipcli.plan.step import StepMember
from manipcli.plan.steps import STEPS
from manipcli.spec.base import about
from manipcli.spec.load import load_task_text
from manipcli.task.vocabulary import task_spec

DOCS = Path(__file__).parents[2] / "docs"
WRITTEN = runpy.run_path(str(DOCS / "scripts" / "write_steps.py"))
HEAD = "task: t\nrobot: r\ncontrollers: c\nsteps:\n"


@pytest.mark.parametrize("member", STEPS.members, ids=STEPS.names)
def test_its_example_loads_and_is_of_it(member: StepMember[Any]) -> None:
    spec = load_task_text(HEAD + indent(WRITTEN["example"](member), "  "), "t.yaml", model=task_spec()).spec
    assert {step.verb for step in spec.steps} == {member.name}


@pytest.mark.parametrize("member", STEPS.members, ids=STEPS.names)
def test_it_says_what_it_does(member: StepMember[Any]) -> None:
    assert about(member.spec).endswith(".")


def test_the_page_of_steps_is_that_of_the_registry() -> None:
    told = "run docs/scripts/write_steps.py"
    assert (DOCS / "reference" / "steps.md").read_text(encoding="utf-8") == f"{WRITTEN['page']()}\n", told


def test_every_field_has_a_type_and_a_meaning() -> None:
    told = {}
    for section in WRITTEN["page"]().split("\n### "):
        verb = section.splitlines()[0]
        rows = [line.split(" | ") for line in section.splitlines() if line.startswith("| `")]
        told |= {(verb, row[0].strip("| `")): row[1:] for row in rows}
    assert [name for name, (kind, _, meaning) in told.items() if not kind or not meaning.strip(" |")] == []
    # Written down by hand once, from what the program does.
    assert told["pick", "grasp.height"][:2] == ["length", "-"]
    assert told["lift", "by"][:2] == ["length, or [length, length]", "`[80 mm, 200 mm]`"]
    assert told["pour", "tilt"][:2] == ["angle, above 0, at most 180 deg", "`120 deg`"]
    assert told["follow", "points[].time_from_start"][:2] == ["time, or mapping", "needed"]
    assert told["# Steps", "timeout"][:2] == ["time, at most 3600 s, above 0", "-"]
    assert {("# Steps", "id"), ("# Steps", "until"), ("# Steps", "on_fail.retry")} <= told.keys()
    assert {("pick", "approach.from"), ("place", "retreat"), ("move", "to")} <= told.keys()
