"""The schema for one task, by an independent validator: it refuses faulty files, and accepts every task and example."""

from __future__ import annotations

import copy
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from manipcli import pipeline
from manipcli.spec.source.tree import plain
from manipcli.spec.source.yaml import parse

ROOT = Path(__file__).parents[2]
POUR = ROOT / "tasks" / "pour.yaml"
SOUND = sorted([*(ROOT / "tasks").glob("*.yaml"), *(ROOT / "examples").glob("*/task.yaml")])
GONE = "<gone>"


def read(path: Path) -> Any:
    node = parse(path.read_bytes(), str(path))
    assert node is not None
    return plain(node)


@cache
def validator() -> Draft202012Validator:
    schema = pipeline.schema("task", task=POUR)
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def changed(path: str, value: object) -> Any:
    """The pour with another value at a dotted path; `GONE` removes it."""
    root = copy.deepcopy(read(POUR))
    *above, last = path.split(".")
    node = root
    for part in above:
        node = node[int(part)] if isinstance(node, list) else node.setdefault(part, {})
    if value is GONE:
        del node[last]
    elif isinstance(node, list):
        node[int(last)] = value
    else:
        node[last] = value
    return root


FAULTY: list[tuple[str, object]] = [
    # misspelt keys
    ("tsak", "pour"), ("scene.cup.cupp", {}), ("scene.cup.frictoin", 1.0), ("steps.0.pick.aproach", {}),
    ("steps.1.lift.bye", "8 cm"), ("steps.2.unti", {}), ("simulation.enigne", "pybullet"), ("record.topcis", []),
    ("steps.3", {"plase": {"object": "cup", "at": "start"}}), ("expect.0", {"insde": {"object": "ball", "of": "tray"}}),
    ("frames.f.pse", {}), ("replan", {"positon": "5 mm"}), ("agree.margn", "5 %"), ("clearance.defalt", "4 mm"),
    # wrong units
    ("scene.cup.mass", "150 mm"), ("scene.cup.cup.radius", "36 g"), ("steps.2.timeout", "15 m"),
    ("steps.1.lift.by", "8 deg"), ("steps.2.pour.dwell", "1 cm"), ("simulation.step", "1 mm"),
    ("expect.1.upright.within", "5 cm"), ("expect.2.near.within", "2 deg"), ("steps.2.pour.tilt", "125 cm"),
    ("steps.5.wait", "0.5 kg"), ("steps.0.pick.grasp.force", "8 kg"), ("scene.ball.sphere.radius", "14 s"),
    # wrong signs and ranges
    ("scene.cup.mass", "-150 g"), ("scene.cup.mass", -0.15), ("scene.cup.friction", -1), ("steps.2.timeout", "-15 s"),
    ("scene.cup.cup.radius", "-36 mm"), ("simulation.step", "-1 ms"), ("expect.2.near.within", "-2 cm"),
    ("scene.cup.restitution", 1.5), ("scene.cup.cup.segments", 3), ("scene.cup.color", [1, 0, 0, 2]),
    ("steps.2.on_fail", {"retry": 0}), ("steps.5.wait", "-1 s"), ("simulation.seed", -1),
    # wrong shapes of values
    ("steps", {"pick": {"object": "cup"}}), ("steps.3", "place"), ("scene.cup.at", [0.75]), ("scene.cup.at", "here"),
    ("scene.tray.tray.size", [0.3, 0.3]), ("floor", "maybe"), ("tags", "slow"), ("steps.0.pick", "cup"),
    ("expect", {"inside": {"object": "ball", "of": "tray"}}), ("expect.4.no_collision.pairs", [["robot"]]),
    ("scene.desk", None), ("steps.3", {"place": {"object": "cup"}, "lift": {"object": "cup"}}), ("task", GONE),
    ("robot", GONE), ("steps", GONE), ("expect.1.upright", {"object": "cup"}), ("steps.2.until", "ball in tray"),
    # unknown names of this task
    ("steps.0.pick.object", "cupp"), ("steps.2.pour.into", "trey"), ("steps.2.pour.tilt", "$tlt"), ("start", "hme"),
    ("steps.4.move.to", "hom"), ("steps.4.move.to", {"join_1": 0.1}), ("expect.0.inside.object", "bal"),
    ("expect.3.tracking.group", "arms"), ("expect.4.no_collision.pairs", [["robot/plm", "desk"]]),
    ("scene.cup.rests_on", "dsk"), ("steps.0.pick.object", "desk"), ("expect.1.during", "lift_2"),
    ("steps.2.pour.into", "desk"), ("steps.5", {"switch_controllers": {"activate": ["arm_contoller"]}}),
]  # fmt: skip


def test_there_are_enough_faulty_files() -> None:
    assert len(FAULTY) >= 67


@pytest.mark.parametrize(("path", "value"), FAULTY, ids=lambda part: str(part)[:40])
def test_a_faulty_file_is_refused(path: str, value: object) -> None:
    assert not validator().is_valid(changed(path, value))


@pytest.mark.parametrize("path", SOUND, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_task_and_example_is_accepted(path: Path) -> None:
    schema = Draft202012Validator(pipeline.schema("task", task=path))
    assert [error.message for error in schema.iter_errors(read(path))] == []


def test_names_of_a_faulty_task_are_known(tmp_path: Path) -> None:
    text = POUR.read_text().replace("../robots", f"{ROOT}/robots").replace("../controllers", f"{ROOT}/controllers")
    (tmp_path / "t.yaml").write_text(text.replace("object: cup, at: start", "object: cup, att: start"))
    schema = Draft202012Validator(pipeline.schema("task", task=tmp_path / "t.yaml"))
    assert not schema.is_valid(changed("steps.0.pick.object", "cupp"))
    (tmp_path / "t.yaml").write_text(text.replace("arm7_hand3/robot.yaml", "nowhere.yaml"))
    schema = Draft202012Validator(pipeline.schema("task", task=tmp_path / "t.yaml"))
    assert not schema.is_valid(changed("steps.0.pick.object", "cupp"))
    assert schema.is_valid(changed("steps.4.move.to", "hom")), "the robot is not known"


QUANTITIES = [
    ("150 g", True), ("0.15", False), ("+150 g", True), ("-150 g", False), ("(1 + 2) * 50 g", True),
    ("-50 g + 200 g", True), ("$tilt", True), ("2 * $tilt", True), ("$nothing", False), ("- 150 g", False),
]  # fmt: skip


@pytest.mark.parametrize(("text", "sound"), QUANTITIES)
def test_the_sign_of_a_quantity(text: str, sound: bool) -> None:
    assert validator().is_valid(changed("scene.cup.mass", text)) is sound
