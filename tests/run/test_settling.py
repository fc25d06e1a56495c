"""Bodies of a `count` may move while they settle, until they rest where they belong; the world is written by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from manipcli.core.errors import SimulationFailed
from manipcli.core.geometry import Array
from manipcli.model.state import WorldState
from manipcli.run import settling
from manipcli.run.settling import LONGEST, LOOK, SETTLED_SPEED, settle
from manipcli.simulate.session import Session
from manipcli.task.load_task import load_task
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
LEAST = 0.3
Moves = Callable[[WorldState, float], None]


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    file = tmp_path_factory.mktemp("settling") / "t.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/differential_wrist/robot.yaml\n"
        f"controllers: {ROOT}/controllers/differential_wrist.yaml\nsimulation: {{settle: {LEAST}}}\nscene:\n"
        "  desk: {box: {size: [0.6, 0.6, 0.4]}, pose: {xyz: [1, 0, 0.2]}, fixed: true}\n"
        "  cup: {cup: {radius: 36 mm, height: 110 mm, wall: 4 mm}, mass: 150 g, rests_on: desk, at: [1, 0]}\n"
        "  ball: {sphere: {radius: 6 mm}, mass: 1 g, count: 3, inside: cup}\n"
        "  pea: {sphere: {radius: 4 mm}, mass: 1 g, count: 2, rests_on: desk, at: [1.2, 0.1]}\n"
        "steps: [{wait: 1 s}]\n"
    )
    return load_task(file, allow_outside=True)


def settled(task: Task, monkeypatch: pytest.MonkeyPatch, moves: Moves) -> float:
    """Time [s] that settling takes in a world in which bodies are at their start, but for `moves(state, time)`."""
    movable = task.true.scene.movable
    passed = 0.0

    def hold(_: Session, duration: float) -> None:
        nonlocal passed
        passed += duration

    def read() -> WorldState:
        state = WorldState.room(1, len(movable))
        state.body_position[:] = [body.X_WO.p for body in movable]
        state.body_quat_xyzw[:] = [body.X_WO.quat_xyzw for body in movable]
        moves(state, passed)
        return state

    monkeypatch.setattr(settling, "_hold", hold)
    settle(task, cast(Session, SimpleNamespace(engine=SimpleNamespace(read=read))))
    return passed


def row(task: Task, name: str) -> int:
    return [body.name for body in task.true.scene.movable].index(name)


def put(task: Task, name: str, at: Array) -> Moves:
    def moves(state: WorldState, _: float) -> None:
        state.body_position[row(task, name)] = at

    return moves


def test_it_lasts_until_all_have_been_slow_for_as_long_as_others_get(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    k = row(task, "ball[2]")
    for calm in (0.0, 2.0):

        def moves(state: WorldState, time: float, calm: float = calm) -> None:
            state.body_linear[k, 2] = 2.0 * SETTLED_SPEED if time < calm else 0.5 * SETTLED_SPEED

        # The first look that sees it slow is after `calm`, and it is slow for LEAST from there on.
        assert settled(task, monkeypatch, moves) == pytest.approx(max(LEAST, calm) + LEAST, abs=1.5 * LOOK)


def test_a_body_that_never_rests_is_refused_with_its_speed(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    def moves(state: WorldState, _: float) -> None:
        state.body_linear[row(task, "pea[1]")] = (0.03, 0.0, 0.04)

    with pytest.raises(SimulationFailed, match=rf"'pea\[1\]' still moves at 0.05 m/s after settling of {LONGEST:g} s"):
        settled(task, monkeypatch, moves)


@pytest.mark.parametrize(
    ("name", "at", "words"),
    [
        ("ball[1]", (1.1, 0.0, 0.41), r"'ball\[1\]' fell out of 'cup' while settling, to \[1.100, 0.000, 0.410\] m"),
        ("pea[0]", (1.4, 0.1, 0.004), r"'pea\[0\]' fell off 'desk' while settling, to \[1.400, 0.100, 0.004\] m"),
    ],
)
def test_a_body_that_leaves_its_place_is_refused(
    task: Task, monkeypatch: pytest.MonkeyPatch, name: str, at: tuple[float, float, float], words: str
) -> None:
    with pytest.raises(SimulationFailed, match=words):
        settled(task, monkeypatch, put(task, name, np.array(at)))


def test_what_has_no_count_may_not_move_even_if_it_stays_in_place(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SimulationFailed, match=r"'cup' moved 30\.0 mm while settling"):
        settled(task, monkeypatch, put(task, "cup", np.array([1.03, 0.0, 0.4])))


def test_a_heap_may_slide_as_long_as_it_stays_above_its_support(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    settled(task, monkeypatch, put(task, "pea[0]", np.array([1.25, 0.15, 0.404])))
