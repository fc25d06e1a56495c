"""What every clause promises, over the registries: it can be put into a sentence, and says what the file says."""

from __future__ import annotations

import re
import runpy
from functools import cache
from pathlib import Path
from textwrap import indent
from typing import Any

import pytest

from manipcli.conditions.condition import Condition
from manipcli.conditions.members import CONDITIONS
from manipcli.model.robot import RobotModel
from manipcli.plan.keeps import KEEPS
from manipcli.plan.step import StepMember
from manipcli.plan.steps import STEPS
from manipcli.spec.base import Model
from manipcli.spec.keep import KeepSpec
from manipcli.spec.load import load_task_text
from manipcli.spec.source.tree import node_at
from manipcli.task.origins import Origins
from manipcli.task.robot_file import read_robot
from manipcli.task.vocabulary import task_spec

ROOT = Path(__file__).parents[2]
EXAMPLE = runpy.run_path(str(ROOT / "docs" / "scripts" / "write_steps.py"))["example"]
HEAD = "task: t\nrobot: r\ncontrollers: c\nsteps:\n"
KEPT = {
    "upright": {"upright": "10 deg"},
    "above": {"above": "desk", "by": "5 cm"},
    "inside": {"inside": {"box": {"centre": [0, 0, 0.5], "size": [1, 1, 1]}, "frame": "desk"}},
    "tool_speed": {"tool_speed": "25 cm/s"},
    "tool_acceleration": {"tool_acceleration": 2.0},
    "slosh": {"slosh": "15 deg"},
}


@cache
def robot() -> RobotModel:
    return read_robot(ROOT / "robots" / "arm7_hand3" / "robot.yaml")[1]


def refuse_unsaid(clause: str, body: Model, node: object) -> None:
    """Every name that is written is in the clause; it fits into a sentence."""
    assert clause == clause.strip()
    assert not clause.endswith((".", ":", ","))
    assert clause[0] in "'" or clause[0].islower()
    assert not re.search(r"None|True|False|  |\{|Spec\(", clause), clause
    values = Origins(None, robot()).block(body, node, given=True)  # type: ignore[arg-type]
    for value in values:
        for name in re.findall(r"'([^']*)'", value.value):
            plain = {"robot": "robot", "tool": "tool", "world": "", "start": "start", "top": "above", "free": ""}
            word = plain.get(name, name.removeprefix("robot/"))
            assert word in clause or value.path in ("path", "until", "strictness"), (clause, value)


@pytest.mark.parametrize("member", STEPS.members, ids=STEPS.names)
def test_the_examples_of_a_step(member: StepMember[Any]) -> None:
    text = HEAD + indent(EXAMPLE(member), "  ")
    found = load_task_text(text, "t.yaml", model=task_spec())
    for k, step in enumerate(found.spec.steps):
        clause = member.clause(step.body, robot())
        refuse_unsaid(clause, step.body, node_at(found.source.root, ("steps", k, member.name)))
    different = {repr(step.body) for step in found.spec.steps}
    assert len({member.clause(step.body, robot()) for step in found.spec.steps}) == len(different)


@pytest.mark.parametrize("member", CONDITIONS.members, ids=CONDITIONS.names)
def test_the_example_of_a_condition(member: Condition[Any]) -> None:
    found = load_task_text(
        f"{HEAD}  - id: lift_1\n    wait: 1\nexpect:\n  - {member.example}\n", "t", model=task_spec()
    )
    body = found.spec.expect[0].body
    node = node_at(found.source.root, ("expect", 0, member.name))
    clause = member.clause(body, robot())
    refuse_unsaid(clause, body, node)
    for value in Origins(None, robot()).block(body, node, given=True):
        number = re.fullmatch(r"[\d.]+ [a-zA-Z/%]+", value.value)
        assert number is None or number.group() in clause, (clause, value)


@pytest.mark.parametrize("word", KEEPS.names)
def test_a_constraint(word: str) -> None:
    spec = KeepSpec.model_validate(KEPT[word])
    clause = KEEPS[word].clause(spec)
    assert clause[0].islower()
    assert "None" not in clause
    assert ("desk" in str(KEPT[word])) == ("'desk'" in clause)
