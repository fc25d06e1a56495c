"""What is promised of proposed gains holds in postures that were not looked at."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.gain_design import MARGIN, Wish, tune_efforts
from manipcli.control.joint_space_load import JointSpaceLoad
from manipcli.core.errors import InvalidInput
from manipcli.model.kinematics import Kinematics
from manipcli.task.load_task import load_task
from manipcli.tuning.extreme_configurations import climbed
from manipcli.tuning.propose_gains import tune

ROOT = Path(__file__).parents[2]
H = 1e-3


def largest(mass: np.ndarray, p: np.ndarray, d: np.ndarray, friction: np.ndarray) -> float:
    """|pole| of M a = -P q - (D + B) v in one step of Euler: v += h a, q += h v."""
    n = len(p)
    change = -H * np.linalg.solve(mass, np.hstack([np.diag(p), np.diag(d + friction)]))
    change[:, n:] += np.eye(n)
    stay = np.hstack([np.eye(n), np.zeros((n, n))])
    return float(np.abs(np.linalg.eigvals(np.vstack([stay + H * change, change]))).max())


def test_a_mode_in_which_many_joints_share_alike_is_calmed_too() -> None:
    """Six joints that push at one light link: each has a sixth of the mode that is unstable."""
    n = 6
    mass = 0.01 * (np.eye(n) - 0.16 * np.ones((n, n)))
    load = JointSpaceLoad(
        joints=tuple(f"j{k}" for k in range(n)), mass=mass[None], gravity=np.zeros((1, n)), needed=np.zeros((1, n)),
        damping=np.zeros(n), effort=np.full(n, 1e3), latency=(0,) * n,
    )  # fmt: skip
    wish = Wish(60.0, 1.0, H)
    found = tune_efforts(["c"] * n, load, wish, steps=np.full(n, 0.02), carried=np.full(n, True), pressing=np.zeros(n))
    p, d = (np.array([getattr(one, key) for one in found]) for key in ("p", "d"))
    assert {one.limited_by for one in found} == {"other joints"}
    assert largest(mass, MARGIN * p, MARGIN * d, np.zeros(n)) < 1.0


def test_the_top_of_a_hill_is_found() -> None:
    robot = load_task(ROOT / "tasks" / "home.yaml").robot
    n = len(robot.joint_names)
    free = np.array([joint.mimic is None for joint in robot.moving_joints])
    top = np.linspace(-0.9, 0.9, n)

    def score(q: np.ndarray) -> np.ndarray:
        return np.asarray(10.0 - ((q - top)[:, free] ** 2).sum(axis=1))

    found = climbed(robot, score, np.zeros((1, n)), np.full(n, -1.0), np.full(n, 0.5))
    assert found[free] == pytest.approx(np.clip(top, -1.0, 0.5)[free], abs=0.01)


def test_gains_without_their_margin_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """After one round the iiwa's are not calm where they are tightest."""
    files = ROOT / "robots" / "iiwa7" / "robot.yaml", ROOT / "controllers" / "iiwa7.yaml"
    monkeypatch.setattr("manipcli.tuning.propose_gains.ROUNDS", 1)
    (note,) = (one for one in tune(*files, Wish(20.0, 1.0, H)).notes if "Gain margin" in one)
    found = re.fullmatch(r"Gain margin ([\d.]+) of all loops together is below 2[.0]* in the last config.*", note)
    assert found is not None
    assert 1.0 <= float(found[1]) < MARGIN


def test_gains_that_are_unstable_somewhere_are_not_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    files = ROOT / "robots" / "iiwa7" / "robot.yaml", ROOT / "controllers" / "iiwa7.yaml"
    monkeypatch.setattr("manipcli.tuning.propose_gains.ROUNDS", 1)
    monkeypatch.setattr("manipcli.control.gain_design.MARGIN", 0.9)
    with pytest.raises(InvalidInput, match="they are unstable in the last configuration found"):
        tune(*files, Wish(20.0, 1.0, H))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm7_hand3", "iiwa7"])
def test_the_margin_of_all_together_and_the_most_inertia_hold_elsewhere(name: str) -> None:
    robots, controllers = ROOT / "robots" / name / "robot.yaml", ROOT / "controllers" / f"{name}.yaml"
    tuning = tune(robots, controllers, Wish(20.0, 1.0, H))
    task = ROOT / "tasks" / ("home.yaml" if name == "arm7_hand3" else "pour_iiwa.yaml")
    robot = load_task(task).robot
    kinematics = Kinematics(robot)
    columns = robot.indices(tuple(one.joint for one in tuning.joints))
    p, d, inertia = (np.array([getattr(one, key) for one in tuning.joints]) for key in ("p", "d", "inertia"))
    friction = np.array([joint.damping for joint in robot.moving_joints])[columns]
    limits = [robot.moving_joints[k].limits for k in columns]
    low, high = (np.array([getattr(one, key) for one in limits]) for key in ("lower", "upper"))
    rng = np.random.default_rng(7)
    most, worst = np.zeros(len(p)), 0.0
    for _ in range(1000):
        q = np.zeros(len(robot.joint_names))
        q[columns] = rng.uniform(low, high)
        mass = kinematics.mass_matrix(q)[np.ix_(columns, columns)]
        most = np.maximum(most, np.diag(mass))
        worst = max(worst, largest(mass, MARGIN * p, MARGIN * d, friction))
    assert worst < 1.0
    assert np.all(most <= 1.02 * inertia)
