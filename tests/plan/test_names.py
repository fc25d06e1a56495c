from __future__ import annotations

from collections.abc import Callable
from typing import Any

from manipcli.conditions.condition import unknown_body
from manipcli.conditions.frames import unknown_frame
from manipcli.plan.unknown_names import unknown_joint, unknown_pose

Make = Callable[..., Any]  # fixture of conftest.py: a Bench of a robot and a scene


def test_what_is_known_is_no_problem(bench: Make) -> None:
    arm = bench(more="frames: {above: {parent: cup}}")
    assert unknown_pose(arm.robot, "home", ()) == ()
    assert unknown_joint(arm.robot, "joint_1", ()) == ()
    assert unknown_body(arm.scene, "desk", ()) == ()
    for name in ("world", "base", "tool", "cup", "above", "floor"):
        assert unknown_frame(arm.robot, arm.scene, name, ()) == ()


def test_what_is_not_known_is_told_at_its_place_with_the_nearest(bench: Make) -> None:
    arm = bench()
    (problem,) = unknown_pose(arm.robot, "hone", ("to",))
    assert (problem.loc, problem.hint) == (("to",), "did you mean 'home'?")
    (problem,) = unknown_joint(arm.robot, "joint1", ("a", 0))
    assert (problem.loc, problem.hint) == (("a", 0), "did you mean 'joint_1'?")
    assert unknown_body(arm.scene, "dask", ())[0].hint == "did you mean 'desk'?"
    assert unknown_frame(arm.robot, arm.scene, "tol", ())[0].hint == "did you mean 'tool'?"


def test_a_fixed_body_is_no_movable_one_and_a_mimic_no_joint_to_move(bench: Make) -> None:
    (problem,) = unknown_body(bench().scene, "desk", (), movable=True)
    assert problem.message == "'desk' is not a movable body of the scene"
    assert unknown_joint(bench("panda").robot, "panda_finger_joint2", ())[0].hint == (
        "did you mean 'panda_finger_joint1'?"
    )
