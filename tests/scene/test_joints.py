"""Joints of a scene: their position is found again from poses, the path is that of the joint, twists are its rates."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, frozen, rotation_between
from manipcli.scene.joints import SceneJoint, carried_by, joints_of, root_of

PARENT = Transform.of(xyz=(0.4, -0.2, 0.9), rpy=(0.3, -0.7, 1.9))
AXIS = frozen(np.array([2.0, -1.0, 0.5]) / np.linalg.norm([2.0, -1.0, 0.5]))


def joint(
    kind: Literal["revolute", "continuous", "prismatic"], lower: float = -1.0, upper: float = 4.0, start: float = 0.0
) -> SceneJoint:
    X_PJ = Transform.of(xyz=(0.1, 0.2, -0.3), rpy=(-0.4, 0.2, 0.8))
    return SceneJoint("door/j", kind, "door", "door/panel", X_PJ, AXIS, lower, upper, start)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_the_position_is_found_from_the_poses(kind: Literal["revolute", "prismatic"]) -> None:
    """Over the whole range of the limits, also beyond half a revolution; in one call for many states."""
    one, values = joint(kind), np.linspace(-1.0, 4.0, 23)
    poses = [one.child_pose(PARENT, float(q)) for q in values]
    np.testing.assert_allclose([one.position(PARENT, X_WC) for X_WC in poses], values, atol=1e-12)
    p, quat = np.array([X.p for X in poses]), np.array([X.quat_xyzw for X in poses])
    np.testing.assert_allclose(one.positions(PARENT.p, PARENT.quat_xyzw, p, quat), values, atol=1e-12)


def test_an_endless_joint_is_near_its_start() -> None:
    one = joint("continuous", -math.inf, math.inf, start=10.0)
    assert one.position(PARENT, one.child_pose(PARENT, 10.5)) == pytest.approx(10.5, abs=1e-12)
    assert one.position(PARENT, one.child_pose(PARENT, 10.5 + 2 * math.pi)) == pytest.approx(10.5, abs=1e-12)


def test_the_distance_to_a_goal_is_the_shorter_way_round_of_an_endless_joint_only() -> None:
    """A dial that was turned by 270 deg is measured at -90 deg."""
    endless, door = joint("continuous", -math.inf, math.inf), joint("revolute", 0.0, 4.8)
    q = endless.position(PARENT, endless.child_pose(PARENT, math.radians(270)))
    assert math.degrees(q) == pytest.approx(-90)
    assert endless.apart(q, math.radians(270)) == pytest.approx(0.0, abs=1e-12)
    assert math.degrees(endless.apart(q, math.radians(265))) == pytest.approx(5)
    assert math.degrees(door.apart(0.0, math.radians(270))) == pytest.approx(-270)


def test_a_hinge_keeps_the_points_of_its_axis_and_a_slide_the_orientation() -> None:
    hinge, slide = joint("revolute"), joint("prismatic")
    on_axis = np.outer([-0.3, 0.0, 0.7], AXIS)
    places = [hinge.child_pose(PARENT, q).apply(on_axis) for q in (0.0, 1.3, -0.9)]
    np.testing.assert_allclose(places[1:], [places[0]] * 2, atol=1e-15)
    still, moved = (slide.child_pose(PARENT, q) for q in (0.0, 0.25))
    np.testing.assert_allclose(moved.R, still.R, atol=1e-15)
    assert np.linalg.norm(moved.p - still.p) == pytest.approx(0.25, abs=1e-15)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_the_twist_is_the_derivative_of_the_path(kind: Literal["revolute", "prismatic"]) -> None:
    """Central differences of the pose of the child while parent and joint both move; and back to the joint's rate."""
    one, twist, rate, h = joint(kind), np.array([0.2, -0.5, 0.1, 0.7, 0.3, -0.6]), 1.7, 1e-6

    def child(t: float) -> Transform:
        angle = float(np.linalg.norm(twist[3:])) * t
        half = np.sin(angle / 2) * twist[3:] / np.linalg.norm(twist[3:])
        turned = Transform.of(quat_xyzw=(*half, np.cos(angle / 2)))
        X_WP = Transform.of(xyz=PARENT.p + twist[:3] * t, R=turned.R @ PARENT.R)
        return one.child_pose(X_WP, 0.4 + rate * t)

    before, now, after = child(-h), child(0.0), child(h)
    found = one.child_twist(PARENT, twist, now, rate)
    np.testing.assert_allclose(found[:3], (after.p - before.p) / (2 * h), atol=1e-8)
    turn: Array = rotation_between(before.quat_xyzw, after.quat_xyzw)
    np.testing.assert_allclose(found[3:], turn / (2 * h), atol=1e-8)
    assert one.velocity(PARENT, twist, now, found) == pytest.approx(rate, abs=1e-12)
    many = one.velocities(PARENT.quat_xyzw, np.array([now.p - PARENT.p] * 2), twist, np.array([found] * 2))
    np.testing.assert_allclose(many, rate, atol=1e-12)


def test_what_moves_with_a_body() -> None:
    origin = Transform.identity()
    chain = tuple(
        SceneJoint(f"a/{name}", "revolute", parent, child, origin, AXIS, -1, 1)
        for name, parent, child in (("i", "a", "a/b"), ("j", "a/b", "a/c"), ("k", "a", "a/d"))
    )
    assert carried_by(chain, "a/b") == ("a/c",)
    assert carried_by(chain, "a") == ("a/b", "a/c", "a/d")
    assert root_of(chain, "a/c") == "a" and root_of(chain, "x") == "x"
    assert [one.name for one in joints_of(chain, "a/c")] == ["a/j"]
    assert len(joints_of(chain, "a")) == 3 and not joints_of(chain, "ab")
