"""Steps that cannot succeed are found from the file alone, all at once; what the planner would allow is not refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.spec.block import BlockSpec
from manipcli.task.held_objects import HANDS_FULL, NO_HOLLOW, NOT_HELD, TOO_SMALL, impossible_steps
from manipcli.task.load_task import load_task
from manipcli.task.plan_steps import plan_step
from manipcli.task.plan_task import unplanned
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
HEAD = f"""task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  a: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, rests_on: table, at: [0.5, -0.2]}}
  b: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, rests_on: table, at: [0.5, 0]}}
  cup: {{cup: {{radius: 3 cm, height: 8 cm}}, mass: 100 g, rests_on: table, at: [0.45, 0.2]}}
  ball: {{sphere: {{radius: 2 cm}}, mass: 10 g, inside: cup}}
  pot: {{cup: {{radius: 1.5 cm, height: 3 cm}}, mass: 100 g, rests_on: table, at: [0.6, 0.25]}}
steps:
"""
PICK, LIFT = "  - pick: {object: a}\n", "  - lift: {object: a}\n"
PLACE = "  - place: {object: a, at: [0.35, -0.25], onto: table}\n"
POUR = "  - pour: {object: cup, into: "


def load(folder: Path, steps: str) -> Task:
    file = folder / "task.yaml"
    file.write_text(HEAD + steps)
    return load_task(file, allow_outside=True)


def codes(folder: Path, steps: str) -> list[tuple[str, int]]:
    """(code, line of the step from 1) of all findings."""
    with pytest.raises(InvalidInput) as invalid:
        load(folder, steps)
    first = HEAD.count("\n")
    return [(one.code, one.place.line - first if one.place else 0) for one in invalid.value.findings]


def test_all_of_them_are_reported_at_once_with_the_line_of_each(tmp_path: Path) -> None:
    steps = LIFT + PLACE + PLACE + PICK + "  - pick: {object: b}\n" + PICK.replace("a}", "b}")
    assert codes(tmp_path, steps) == [
        (f"TASK{NOT_HELD}", 1),
        (f"TASK{NOT_HELD}", 3),
        (f"TASK{HANDS_FULL}", 5),
        (f"TASK{HANDS_FULL}", 6),
    ]


@pytest.mark.parametrize(
    ("steps", "number"),
    [
        ("  - pick: {object: a}\n  - pour: {object: a, into: cup}\n", NO_HOLLOW),
        ("  - pick: {object: cup}\n" + POUR + "table}\n", NO_HOLLOW),
        ("  - pick: {object: cup}\n" + POUR + "pot}\n", TOO_SMALL),
        ("  - pick: {object: a}\n  - place: {object: a, at: [0.6, 0.25], onto: pot}\n", TOO_SMALL),
    ],
)
def test_hollows_are_needed_and_large_enough(tmp_path: Path, steps: str, number: int) -> None:
    assert codes(tmp_path, steps) == [(f"TASK{number}", 2)]


def test_a_mesh_that_is_one_convex_part_has_no_hollow(tmp_path: Path) -> None:
    """A tetrahedron; as parts it might have one."""
    corners = ["0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1"]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    (tmp_path / "wedge.obj").write_text(
        "".join(f"v {p}\n" for p in corners) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    )
    wedge = "  wedge: {mesh: {file: wedge.obj}, mass: 100 g, pose: {xyz: [0.6, 0.1, 0.2]}}\nsteps:\n"
    file = tmp_path / "task.yaml"
    file.write_text(HEAD.replace("steps:\n", wedge) + "  - pick: {object: cup}\n" + POUR + "wedge}\n")
    with pytest.raises(InvalidInput) as invalid:
        load_task(file, allow_outside=True)
    (found,) = invalid.value.findings
    assert found.code == f"TASK{NO_HOLLOW}"
    assert found.message.endswith("nothing can be poured into 'wedge': it is one convex part, which has no hollow")
    assert found.hint == "a mesh with a hollow has `collision: parts`; containers: cup, pot"


@pytest.mark.parametrize("steps", [PICK + LIFT, PICK + PLACE + PICK, "  - grasp: {object: a}\n" + LIFT])
def test_what_is_held_in_order_is_not_refused(tmp_path: Path, steps: str) -> None:
    assert load(tmp_path, steps).spec.steps


def test_the_planner_refuses_what_is_refused(tmp_path: Path) -> None:
    """The planner, one step after the other, is the oracle."""
    task = load(tmp_path, PICK + LIFT + PLACE)
    for order, number in (((1,), NOT_HELD), ((0, 1, 2, 1), NOT_HELD), ((0, 0), HANDS_FULL)):
        steps = tuple(task.spec.steps[k] for k in order)
        [found] = impossible_steps(task.spec.model_copy(update={"steps": steps}), task.scene)
        assert (found.step, found.number) == (len(steps) - 1, number)
        nothing = unplanned(task)
        state = nothing.start
        for step in steps[:-1]:
            state = plan_step(nothing.planner, step, state).end
        with pytest.raises(NotPlannable) as refused:
            plan_step(nothing.planner, steps[-1], state)
        assert refused.value.cause == found.message


def test_behind_a_branch_every_outcome_counts(tmp_path: Path) -> None:
    task = load(tmp_path, PICK + LIFT + PLACE)
    lift, place = task.spec.steps[1:]
    pick = task.spec.steps[0]

    def numbers(kind: str, *steps: object, first: int, last: int, split: int = -1) -> list[tuple[int, int]]:
        block = BlockSpec.model_validate(
            {"id": "x", "kind": kind, "word": kind, "first": first, "last": last, "split": split}
        )
        spec = task.spec.model_copy(update={"steps": steps, "blocks": (block,)})
        return [(found.step, found.number) for found in impossible_steps(spec, task.scene)]

    assert numbers("if", pick, lift, place, first=0, last=1, split=1) == []  # it may be held
    assert numbers("if", pick, place, lift, first=1, last=2, split=2) == []  # it may still be held
    assert numbers("if", pick, place, place, lift, first=1, last=3, split=2) == [(3, NOT_HELD)]
    assert numbers("sequence", pick, place, lift, first=0, last=2) == [(2, NOT_HELD)]
    assert numbers("parallel", pick, lift, first=0, last=2) == []
