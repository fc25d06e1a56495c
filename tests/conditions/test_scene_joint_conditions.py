"""`joint_at`, `opened`, `closed`: margins on states whose joints are known, and names that are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.conditions.condition import CheckContext, World
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.state_window import StateWindow
from manipcli.description.packages import Packages
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.task.robot_file import read_robot
from manipcli.task.vocabulary import task_spec

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return read_robot(ROOT / "robots" / "differential_wrist" / "robot.yaml")[1]


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A door that is closed at 10 deg, a drawer, and a ball."""
    files = {name: {"file": f"{name}.urdf"} for name in ("door", "cabinet")}
    bodies = {
        "door": {
            "urdf": files["door"],
            "fixed": True,
            "pose": {"xyz": [0, 2, 0]},
            "joints": {"hinge": {"closed": 0.2}},
        },
        "cabinet": {"urdf": files["cabinet"], "fixed": True, "rests_on": "floor", "at": [1, 0]},
        "ball": {"sphere": {"radius": 0.1}, "mass": 1.0, "rests_on": "floor", "at": [0, 0]},
    }
    data = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "scene": bodies}
    packages = Packages(ROOT / "tasks" / "objects" / "t.yaml")
    return build_scene(task_spec().model_validate(data), packages=packages)


def states(scene: Scene, **positions: list[float]) -> WorldState:
    """States (T) in which the joints of bodies have these positions."""
    T = len(next(iter(positions.values())))
    made = WorldState.room(1, len(scene.movable), T)
    made.time[:] = np.arange(T) * 0.01
    for k, body in enumerate(scene.movable):
        for t in range(T):
            X_WO = body.X_WO
            for joint in scene.joints:
                if joint.child == body.name and (own := positions.get(joint.parent)) is not None:
                    X_WO = joint.child_pose(scene.body(joint.parent).X_WO, own[t])
            made.body_position[t, k], made.body_quat_xyzw[t, k] = X_WO.p, X_WO.quat_xyzw
    return made


def margins(robot: RobotModel, scene: Scene, name: str, body: dict[str, Any], **positions: list[float]) -> list[float]:
    member = CONDITIONS[name]
    spec = member.spec.model_validate(body)
    assert not member.check(spec, CheckContext(robot, scene))
    found = states(scene, **positions)
    world = World(robot, scene, found.map(lambda a: a[0]), period=0.01)
    assert member.absent(spec, world) is None
    reading = member.open(spec, world)(StateWindow(found, None, (), (), ()))
    return [float(v) for v in reading.margins]


@pytest.mark.parametrize(
    ("name", "body", "positions", "expected"),
    [
        ("joint_at", {"joint": "door/hinge", "at": 1.0, "within": 0.1}, {"door": [1.0, 1.2, 0.95]}, [0.1, -0.1, 0.05]),
        ("joint_at", {"joint": "door/hinge", "above": 0.5, "below": 1.5}, {"door": [0.6, 1.6]}, [0.1, -0.1]),
        ("joint_at", {"joint": "cabinet/slide", "at": 0.1}, {"cabinet": [0.1, 0.12]}, [0.01, -0.01]),
        ("opened", {"object": "door", "by": 0.5}, {"door": [0.2, 0.8]}, [-0.5, 0.1]),
        ("opened", {"object": "cabinet/drawer", "by": 0.1}, {"cabinet": [0.0, 0.15]}, [-0.1, 0.05]),
        ("closed", {"object": "door"}, {"door": [0.2, 0.0]}, [0.0873, -0.1127]),
        ("closed", {"object": "cabinet", "within": 0.02}, {"cabinet": [0.0, 0.05]}, [0.02, -0.03]),
    ],
)  # fmt: skip
def test_the_margin_is_the_distance_of_the_joint(
    robot: RobotModel, scene: Scene, name: str, body: dict[str, Any], positions: dict[str, list[float]],
    expected: list[float],
) -> None:  # fmt: skip
    assert margins(robot, scene, name, body, **positions) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "body", "words"),
    [
        ("joint_at", {"joint": "door/hing", "at": 1.0}, "no joint 'door/hing'"),
        ("opened", {"object": "ball", "by": 0.1}, "'ball' has no joint"),
        ("opened", {"object": "dor", "by": 0.1}, "'dor' is not in the scene"),
        ("opened", {"object": "cabinet", "by": 0.3}, "opens by at most 220 mm"),
    ],
)
def test_what_has_no_such_joint_is_refused(
    robot: RobotModel, scene: Scene, name: str, body: dict[str, Any], words: str
) -> None:
    member = CONDITIONS[name]
    (found,) = member.check(member.spec.model_validate(body), CheckContext(robot, scene))
    assert words in found.message


@pytest.mark.parametrize(
    "body", [{}, {"at": 1.0, "above": 0.5}, {"above": 1.0, "below": 0.5}, {"below": 1.0, "within": 0.1}]
)
def test_bounds_that_contradict_each_other_are_refused(body: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"at|above|within"):
        CONDITIONS["joint_at"].spec.model_validate({"joint": "door/hinge"} | body)


def test_an_engine_that_moves_nothing_says_so(robot: RobotModel, scene: Scene) -> None:
    member = CONDITIONS["closed"]
    spec = member.spec.model_validate({"object": "door"})
    still = World(robot, scene, states(scene, door=[0.2]), physics=False)
    assert "never moved" in str(member.absent(spec, still))
