"""A log with convex parts, of a body and of a link, is simulated again without making them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from manipcli.logs.recorded_files import recorded_robot, recorded_scene
from manipcli.model import link_parts
from manipcli.pipeline import run_task, verify_log
from manipcli.record.read.reading import open_recording
from manipcli.scene import body_files
from manipcli.shapes.primitives import Geometry, Mesh

CONTROLLERS = """
controllers:
  arm_controller: {type: joint_trajectory, joints: [hinge], command_interfaces: [effort], gains: {hinge: {p: 50, d: 5}}}
"""


def corner(path: Path) -> None:
    """An L of two boards, which share an edge."""
    made = []
    for size, p in (((0.2, 0.2, 0.02), (0.0, 0.0, 0.01)), ((0.02, 0.2, 0.2), (0.11, 0.0, 0.1))):
        X = np.eye(4)
        X[:3, 3] = p
        made.append(trimesh.creation.box(size, X))
    trimesh.util.concatenate(made).export(path)


def parts(geometries: tuple[Geometry, ...]) -> list[object]:
    return [each.shape.part for each in geometries if isinstance(each.shape, Mesh)]


def test_it_is_simulated_again_without_making_them(
    pendulum: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    link = """<link name="shield"><collision><geometry><mesh filename="l.stl"/></geometry></collision></link>
<joint name="mounted" type="fixed"><origin xyz="0 1 0"/><parent link="base"/><child link="shield"/></joint>"""
    folder = pendulum("collision_parts: [shield]\n", urdf=link)
    corner(folder / "l.stl")
    (folder / "controllers.yaml").write_text(CONTROLLERS)
    (folder / "task.yaml").write_text(
        "task: parts\nrobot: robot.yaml\ncontrollers: controllers.yaml\nscene:\n"
        "  l: {mesh: {file: l.stl}, mass: 1 kg, rests_on: floor, at: [1, 0]}\n"
        "  can: {cylinder: {radius: 2 cm, height: 5 cm}, mass: 100 g, rests_on: l, at: [0.98, 0]}\n"
        "steps: [{move: {to: {hinge: 10 deg}}}]\n"
    )
    log = folder / "runs" / "parts.mcap"
    log.parent.mkdir()
    report = run_task(folder / "task.yaml", log=log)
    assert report.verdict.verdict == "passed"
    for module in (body_files, link_parts):
        monkeypatch.setattr(module, "convex_parts", pytest.fail)
    recording = open_recording(log)
    robot, scene = recorded_robot(recording, log), recorded_scene(recording, log)
    found = [parts(robot.link("shield").collisions), parts(scene.body("l").geometries)]
    assert [len(each) for each in found] == [2, 2] and found[0] == found[1] and None not in found[0]
    assert verify_log(log).identical
