"""The pages about the three files are those of the models, and what they show loads."""

from __future__ import annotations

import ast
import re
import runpy
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from manipcli.control.controller import ControllerMember
from manipcli.control.controllers import CONTROLLERS
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.load import load_controllers_text, load_robot_text, load_task_text
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import controllers_spec, task_spec

DOCS = Path(__file__).parents[2] / "docs" / "reference"
SCRIPTS = Path(__file__).parents[2] / "docs" / "scripts"
PAGES = ("task.md", "robot.md", "controllers.md")
HEAD = "task: t\nrobot: r\ncontrollers: c\nsteps: [wait: 1 s]\n"


def text(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def examples(page: str) -> list[str]:
    return re.findall(r"```yaml\n(.*?)```", text(page), re.DOTALL)


@pytest.mark.parametrize("page", PAGES)
def test_its_tables_are_those_of_the_models(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)
    renewed = runpy.run_path(str(SCRIPTS / "write_tables.py"))["renewed"]
    assert renewed(text(page)) == text(page), "run docs/scripts/write_tables.py"


@pytest.mark.parametrize("page", PAGES)
def test_every_link_leads_to_a_heading(page: str) -> None:
    for target, anchor in re.findall(r"\]\(([\w.]*\.md)?(?:#([\w-]+))?\)", text(page)):
        headings = re.findall(r"^#+ (.*)$", text(target or page), re.MULTILINE)
        anchors = {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}
        assert not anchor or anchor in anchors, (target, anchor)


@pytest.mark.parametrize("member", CONTROLLERS.members, ids=CONTROLLERS.names)
def test_every_type_of_controllers_has_a_section_with_its_fields(member: ControllerMember[Any]) -> None:
    section = text("controllers.md").partition(f"\n## {member.name}\n")[2].partition("\n## ")[0]
    own = [name for name in member.spec.model_fields if name not in ControllerSpec.model_fields]
    assert own == [name for name in own if f"| `{name}` |" in section]


def test_every_word_of_the_task_file_is_told() -> None:
    written = [key for key, field in TaskSpec.model_fields.items() if not field.exclude]
    assert [key for key in written if f"| `{key}` |" not in text("task.md")] == []


@pytest.mark.parametrize("example", examples("task.md"), ids=lambda e: e.split(":")[0])
def test_examples_of_the_task_file_load(example: str) -> None:
    whole = example if example.startswith("task:") else HEAD + example
    spec: BaseModel = load_task_text(whole, "t.yaml", model=task_spec()).spec
    assert spec.model_fields_set > {"task"}


@pytest.mark.parametrize("example", examples("robot.md"), ids=lambda e: e.split(":")[0])
def test_examples_of_the_robot_file_load(example: str) -> None:
    whole = example if example.startswith("robot:") else "robot: r\ndescription: r.urdf\n" + example
    assert load_robot_text(whole, "r.yaml").spec.model_fields_set > {"robot", "description"}


@pytest.mark.parametrize("example", examples("controllers.md"), ids=lambda e: e.split("type: ")[1].split()[0])
def test_examples_of_the_controllers_file_load(example: str) -> None:
    assert load_controllers_text(example, "c.yaml", model=controllers_spec()).spec.controllers


def test_the_program_of_the_controllers_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    links = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    joint = '<joint name="joint_{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><axis xyz="0 0 1"/>'
    (tmp_path / "r.urdf").write_text(
        '<robot name="r">'
        + "".join(links.format(name) + "</inertial></link>" for name in "abc")
        + "".join(
            joint.format(k, *names) + '<limit lower="-3" upper="3" effort="100" velocity="2"/></joint>'
            for k, names in enumerate(["ab", "bc"], start=1)
        )
        + "</robot>"
    )
    (tmp_path / "r.yaml").write_text("robot: r\ndescription: r.urdf\n")
    (example,) = (one for one in examples("controllers.md") if "forward_command" in one)
    (tmp_path / "c.yaml").write_text(example)
    (tmp_path / "task.yaml").write_text("task: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps: [wait: 1 s]\n")
    (program,) = re.findall(r"```python\n(from .*?)```", text("controllers.md"), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "controllers.md", "exec"), {})
    angles = ast.literal_eval(capsys.readouterr().out)
    assert angles == pytest.approx({"joint_1": 0.1, "joint_2": 0.0}, abs=2e-3)
