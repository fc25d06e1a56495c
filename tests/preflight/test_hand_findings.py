"""Fingers without collision shapes and concave ones, with the line of the robot file that helps."""

from __future__ import annotations

from pathlib import Path

from manipcli.core.errors import Diagnostic
from manipcli.preflight.check_files import check_files

CORNERS = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
FACES = [(1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2), (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5)]
FACES += [(2, 6, 8), (2, 8, 4)]
JAW = "<{kind}><geometry>{shape}</geometry></{kind}>"
BOX, MESH = '<box size="0.02 0.02 0.06"/>', '<mesh filename="fork.obj"/>'
ROBOT = """robot: pincer
description: pincer.urdf
groups: {arm: {joints: [up]}, hand: {joints: [left, right]}}
poses: {open: {hand: [0.03, 0.03]}, closed: {hand: [0, 0]}}
"""


def fork() -> str:
    """Two prongs with a gap as wide as they are."""
    lines = [f"v {0.01 * x + at} {0.01 * y} {0.05 * z}" for at in (0.0, 0.02) for x, y, z in CORNERS]
    lines += [f"f {a + first} {b + first} {c + first}" for first in (0, 8) for a, b, c in FACES]
    return "\n".join(lines) + "\n"


def checked(folder: Path, left: str, right: str, more: str = "") -> list[Diagnostic]:
    mass = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    limit = '<limit lower="0" upper="0.04" effort="50" velocity="1"/>'
    joint = '<joint name="{}" type="prismatic"><parent link="{}"/><child link="{}"/><axis xyz="0 {} 0"/>{}</joint>'
    links = "".join(
        f'<link name="{name}">{mass}{shapes}</link>'
        for name, shapes in (("base", ""), ("palm", ""), ("finger_l", left), ("finger_r", right))
    )
    joints = joint.format("up", "base", "palm", 0, limit).replace("0 0 0", "0 0 1")
    joints += joint.format("left", "palm", "finger_l", 1, limit) + joint.format("right", "palm", "finger_r", -1, limit)
    (folder / "pincer.urdf").write_text(f'<robot name="pincer">{links}{joints}</robot>')
    (folder / "fork.obj").write_text(fork())
    (folder / "robot.yaml").write_text(ROBOT + more)
    findings = check_files([folder / "robot.yaml"])
    assert not [finding for finding in findings if finding.severity == "error"]
    return [finding for finding in findings if finding.code in ("ROBOT349", "ROBOT358")]


def test_a_hand_that_can_only_be_seen_gets_its_remedy(tmp_path: Path) -> None:
    seen = JAW.format(kind="visual", shape=BOX)
    (found,) = checked(tmp_path, seen, seen)
    assert found.message == "the hand has no collision shapes and touches nothing: finger_l, finger_r"
    assert found.hint == "add `collision: from_visual` to use its visual shapes"
    assert checked(tmp_path, seen, seen, "collision: from_visual\n") == []


def test_a_single_bare_finger_and_one_without_any_shape_are_named(tmp_path: Path) -> None:
    (found,) = checked(tmp_path, JAW.format(kind="collision", shape=BOX), "")
    assert found.message == "1 of 2 fingers have no collision shapes and touch nothing: finger_r"
    assert found.hint == "add <collision> shapes to the description"


def test_a_concave_jaw_is_proposed_for_convex_parts(tmp_path: Path) -> None:
    box, mesh = (JAW.format(kind="collision", shape=shape) for shape in (BOX, MESH))
    (found,) = checked(tmp_path, mesh, box)
    assert found.severity == "note" and "finger_l" in found.message
    assert found.hint == "add `collision_parts: [finger_l]` to split them into convex parts"
    assert checked(tmp_path, mesh, box, "collision_parts: [finger_l]\n") == []
