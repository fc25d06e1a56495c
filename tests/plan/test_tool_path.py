"""Arcs and rounded corners of the tool's path, as geometry."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.tool_path import arc, blended

START = Transform.of(xyz=(0.3, 0.1, 0.2))
END = Transform.of(xyz=(0.5, 0.4, 0.3), rpy=(0.0, 0.0, 0.8))


def points(poses: tuple[Transform, ...]) -> Array:
    return np.array([X.p for X in poses])


def test_an_arc_is_a_circle_through_its_three_points() -> None:
    """The oracle is a least-squares sphere through the points, and the plane of the three."""
    via = np.array([0.6, 0.1, 0.25])
    poses = arc(START, via, END)
    p = points(poses)
    normal = np.cross(via - START.p, END.p - START.p)
    np.testing.assert_allclose((p - START.p) @ normal, 0.0, atol=1e-12)
    rows = np.vstack([np.column_stack((2.0 * p, np.ones(len(p)))), [*normal, 0.0]])
    right = np.append(np.sum(p * p, axis=1), normal @ START.p)
    centre = np.linalg.lstsq(rows, right, rcond=None)[0][:3]
    np.testing.assert_allclose(np.ptp(np.linalg.norm(p - centre, axis=1)), 0.0, atol=1e-9)
    spacing = np.linalg.norm(np.diff(p, axis=0), axis=1)
    assert np.min(np.linalg.norm(p - via, axis=1)) <= 0.5 * spacing.max() + 1e-9
    assert spacing.max() <= 0.005 + 1e-9
    assert poses[0] is START and poses[-1] is END


def test_the_orientation_changes_at_a_constant_rate() -> None:
    poses = arc(START, np.array([0.6, 0.1, 0.25]), END)
    yaw = np.array([np.arctan2(X.R[1, 0], X.R[0, 0]) for X in poses])
    np.testing.assert_allclose(np.diff(yaw), 0.8 / (len(poses) - 1), atol=1e-3 / len(poses))


def test_a_rounded_corner_leaves_its_segments_where_stated_and_is_smooth() -> None:
    corner, radius = np.array([0.6, 0.1, 0.2]), 0.06
    p = points(blended(START, [(corner, radius)], END))
    before, after = (corner - START.p), (END.p - corner)
    before, after = before / np.linalg.norm(before), after / np.linalg.norm(after)

    def off(q: Array, origin: Array, along: Array) -> Array:
        return np.asarray(np.linalg.norm(np.cross(q - origin, along), axis=1))

    near = np.linalg.norm(p - corner, axis=1)
    on_line = np.minimum(off(p, corner, before), off(p, corner, after))
    assert np.all(on_line[near >= radius] < 1e-9)
    assert 0.0 < np.min(near) < radius
    steps = np.diff(p, axis=0)
    turns = np.arccos(np.clip(np.sum(steps[1:] * steps[:-1], axis=1) / np.linalg.norm(steps[1:], axis=1)
                              / np.linalg.norm(steps[:-1], axis=1), -1.0, 1.0))  # fmt: skip
    assert turns.max() < 0.35 * np.sum(turns)  # no kink: the corner is spread over several points
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), np.linalg.norm(steps, axis=1).mean(), rtol=0.05)


@pytest.mark.parametrize(
    ("vias", "text"),
    [
        ([((0.6, 0.1, 0.2), 0.5)], "the rounded corners overlap"),
        ([((0.3, 0.1, 0.2), 0.05)], "are equal"),
        ([((0.1, -0.2, 0.1), 0.05)], "turns back"),
    ],
)
def test_impossible_corners_are_refused(vias: list[tuple[tuple[float, ...], float]], text: str) -> None:
    with pytest.raises(NotPlannable, match=text):
        blended(START, [(np.array(p), radius) for p, radius in vias], END)


def test_an_arc_needs_three_points_off_a_line() -> None:
    with pytest.raises(NotPlannable, match="on a line"):
        arc(START, 0.5 * (START.p + END.p), END)


def test_an_arc_through_two_equal_points_has_no_plane() -> None:
    beside = Transform.of(xyz=START.p + np.array([0.0, 0.0, 5e-4]))
    with pytest.raises(NotPlannable, match="the start and the end of the arc are less than 1 mm apart"):
        arc(START, np.array([0.6, 0.1, 0.2]), beside)
    with pytest.raises(NotPlannable, match="the start and `via` of the arc"):
        arc(START, START.p, END)
