"""Where poured bodies pass a rim and land, from states made by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.model.state import Contact, WorldState
from manipcli.run.pour_watch import PourWatch
from manipcli.scene.scene import Scene
from manipcli.task.load_task import load_task

MUG = Path(__file__).resolve().parents[2] / "tasks" / "pour_into_mug.yaml"
TIP = np.array([np.sin(np.pi / 3.0), 0.0, 0.0, np.cos(np.pi / 3.0)])  # 120 deg about x: the rim points along -y, down
CUP = np.array([0.72, 0.45, 0.7])
OVER = " 34.7 mm before the middle of 'mug' and 155 mm above its rim"
"""At 0.110 m along the axis of the cup: 0.45 m - 0.110 m sin(120 deg) against 0.32 m, 0.645 m against 0.49 m."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_task(MUG).scene


def states(
    scene: Scene, path: list[tuple[float, float, float]], velocity: tuple[float, float, float]
) -> list[WorldState]:
    """The cup tipped, the ball on a path in the world."""
    names = [body.name for body in scene.movable]
    found = []
    for p in path:
        state = WorldState.room(1, len(names))
        for k, body in enumerate(scene.movable):
            state.body_position[k], state.body_quat_xyzw[k] = body.X_WO.p, body.X_WO.quat_xyzw
        state.body_position[names.index("cup")], state.body_quat_xyzw[names.index("cup")] = CUP, TIP
        state.body_position[names.index("ball")], state.body_linear[names.index("ball")] = p, velocity
        found.append(state)
    return found


def along(out: float) -> tuple[float, float, float]:
    """A point on the axis of the tipped cup, `out` [m] from its bottom."""
    x, y, z = CUP + out * np.array([0.0, -np.sin(2.0 * np.pi / 3.0), np.cos(2.0 * np.pi / 3.0)])
    return float(x), float(y), float(z)


@pytest.mark.parametrize(
    ("place", "on", "text"),
    [
        # The bore of 82 mm about [0.72, 0.32]; thrown along -y.
        ((0.72, 0.229, 0.414), "desk", "landed 50 mm beyond the rim of 'mug', on 'desk'"),
        ((0.72, 0.391, 0.414), "desk", "landed 30 mm before the rim of 'mug', on 'desk'"),
        ((0.72, 0.32, 0.50), "mug", "landed above the rim of 'mug', on 'mug'"),
    ],
)
def test_a_text_says_where_it_left_how_fast_and_where_it_landed(
    scene: Scene, place: tuple[float, float, float], on: str, text: str
) -> None:
    watch = PourWatch(scene, "cup", "mug", ["ball"])
    inside, beyond, flying, ended = states(scene, [along(0.10), along(0.12), along(0.14), place], (0.0, -0.5, -0.375))
    touching = [Contact("ball", "cup", 0.1, 0.0), Contact("ball", "robot/palm", 0.1, 0.0)]
    for state, contacts in ((inside, touching), (beyond, touching), (flying, touching)):
        watch.look(state, contacts)
    assert watch.text() == f"'ball' left the rim{OVER} at 0.62 m/s, tilted 120 deg, and has not landed"
    watch.look(ended, [Contact("ball", on, 0.1, 0.0)])
    assert watch.text() == f"'ball' left the rim{OVER} at 0.62 m/s, tilted 120 deg, and {text}"


def test_what_stays_in_the_cup_or_lands_in_the_container_needs_no_text(scene: Scene) -> None:
    watch = PourWatch(scene, "cup", "mug", ["ball"])
    inside, beyond, ended = states(scene, [along(0.1), along(0.12), (0.72, 0.33, 0.42)], (0.0, -0.5, 0.0))
    watch.look(inside, [])
    assert watch.text() == ""
    watch.look(beyond, [])
    watch.look(ended, [Contact("ball", "mug", 0.1, 0.0)])
    assert watch.text() == ""


def test_the_speed_at_the_rim_is_between_those_before_and_after_it(scene: Scene) -> None:
    """A quarter of the way to the rim, at 0.110 m: a quarter of the change of the velocity."""
    watch = PourWatch(scene, "cup", "mug", ["ball"])
    watch.look(states(scene, [along(0.105)], (0.0, -0.4, 0.0))[0], [])
    watch.look(states(scene, [along(0.125)], (0.0, -0.8, 0.0))[0], [])
    assert watch.text().startswith(f"'ball' left the rim{OVER} at 0.50 m/s")


def test_of_many_the_first_and_the_last_over_the_rim_are_reported(scene: Scene) -> None:
    cup, ball = scene.body("cup"), scene.body("ball")
    many = replace(scene, bodies=(cup, scene.body("mug"), *(replace(ball, name=f"ball[{k}]") for k in range(3))))
    watch = PourWatch(many, "cup", "mug", [f"ball[{k}]" for k in range(3)])
    assert watch.with_times("3 of 3") == "3 of 3"
    leaves = (5.25, 4.5)  # of ball[0] and ball[1]; ball[2] stays
    for time in np.arange(4.0, 6.0, 0.25):
        state = WorldState.room(1, len(many.movable))
        state.time[...] = time
        names = [body.name for body in many.movable]
        state.body_quat_xyzw[:] = [0.0, 0.0, 0.0, 1.0]
        state.body_position[names.index("cup")], state.body_quat_xyzw[names.index("cup")] = CUP, TIP
        for k in range(3):
            out = k < 2 and time >= leaves[k]
            state.body_position[names.index(f"ball[{k}]")] = along(0.14 if out else 0.08)
        watch.look(state, [])
    assert watch.with_times("2 of 3") == "2 of 3; first over the rim at 4.50 s, last at 5.25 s"
    assert watch.with_times("") == "first over the rim at 4.50 s, last at 5.25 s"
