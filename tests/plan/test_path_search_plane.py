"""A ball on a gantry among walls: the whole search, on problems whose answer is known."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.build_robot import build_robot
from manipcli.model.collision import CollisionChecker, CollisionQuery
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import PlanningState
from manipcli.plan.path_planners.rrt_connect import RrtConnectSpec
from manipcli.plan.path_search import PathSearch
from manipcli.scene.build_scene import build_scene
from manipcli.spec.robot import RobotSpec
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

RADIUS, MARGIN = 0.02, 0.004
GANTRY = f"""<robot name="gantry">
  <link name="base"/><link name="bridge"/>
  <link name="ball"><collision><geometry><sphere radius="{RADIUS}"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="base"/><child link="bridge"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="y" type="prismatic"><parent link="bridge"/><child link="ball"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""
Wall = tuple[float, float, float, float]  # x from, x to, y from, y to


def made(folder: Path, walls: dict[str, Wall]) -> tuple[RobotModel, CollisionQuery]:
    (folder / "robot.urdf").write_text(GANTRY)
    robot, _ = build_robot(RobotSpec(robot="gantry", description="robot.urdf"), file=folder / "robot.yaml")
    bodies = {
        name: BodySpec.model_validate(
            {
                "box": {"size": [x1 - x0, y1 - y0, 0.1]},
                "pose": {"xyz": [(x0 + x1) / 2, (y0 + y1) / 2, 0.0]},
                "fixed": True,
            }
        )
        for name, (x0, x1, y0, y1) in walls.items()
    }
    fields: dict[str, Any] = {"scene": bodies, "floor": False}
    return robot, CollisionChecker(Kinematics(robot), build_scene(TaskSpec.model_construct(**fields))).at(margin=MARGIN)


def searched(
    folder: Path, walls: dict[str, Wall], start: tuple[float, float], goal: tuple[float, float], *, samples: int = 2000
) -> Array:
    robot, query = made(folder, walls)
    search = PathSearch.of(RrtConnectSpec(samples=samples), np.random.default_rng(1))
    return search.path(robot, PlanningState(np.array(start), ()), query, ("x", "y"), np.array([goal]), None)


def clearance(path: Array, walls: dict[str, Wall]) -> float:
    """Least distance of the ball from any wall on the path, by dense sampling of exact distances."""
    found = np.inf
    for a, b in pairwise(path):
        for share in np.linspace(0.0, 1.0, 400):
            x, y = a + share * (b - a)
            for x0, x1, y0, y1 in walls.values():
                away = np.hypot(max(x0 - x, 0.0, x - x1), max(y0 - y, 0.0, y - y1))
                found = min(found, float(away) - RADIUS)
    return found


@pytest.mark.parametrize("gap", [0.1, 0.3])
def test_the_path_leads_through_the_only_gap(tmp_path: Path, gap: float) -> None:
    walls = {"below": (-0.01, 0.01, -1.1, 0.3), "above": (-0.01, 0.01, 0.3 + gap, 1.1)}
    path = searched(tmp_path, walls, (-0.5, -0.5), (0.5, -0.5))
    assert path[0] == pytest.approx([-0.5, -0.5])
    assert path[-1] == pytest.approx([0.5, -0.5])
    assert clearance(path, walls) >= MARGIN / 2
    through = [np.interp(0.0, [a[0], b[0]], [a[1], b[1]]) for a, b in pairwise(path) if a[0] < 0 <= b[0]]
    assert 0.3 + RADIUS < through[0] < 0.3 + gap - RADIUS
    # Not much longer than around the corner of the wall, at the distance of ball and clearance.
    away = RADIUS + MARGIN
    shortest = 2 * np.hypot(0.5 - 0.01 - away, 0.8 + away) + 2 * (0.01 + away)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < 1.15 * shortest


def test_a_refusal_names_the_narrowest_place_and_what_blocks_most(tmp_path: Path) -> None:
    """Thick walls with a thin door between them, closed: the two searches come nearest at the door."""
    walls = {"left": (-0.4, 0.4, 0.15, 1.1), "right": (-0.4, 0.4, -1.1, -0.15), "door": (-0.01, 0.01, -0.16, 0.16)}
    with pytest.raises(NotPlannable) as refusal:
        searched(tmp_path, walls, (-0.8, -0.8), (0.8, 0.8), samples=1500)
    cause, hint = refusal.value.cause, refusal.value.hint
    assert cause.startswith("no path around obstacles: the two searches did not meet within 1500 samples")
    assert "at the narrowest place found, 'door' and 'robot/ball'" in cause
    assert "block" in cause.rsplit(";", 1)[1] and "% of the examined motions" in cause
    assert hint == "move 'door' away, or first `move` to a pose nearer to the goal, or raise `planner: {samples: ...}`"
    assert refusal.value.reason == "in_the_way"


def test_later_searches_of_a_step_get_less_and_the_last_refusal_is_repeated(
    tmp_path: Path,
) -> None:
    walls = {"wall": (-0.01, 0.01, -1.1, 1.1)}
    robot, query = made(tmp_path, walls)
    search = PathSearch.of(RrtConnectSpec(samples=40), np.random.default_rng(0))
    state, used, refusals = PlanningState(np.array([-0.5, 0.0]), ()), [], []
    for _ in range(12):
        left = search.left
        with pytest.raises(NotPlannable) as refusal:
            search.path(robot, state, query, ("x", "y"), np.array([[0.5, 0.0]]), None)
        used.append(left - search.left)
        refusals.append(refusal.value)
    assert used[:4] == [40, 20, 10, 5]
    assert search.left == 0
    assert refusals[-1] is refusals[-2]
