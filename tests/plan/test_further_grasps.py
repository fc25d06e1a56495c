"""Picks for which none of the usual grasps has a plan: a mesh at an angle, and objects behind walls."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Make = Callable[..., Any]
TABLE = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"


def plate(folder: Path, yaw: float) -> Path:
    """A plate of 5 x 16 x 6 cm as a mesh, rotated in the frame of the file, so that its box is too wide for a hand."""
    corners = np.array([*itertools.product((-0.5, 0.5), repeat=3)]) * (0.05, 0.16, 0.06)
    c, s = np.cos(yaw), np.sin(yaw)
    corners = corners @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners] + [f"f {a} {b} {c} {d}" for a, b, c, d in faces]
    file = folder / "plate.obj"
    file.write_text("\n".join(lines) + "\n")
    return file


def test_a_mesh_at_an_angle_is_held_across_its_parallel_faces(bench: Make, tmp_path: Path) -> None:
    yaw = np.radians(-45.0)
    body = (
        f"  plate: {{mesh: {{file: {plate(tmp_path, float(yaw))}}}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}}\n"
    )
    panda = bench("panda", scene=TABLE + body)
    plan = panda.do("pick", {"object": "plate", "approach": {"from": "top"}, "grasp": {"posture": "closed"}})
    across = np.array([np.cos(yaw), np.sin(yaw), 0.0])  # the normal of its large faces
    assert abs(panda.planner.tool_pose(plan.end).R[:, 1] @ across) > 0.999
    assert plan.end.carried is not None


def test_a_can_behind_a_post_is_taken_from_another_side(bench: Make) -> None:
    """The post is where the hand would be with the usual approaches, at most 35 deg from the line to the can."""
    walls = (
        "  can: {cylinder: {radius: 2 cm, height: 24 cm}, mass: 80 g, rests_on: table, at: [0.5, 0.0]}\n"
        "  post: {box: {size: [0.02, 0.10, 0.24]}, pose: {xyz: [0.43, 0.0, 0.32]}, fixed: true}\n"
    )
    panda = bench("panda", scene=TABLE + walls)
    plan = panda.do("pick", {"object": "can", "approach": {"from": "side"}, "grasp": {"posture": "closed"}})
    z = panda.planner.tool_pose(plan.end).R[:, 2]
    assert abs(z[2]) < 1e-3
    assert abs(np.degrees(np.arctan2(z[1], z[0]))) > 35.1
    assert plan.end.carried is not None
