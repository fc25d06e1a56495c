"""Other controllers take over from an arm that holds itself against gravity, in Bullet: nothing jumps, nothing sags."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.run.execute import build_manager
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.session import Session
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

ROOT = Path(__file__).parents[2]
PD = ((100, 8), (100, 8), (60, 4), (60, 4), (10, 0.4), (10, 0.4), (3, 0.05))
JOINTS = [f"joint_{k}" for k in range(1, 8)]
# Soft enough for an update at 250 Hz.
GAINS = ", ".join(f"{joint}: {{p: {p}, d: {d}}}" for joint, (p, d) in zip(JOINTS, PD, strict=True))
ARM = f"joints: [{', '.join(JOINTS)}]"
FILE = f"""\
effort: {{type: joint_trajectory, {ARM}, gravity_compensation: true, gains: {{{GAINS}}}}}
computed: {{type: computed_torque, active: false, {ARM}}}
slow: {{type: joint_trajectory, active: false, update_rate: 250, {ARM}, gravity_compensation: true, gains: {{{GAINS}}}}}
position: {{type: joint_trajectory, active: false, {ARM}, command_interface: position}}
slow_position: {{type: joint_trajectory, active: false, update_rate: 100, {ARM}, command_interface: position}}
velocity: {{type: joint_trajectory, active: false, {ARM}, command_interface: velocity,
  gains: {{{", ".join(f"{joint}: {{p: 20}}" for joint in JOINTS)}}}}}
forward: {{type: forward_command, active: false, {ARM}, command_interface: position}}
"""


@pytest.fixture
def session(tmp_path: Path) -> Session:
    """The arm of the pour, stretched out, held by `effort` for a second."""
    (tmp_path / "controllers.yaml").write_text(FILE)
    file = tmp_path / "task.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: controllers.yaml\nsteps:\n  - wait: 1 s\n"
    )
    task = load_task(file, allow_outside=True)
    start = start_position(task).copy()
    start[task.robot.indices(JOINTS)] = [0.3, 1.2, 0.2, -0.4, 0.1, 0.3, 0.0]
    engine = ENGINES["pybullet"].open(task.robot, task.scene, EngineSettings(1e-3, 1, start))
    running = Session(robot=task.robot, scene=task.scene, engine=engine, manager=build_manager(task), period=1e-3)
    arm(running, 1000)
    return running


def arm(session: Session, ticks: int) -> Array:
    """(ticks, 7) the arm's joints."""
    index = session.robot.indices(JOINTS)
    return np.array([session.tick().position[index] for _ in range(ticks)])


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [
        ("position", "effort"),
        ("slow_position", "effort", "position"),
        ("velocity", "position"),
        ("computed", "slow", "velocity", "effort"),
        ("forward", "effort"),
    ],
    ids=" ".join,
)
def test_nothing_moves_by_a_thousandth_of_a_radian(session: Session, names: tuple[str, ...]) -> None:
    at_rest = arm(session, 1)[0]
    arm(session, 3)  # so that no switch stands at a multiple of a slow one's period
    for name in names:
        assert session.manager.switch_to([name], time=session.time).ok
        moved = np.abs(arm(session, 203) - at_rest).max()
        assert moved < 1e-3, f"{name}: {moved}"
    session.engine.close()


def test_joints_that_nobody_commands_are_braked(session: Session) -> None:
    at_rest = arm(session, 1)[0]
    assert session.manager.switch(deactivate=["effort"]).ok
    assert np.abs(arm(session, 300) - at_rest).max() < 1e-3
    session.engine.close()
