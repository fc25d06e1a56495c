"""Bodies with a `count`: where they start, and every fault of it that is found before anything runs."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.scene.build_scene import build_scene
from manipcli.scene.containing import contains
from manipcli.scene.scene import Body, Scene
from manipcli.spec.counted import flat_scene, selected, selections, with_member, written
from manipcli.spec.scene import BodySpec
from manipcli.spec.simulation import SimulationSpec
from manipcli.spec.task import TaskSpec

DESK: dict[str, Any] = {"box": {"size": [0.6, 1.0, 0.4]}, "pose": {"xyz": [0.85, 0, 0.2]}, "fixed": True}
CUP: dict[str, Any] = {
    "cup": {"radius": 0.036, "height": 0.11, "wall": 0.004}, "mass": 0.15, "rests_on": "desk", "at": [0.75, 0],
}  # fmt: skip
BALL: dict[str, Any] = {"sphere": {"radius": 0.006}, "mass": 0.001}
R = BALL["sphere"]["radius"]


def built(scene: dict[str, Any], *, seed: int = 1) -> Scene:
    bodies = {name: BodySpec.model_validate(body) for name, body in scene.items()}
    return build_scene(TaskSpec.model_construct(task="t", scene=bodies, simulation=SimulationSpec(seed=seed)))


def refused(scene: dict[str, Any]) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as caught:
        built(scene)
    return caught.value.findings


def balls(scene: Scene, name: str = "ball") -> list[Body]:
    return [body for body in scene.bodies if body.name.startswith(f"{name}[")]


def centres(scene: Scene, name: str = "ball") -> np.ndarray[Any, Any]:
    return np.array([body.X_WO.p for body in balls(scene, name)])


@pytest.mark.parametrize("count", [1, 20, 96])
def test_a_fill_is_inside_its_container_and_no_two_overlap(count: int) -> None:
    scene = built({"desk": DESK, "cup": CUP, "ball": BALL | {"count": count, "inside": "cup"}})
    cup = scene.body("cup")
    assert [body.name for body in balls(scene)] == [f"ball[{k}]" for k in range(count)]
    assert all(contains(cup, cup.X_WO, body, body.X_WO) for body in balls(scene))
    p = centres(scene)
    assert np.hypot(*(p - cup.X_WO.p)[:, :2].T).max() <= 0.032 - R + 1e-12  # the walls, 32 mm from the axis
    apart = np.linalg.norm(p[:, None] - p[None], axis=-1)[~np.eye(count, dtype=bool)]
    assert apart.min(initial=1.0) >= 2.0 * R
    assert p[:, 2].min() == pytest.approx(0.4 + 0.004 + R)  # on the floor of the cup


def test_places_follow_from_the_seed_and_the_name() -> None:
    scene = {"desk": DESK, "cup": CUP, "ball": BALL | {"count": 12, "inside": "cup"}}
    assert np.array_equal(centres(built(scene)), centres(built(scene)))
    assert not np.array_equal(centres(built(scene)), centres(built(scene, seed=2)))
    renamed = {"desk": DESK, "cup": CUP, "pea": BALL | {"count": 12, "inside": "cup"}}
    assert not np.array_equal(centres(built(scene)), centres(built(renamed), "pea"))


def test_a_second_fill_begins_above_the_first() -> None:
    more = {"count": 20, "inside": "cup"}
    scene = built({"desk": DESK, "cup": CUP, "ball": BALL | more, "pea": BALL | more})
    assert centres(scene, "pea")[:, 2].min() >= centres(scene)[:, 2].max() + 2.0 * R


def test_a_grid_is_level_and_a_pile_has_layers() -> None:
    level = centres(built({"desk": DESK, "ball": BALL | {"count": 20, "rests_on": "desk", "at": [0.8, 0.1]}}))
    assert np.allclose(level[:, 2], 0.4 + R)
    assert np.allclose(level[:, :2].mean(axis=0), [0.8, 0.1], atol=2 * R)
    pile = {"count": 20, "grid": [3, 3], "rests_on": "desk", "at": [0.8, 0.1]}
    heights, sizes = np.unique(centres(built({"desk": DESK, "ball": BALL | pile}))[:, 2].round(9), return_counts=True)
    assert sizes.tolist() == [9, 9, 2]
    assert all(b - a >= 2.0 * R for a, b in pairwise(heights))


def test_boxes_fill_a_tray_without_overlap_at_any_yaw() -> None:
    tray = {"tray": {"size": [0.2, 0.16, 0.05]}, "mass": 0.2, "rests_on": "desk", "at": [0.8, 0]}
    brick = {"box": {"size": [0.03, 0.02, 0.01]}, "mass": 0.01, "count": 30, "inside": "tray", "yaw": 0.6}
    assert len(balls(built({"desk": DESK, "tray": tray, "brick": brick}), "brick")) == 30  # overlap is TASK226


@pytest.mark.parametrize(
    ("body", "code", "words"),
    [
        ({"count": 97, "inside": "cup"}, "TASK293", "only 96 of 97 'ball' fit into 'cup'"),
        ({"count": 3, "pose": {"xyz": [0, 0, 1]}}, "TASK294", "both `count` and `pose`"),
        ({"count": 3, "inside": "cup", "at": [0, 0]}, "TASK294", "both `count` and `at`"),
        ({"count": 3, "inside": "cup", "known": {"rotation": 0.1}}, "TASK294", "both `count` and `known`"),
        ({"grid": [2, 2], "inside": "cup"}, "TASK294", "`grid` without `count`"),
        ({"count": 3, "inside": "desk"}, "TASK224", "'desk' is not a container but a box"),
        ({"count": 3, "rests_on": "desk", "at": [3, 0]}, "TASK224", "is not above 'desk'"),
        ({"count": 3, "inside": "cupp"}, "TASK225", "'cupp' is not in the scene"),
    ],
)
def test_faults_are_reported_once_for_all_bodies(body: dict[str, Any], code: str, words: str) -> None:
    (found,) = refused({"desk": DESK, "cup": CUP, "ball": BALL | body})
    assert found.code == code
    assert words in found.message


def test_a_body_cannot_have_the_name_of_one_of_many() -> None:
    more = {"ball": BALL | {"count": 3, "inside": "cup"}, "ball[1]": BALL | {"rests_on": "desk", "at": [0.9, 0.2]}}
    assert [found.code for found in refused({"desk": DESK, "cup": CUP, **more})] == ["TASK294"]


def test_flat_names_and_places() -> None:
    scene = {name: BodySpec.model_validate(body) for name, body in {"cup": CUP, "ball": BALL | {"count": 2}}.items()}
    flat = flat_scene(scene)
    assert list(flat) == ["cup", "ball[0]", "ball[1]"]
    assert flat["cup"] is scene["cup"]
    assert written(("scene", "ball[1]", "mass"), scene) == ("scene", "ball", "mass")
    assert written(("scene", "cup", "mass"), scene) == ("scene", "cup", "mass")
    assert selections(flat) == {"ball[*]": ("ball[0]", "ball[1]")}
    assert selected(("ball[*]/top", "cup", 1.0)) == ("ball[*]",)
    assert with_member(("ball[*]/top", "ball[*]", "cup"), "ball[*]", "ball[1]") == ("ball[1]/top", "ball[1]", "cup")
