"""Conditions over selections: the margin against sorting by hand, and what is wrong with a selection."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from manipcli.conditions.clauses import condition_clause
from manipcli.conditions.condition import CheckContext, World
from manipcli.conditions.formula import absent, opened, problems
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import nth_greatest, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.model.state import WorldState
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.spec.condition import ConditionSpec
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec
from tests.conditions.test_conditions import ROBOT

COUNT = 7
SEEN: dict[str, Any] = {
    "tray": {"tray": {"size": [0.3, 0.2, 0.05], "wall": 0.01}, "pose": {"xyz": [0, 0, 0]}, "fixed": True},
    "ball": {"sphere": {"radius": 0.006}, "mass": 0.001, "count": COUNT, "inside": "tray"},
}


def scene() -> Scene:
    bodies = {name: BodySpec.model_validate(body) for name, body in SEEN.items()}
    return build_scene(TaskSpec.model_construct(task="t", floor=False, scene=bodies))


SCENE = scene()
CONTEXT = CheckContext(ROBOT, SCENE)


def spec(written: dict[str, Any]) -> ConditionSpec:
    expectation = task_spec().model_fields["expect"].annotation
    (found,) = TypeAdapter(expectation).validate_python([written])
    assert isinstance(found, ConditionSpec)
    return found


def states(x: np.ndarray[Any, Any]) -> WorldState:
    """Balls (T, m) at x along the tray."""
    T, m = x.shape
    p = np.stack([x, np.zeros_like(x), np.full_like(x, 0.02)], axis=-1)
    zero = np.zeros((T, len(ROBOT.moving_joints)))
    return WorldState(
        time=np.arange(T) * 1e-3, position=zero, velocity=zero, effort=zero, body_position=p,
        body_quat_xyzw=np.tile([0.0, 0.0, 0.0, 1.0], (T, m, 1)), body_linear=np.zeros((T, m, 3)),
        body_angular=np.zeros((T, m, 3)),
    )  # fmt: skip


def margins(written: dict[str, Any], x: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    seen = states(x)
    world = World(ROBOT, SCENE, seen.map(lambda a: a[0]))
    return opened(spec(written), world, CONDITIONS)(StateWindow(seen, None, (), (), ())).margins


INSIDE = {"inside": {"object": "ball[*]", "of": "tray"}}


@pytest.mark.parametrize("n", range(1, COUNT + 1))
def test_the_margin_is_the_nth_greatest_and_its_sign_counts(n: int) -> None:
    x = np.random.default_rng(n).uniform(-0.3, 0.3, (50, COUNT))
    each = np.stack([margins({"inside": {"object": f"ball[{k}]", "of": "tray"}}, x) for k in range(COUNT)])
    found = margins({"at_least": {"n": n, **INSIDE}}, x)
    assert np.array_equal(found, np.sort(each, axis=0)[COUNT - n])
    assert np.array_equal(found >= 0.0, (each >= 0.0).sum(axis=0) >= n)
    if n == 1:
        assert np.array_equal(found, margins({"any_of": INSIDE}, x))
    if n == COUNT:
        assert np.array_equal(found, margins({"all_of": INSIDE}, x))


@pytest.mark.parametrize(
    ("short", "full"),
    [
        ({"inside": "tray"}, {"inside": {"object": "ball[*]", "of": "tray"}}),
        ({"inside": {"of": "tray"}}, {"inside": {"object": "ball[*]", "of": "tray"}}),
        ({"upright": 0.2}, {"upright": {"object": "ball[*]", "within": 0.2}}),
        ({"at_rest": None}, {"at_rest": {"object": "ball[*]"}}),
        ({"not": {"rests_on": "tray"}}, {"not": {"rests_on": {"object": "ball[*]", "of": "tray"}}}),
        (
            {"any": [{"inside": "tray"}, {"near": {"to": [0, 0, 0], "within": 0.1}}]},
            {"any": [{"inside": {"object": "ball[*]", "of": "tray"}},
                     {"near": {"object": "ball[*]", "to": [0, 0, 0], "within": 0.1}}]},
        ),
    ],
)  # fmt: skip
def test_of_is_the_object_of_the_condition(short: dict[str, Any], full: dict[str, Any]) -> None:
    (found,), (wanted,) = spec({"any_of": {"of": "ball[*]", **short}}).members, spec({"any_of": full}).members
    assert found.model_dump(exclude={"of"}) == wanted.model_dump(exclude={"of"})
    again = spec({"any_of": found.model_dump(exclude_none=True, exclude_unset=True)})  # the log has it in full
    assert again.members[0] == found


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ({"at_least": {"of": "ball[*]", "inside": "tray"}}, "`at_least` needs `n`"),
        ({"all_of": {"n": 2, "of": "ball[*]", "inside": "tray"}}, "`all_of` takes no `n`"),
        ({"all_of": {"of": "ball[*]", "inside": {"object": "ball[1]", "of": "tray"}}}, "both `of: 'ball[*]'` and"),
        ({"all_of": {"of": "ball[*]", "energy": {"below": 1}}}, "`energy` has no `object`"),
        ({"all_of": {"of": "ball[*]", "near": "tray"}}, "near"),
        ({"all_of": {"of": "ball[*]"}}, "a condition needs a name"),
        ({"all_of": {"of": "ball[*]", "inside": "tray", "at_rest": None}}, "not both"),
    ],
)
def test_what_cannot_be_over_a_selection(written: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words.replace("[", r"\[").replace("*", r"\*")):
        spec(written)


def test_it_combines_as_any_other_condition() -> None:
    x = np.random.default_rng(0).uniform(-0.3, 0.3, (50, COUNT))
    outside = {"not": {"any_of": INSIDE}}
    assert np.array_equal(margins(outside, x) >= 0.0, margins({"all_of": {"not": INSIDE}}, x) >= 0.0)


def test_the_text_counts_those_that_hold_and_names_the_body_that_decides() -> None:
    times = np.zeros(1)
    readings = [
        robustness(np.array([value]), times, unit="m", scale=1.0, describe=lambda _, k=k: f"body {k}")
        for k, value in enumerate((0.3, -0.2, 0.1))
    ]
    measured = nth_greatest(readings, 2).found(0)
    assert (measured.margin, measured.text) == (0.1, "2 of 3: body 2")


def test_a_margin_that_is_not_a_number_is_not_lost() -> None:
    readings = [
        robustness(np.array([value]), np.zeros(1), unit="m", scale=1.0, describe=str) for value in (0.3, np.nan, 0.1)
    ]
    assert all(np.isnan(nth_greatest(readings, n).margins[0]) for n in (1, 2, 3))


def test_without_physics_the_first_body_says_why() -> None:
    world = World(ROBOT, SCENE, states(np.zeros((1, COUNT))).map(lambda a: a[0]), physics=False)
    reason = absent(spec({"all_of": INSIDE}), world, CONDITIONS)
    assert reason is not None
    assert "'ball[0]'" in reason


def test_its_clause() -> None:
    written = spec({"at_least": {"n": 5, **INSIDE}})
    assert condition_clause(written, ROBOT, CONDITIONS) == "for at least 5 of 'ball[*]', 'ball[*]' is inside 'tray'"


@pytest.mark.parametrize(
    ("written", "loc", "words"),
    [
        ({"at_least": {"n": 8, **INSIDE}}, ("at_least", "n"), "more than the 7 bodies of 'ball[*]'"),
        ({"all_of": {"at_rest": {"object": "bal[*]"}}}, ("all_of",), "'bal[*]' selects no body"),
        ({"all_of": {"at_rest": {"object": "tray[*]"}}}, ("all_of",), "'tray' is one body"),
        ({"any_of": {"at_rest": {"object": "tray"}}}, ("any_of",), "names no selection"),
        ({"any_of": {"not": {"all_of": INSIDE}}}, ("any_of",), "`all_of` inside `any_of`"),
        ({"any_of": {"of": "bal[*]", "at_rest": None}}, ("any_of", "of"), "'bal[*]' selects no body"),
        ({"any_of": {"of": "ball", "at_rest": None}}, ("any_of", "of"), "names no selection"),
        ({"any_of": {"of": "ball[*]", "inside": "try"}}, ("any_of", "inside", "of"), "'try' is not"),
        ({"at_rest": {"object": "ball[*]"}}, ("at_rest", "object"), "'ball[*]' is 7 bodies, expected one"),
        ({"at_rest": {"object": "ball"}}, ("at_rest", "object"), "'ball' is 7 bodies, expected one"),
        ({"all_of": {"inside": {"object": "ball[*]", "of": "try"}}}, ("all_of", "inside", "of"), "'try' is not"),
    ],
)
def test_faults(written: dict[str, Any], loc: tuple[str, ...], words: str) -> None:
    (found,) = problems(spec(written), CONTEXT, CONDITIONS)
    assert found.loc == loc
    assert words in found.message
    assert found.hint is not None or "more than" in found.message
