"""The share of a step at an effort limit, counted by hand, whole and in pieces, at joints and at actuators."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from manipcli.conditions.condition import CheckContext, World
from manipcli.conditions.members.saturation import SATURATION, SaturationSpec
from manipcli.conditions.state_window import StateWindow, StepTime
from manipcli.core.errors import InvalidInput
from manipcli.model.motor_limits import EffortLimits
from manipcli.model.robot import Actuator
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.task.load_task import load_task
from manipcli.task.load_view import load_sight

ROOT = Path(__file__).parents[2]
ROBOT = load_sight(ROOT / "robots" / "arm7_hand3" / "robot.yaml").robot
SCENE = Scene((), (), np.zeros(3))
STEPS = (StepTime("a", 0.0, 0.1, "done"), StepTime("b", 0.1, 0.3, "done"))


def window(full: dict[int, float], ticks: int = 350) -> StateWindow:
    """Ticks of 1 ms; `full`: ticks at which joint_2 has this effort."""
    states = WorldState.room(len(ROBOT.joint_names), 0, ticks)
    states.time[:] = np.arange(ticks) * 1e-3
    for tick, effort in full.items():
        states.effort[tick, ROBOT.joint_names.index("joint_2")] = effort
    return StateWindow(states, None, (), (), STEPS)


def margins(shown: StateWindow, *pieces: int, **spec: object) -> dict[int, float]:
    """Margin by tick, with the window cut after `pieces`."""
    world = World(ROBOT, SCENE, shown.states.map(lambda a: a[0]), steps=("a", "b"), period=1e-3)
    monitor = SATURATION.open(SaturationSpec.model_validate(spec), world)
    found, bounds = {}, (0, *pieces, len(shown.times))
    for first, last in pairwise(bounds):
        reading = monitor(shown.part(first, last))
        found |= {first + int(k): float(reading.margins[k]) for k in np.flatnonzero(reading.applies)}
    return found


LIMIT = ROBOT.joint("joint_2").limits.effort or 0.0


@pytest.mark.parametrize("pieces", [(), (40,), (100,), (99, 101, 250)])
def test_the_share_of_each_step_is_known_at_its_last_tick(pieces: tuple[int, ...]) -> None:
    full = dict.fromkeys([*range(30), *range(100, 180), *range(300, 350)], -LIMIT)
    assert margins(window(full), *pieces, below=0.5) == pytest.approx({99: 0.5 - 0.3, 299: 0.5 - 0.4})


def test_other_joints_and_lower_efforts_do_not_count() -> None:
    full = window(dict.fromkeys(range(350), LIMIT))
    assert margins(full, joints=["joint_1"]) == margins(window(dict.fromkeys(range(350), 0.999 * LIMIT)))
    assert margins(full, group="hand") == {99: 0.2, 299: 0.2}


def test_an_effort_that_is_not_finite_is_not_a_pass() -> None:
    assert np.isnan(margins(window({5: np.nan}))[99])


def test_a_motor_at_its_limit_gives_less_while_it_drives() -> None:
    wrist = load_sight(ROOT / "robots" / "differential_wrist" / "robot.yaml").robot
    motors = tuple(
        Actuator(motor.name, effort=0.05, efficiency=0.9, coulomb_friction=0.0005, viscous_friction=1e-6)
        for motor in wrist.actuators
    )
    limits = EffortLimits.of(replace(wrist, actuators=motors))
    pitch, roll = wrist.joint_names.index("pitch"), wrist.joint_names.index("roll")
    to_motors = limits.effort[:, [pitch, roll]]
    speed = np.linalg.solve(limits.motion[:, [pitch, roll]], [100.0, 0.0])
    for output, driving, expected in (
        (0.05, 0.0, True), (0.0449, 0.0, False), (0.9 * 0.05 - 0.0005 - 1e-4, 1.0, True), (0.044, 1.0, False),
        (0.0449, -1.0, False),
    ):  # fmt: skip
        effort, velocity = np.zeros((2, 1, 2))
        effort[0, [pitch, roll]] = np.linalg.solve(to_motors, [output, 0.0])
        velocity[0, [pitch, roll]] = driving * speed
        assert bool(limits.reached(effort, velocity).any()) is expected, (output, driving)


def test_unknown_names_are_found_with_the_nearest() -> None:
    (problem,) = SATURATION.check(SaturationSpec(joints=("joint_22",)), CheckContext(ROBOT, SCENE))
    assert (problem.loc, problem.hint) == (("joints", 0), "did you mean 'joint_2'?")


def test_it_is_for_expect_alone(tmp_path: Path) -> None:
    path = tmp_path / "t.yaml"
    head = f"task: t\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
    path.write_text(
        f"{head}steps: [{{wait: 1 s, until: {{saturation: {{}}}}}}]\n"
        "expect: [{saturation: {}}]\nwatch: [{always: {saturation: {}}}]\n"
    )
    with pytest.raises(InvalidInput) as caught:
        load_task(path)
    found = [(one.place.line if one.place else 0, one.message.rpartition(": ")[2]) for one in caught.value.findings]
    late = "`saturation` is judged after the run, not during it"
    assert found == [(4, late), (6, late)]
