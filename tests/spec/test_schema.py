"""JSON Schema and program agree: what is shipped, and every short way to write a block, is valid in both."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from manipcli import pipeline
from manipcli.core.errors import InvalidInput
from manipcli.spec.load import FileKind, kind_of, load_task_text, read_bytes
from manipcli.spec.source.tree import plain
from manipcli.spec.source.yaml import parse
from manipcli.task.vocabulary import task_spec

ROOT = Path(__file__).parents[2]
FOLDERS = ("tasks", "robots", "controllers", "examples", "manipcli/cli/project")
OTHERS = ("examples/03_ros_trajectory/controllers.yaml",)  # in a form of ROS
FILES = [
    file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.yaml")) if not str(file).endswith(OTHERS)
]
HEAD = "task: t\nrobot: r\ncontrollers: c\nparams: {far: 3 cm, dwell: 1 s}\n"


@cache
def _schema(kind: FileKind) -> Draft202012Validator:
    schema = pipeline.schema(kind)
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def _red(text: str | bytes, kind: FileKind = "task") -> list[str]:
    """What an editor would mark."""
    root = parse(text, "f.yaml")
    assert root is not None
    return [f"{error.json_path}: {error.message}" for error in _schema(kind).iter_errors(plain(root))]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_what_is_shipped_is_valid(file: Path) -> None:
    assert _red(read_bytes(file), kind_of(file)) == []


@pytest.mark.parametrize(
    "step",
    [
        "lift: {object: cup, by: 12 cm}", "lift: {object: cup, by: 0.12}", "lift: {object: cup, by: [8 cm, 0.2]}",
        "lift: {object: cup, by: $far}", "pick: {object: cup, approach: {distance: 10 cm}}",
        "pour: {object: cup, into: tray, clearance: 5 cm}", "place: {object: cup, clearance: 5 cm, retreat: 0.1}",
        "wait: 0.5 s", "wait: 1", "wait: $dwell", "wait: {duration: 1 s}", "release:", "release: {posture: open}",
        "switch_controllers: arm", "switch_controllers: [arm, hand]", "switch_controllers: {to: arm}",
        "switch_controllers: {to: [arm]}", "switch_controllers: {activate: [arm], strictness: best_effort}",
    ],
)  # fmt: skip
def test_each_way_to_write_a_step_is_valid_in_both(step: str) -> None:
    text = f"{HEAD}steps:\n  - {step}\n"
    load_task_text(text, "t.yaml", model=task_spec())
    assert _red(text) == []


@pytest.mark.parametrize("word", ["collision", "no_collision"])
@pytest.mark.parametrize("pairs", ["[robot, desk]", "{pairs: [[robot, desk]]}"])
def test_a_pair_may_stand_alone(word: str, pairs: str) -> None:
    text = f"{HEAD}steps: [wait: 1 s]\nexpect: [{{{word}: {pairs}}}]\n"
    load_task_text(text, "t.yaml", model=task_spec())
    assert _red(text) == []


@pytest.mark.parametrize("normal", ["[0, 1 cm]", "{mean: 0, sd: 1 cm}"])
def test_a_distribution_may_be_short(normal: str) -> None:
    text = f"{HEAD}steps: [wait: 1 s]\nvary: {{scene.cup.at: {{normal: {normal}}}}}\n"
    load_task_text(text, "t.yaml", model=task_spec())
    assert _red(text) == []


@pytest.mark.parametrize(
    ("by", "fits"),
    [
        ("8 cm", True), ("15 mm", True), ("1e-3 m", True), ("5 µm", True), ("2 in", True), ("8 kg", False),
        ("15 kg", False), ("1e-3 kg", False), ("8 centimetres", False), ("'8'", False), ("8 deg", False),
        ("2 * 4 cm", True), ("(4 cm + 1 cm)", True), ("1 m/s * 8 s", True), ("8 cm + 1 kg", None), ("kg", False),
    ],
)  # fmt: skip
def test_an_editor_marks_a_plain_unit_that_does_not_fit(by: str, fits: bool | None) -> None:
    """And nothing that the program takes; of what is computed only the program knows the dimension (None)."""
    text = f"{HEAD}steps:\n  - pour: {{object: cup, into: tray, clearance: {by}}}\n"
    assert bool(_red(text)) == (fits is False)
    if fits:
        load_task_text(text, "t.yaml", model=task_spec())
        return
    with pytest.raises(InvalidInput):
        load_task_text(text, "t.yaml", model=task_spec())


@pytest.mark.parametrize(
    "step",
    ["lift: {object: cup, by: [8 cm]}", "lift: {object: cup, by: true}", "lift:", "wait: true", "wait: soon",
     "switch_controllers: 1", "switch_controllers: {to: 1}"],
)  # fmt: skip
def test_what_the_program_refuses_is_red(step: str) -> None:
    text = f"{HEAD}steps:\n  - {step}\n"
    with pytest.raises(InvalidInput):
        load_task_text(text, "t.yaml", model=task_spec())
    assert _red(text) != []


@pytest.mark.parametrize(
    ("step", "hint"),
    [
        ("move: home", "write {to: ...}"), ("pick: cup", "write {object: ...}"),
        ("release: open", "write {posture: ...}"), ("pour: cup", "write {object: ..., into: ...}"),
    ],
)  # fmt: skip
def test_a_word_in_place_of_a_mapping_is_told_what_to_write(step: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        load_task_text(f"{HEAD}steps:\n  - {step}\n", "t.yaml", model=task_spec())
    (found,) = caught.value.findings
    assert "expected a mapping, not '" in found.message
    assert found.hint == hint
