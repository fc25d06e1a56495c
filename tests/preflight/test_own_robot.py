"""What goes wrong with a robot of one's own: told before anything runs, where it is written, and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.preflight.check_files import check_files
from manipcli.task.load_task import load_task

INERTIAL = '<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
FINGER = '<collision><geometry><box size="0.01 0.01 0.04"/></geometry></collision>'
ROBOT = """\
robot: scara
description: scara.urdf
groups:
  arm: {chain: {base: base, tip: wrist}}
  hand: {joints: [l, r], tip: wrist}
poses:
  open: {hand: [0.04, 0.04]}
  shut: {hand: [0, 0]}
tool: {link: wrist, pose: {xyz: [0, 0, -0.06]}}  # its +z is up
"""
CONTROLLERS = """\
controllers:
  arm:
    type: joint_trajectory
    joints: [x, y, z, w]
    command_interface: effort
    inverse_dynamics: true
    gains: {x: {p: 300, d: 12}, y: {p: 300, d: 12}, z: {p: 300, d: 12}, w: {p: 300, d: 12}}
  hand: {type: gripper, joints: [l, r], command_interface: position}
"""
SCENE = """\
task: pick
robot: scara.yaml
controllers: controllers.yaml
scene:
  can: {cylinder: {radius: 20 mm, height: 80 mm}, mass: 100 g, rests_on: floor, at: [0.4, 0.2]}
  tray: {tray: {size: [0.2, 0.2, 0.05]}, rests_on: floor, at: [0.0, 0.4], fixed: true}
"""
FOLLOW = """\
  - follow:
      joint_names: [x, y]
      points:
        - {positions: [0, 0.1], time_from_start: 1}
        - {positions: [0, 2.81], time_from_start: 60}
"""


def joint(name: str, type_: str, parent: str, child: str, xyz: str, axis: str, upper: float) -> str:
    limits = f'lower="{-upper if type_ == "revolute" else min(0.0, upper)}" upper="{max(0.0, upper)}"'
    return (
        f'<joint name="{name}" type="{type_}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit {limits} velocity="2" effort="200"/></joint>'
    )


def write(folder: Path, steps: str, *, fore: str = INERTIAL, can: str = "can") -> Path:
    """The files of a SCARA with two fingers, which points straight down and nowhere else, and of a task of it."""
    bodies = {"base": INERTIAL, "upper": INERTIAL, "fore": fore, "quill": INERTIAL, "wrist": INERTIAL}
    bodies |= dict.fromkeys(("left", "right"), INERTIAL + FINGER)
    parts = [f'<link name="{name}">{body}</link>' for name, body in bodies.items()]
    parts += [
        joint("x", "revolute", "base", "upper", "0 0 0.5", "0 0 1", 2.9),
        joint("y", "revolute", "upper", "fore", "0.35 0 0", "0 0 1", 2.8),
        joint("z", "prismatic", "fore", "quill", "0.3 0 0", "0 0 1", -0.4),
        joint("w", "revolute", "quill", "wrist", "0 0 -0.05", "0 0 1", 3.1),
        joint("l", "prismatic", "wrist", "left", "0 0.005 -0.05", "0 1 0", 0.04),
        joint("r", "prismatic", "wrist", "right", "0 -0.005 -0.05", "0 -1 0", 0.04),
    ]
    (folder / "scara.urdf").write_text("\n".join(["<robot name='scara'>", *parts, "</robot>"]))
    (folder / "scara.yaml").write_text(ROBOT)
    (folder / "controllers.yaml").write_text(CONTROLLERS)
    task = folder / "task.yaml"
    task.write_text(f"{SCENE.replace('can:', f'{can}:')}steps:\n{steps}")
    return task


def errors(task: Path) -> list[tuple[str, Diagnostic]]:
    """Where each error that `check` tells is, and the error."""
    found = [finding for finding in check_files([task]) if finding.severity == "error"]
    return [(str(finding.place).removeprefix(f"{task.parent}/"), finding) for finding in found]


@pytest.mark.parametrize(
    ("step", "place", "told"),
    [
        ("  - move: {to: {y: 0, x: 5}}\n", "task.yaml:8:26", "'move_1': joint 'x' goes to 5.0000 rad, beyond its"),
        ("  - move: {to: {l: 50 mm}}\n", "task.yaml:8:20", "'move_1': joint 'l' goes to 0.0500 m, beyond its upper"),
        (FOLLOW, "task.yaml:12:27", "'follow_1': joint 'y' goes to 2.8100 rad at t = 60.000 s, beyond"),
        ("  - move: {pose: {xyz: [3, 0, 0]}}\n", "task.yaml:8:5", "'move_1': no joint positions reach (3.000"),
    ],
)
def test_check_tells_a_step_that_cannot_be_planned_at_its_cause(
    step: str, place: str, told: str, tmp_path: Path
) -> None:
    ((where, error),) = errors(write(tmp_path, step))
    assert (where, error.code) == (place, "PLAN100")
    assert error.message.startswith(f"step {told}")


def test_a_tool_that_cannot_point_so_is_told_apart_from_an_object_out_of_reach(tmp_path: Path) -> None:
    pick = "  - pick: {{object: can, approach: {{from: {}}}, grasp: {{posture: shut}}}}\n"
    for way, miss, other in (("top", "180.0 deg off", "side"), ("side", "90.0 deg off", "top")):
        ((_, error),) = errors(write(tmp_path, pick.format(way)))
        assert miss in error.message
        assert error.hint is not None
        assert "the tool's +z must point to the object" in error.hint
        assert f"or set `approach: {{from: {other}}}`" in error.hint
    task = write(tmp_path, pick.format("top"))
    (tmp_path / "scara.yaml").write_text(ROBOT.replace("-0.06]", "-0.06], rpy: [180 deg, 0, 0]"))
    assert errors(task) == []


def test_a_body_named_like_a_link_is_told_at_the_body(tmp_path: Path) -> None:
    ((where, error),) = errors(write(tmp_path, "  - wait: 1 s\n", can="fore"))
    assert (where, error.code) == ("task.yaml:5:9", "TASK220")
    assert error.message == "scene.fore: robot 'scara' has a link of this name"


@pytest.mark.parametrize("fore", ["", '<inertial><mass value="0"/></inertial>'])
def test_a_link_without_mass_is_told_at_the_link(fore: str, tmp_path: Path) -> None:
    ((where, error),) = errors(write(tmp_path, "  - wait: 1 s\n", fore=fore))
    assert (where, error.code) == ("scara.urdf:4:1", "SIM121")
    assert error.message.startswith("link 'fore' has no mass")
    assert "moved by joint 'y'" in error.message


@pytest.mark.parametrize(
    "override", ["scene.can.at=[0.02, 0.4]", "scene.tray.at.0=0.4", "scene.tray.tray.size=[2, 2, 1]"]
)
def test_bodies_that_an_argument_put_into_each_other_are_told_at_the_argument(override: str, tmp_path: Path) -> None:
    task = write(tmp_path, "  - wait: 1 s\n")
    overrides = [override, "scene.can.mass=80 g", *(["scene.tray.at.1=0.2"] if ".0=" in override else [])]
    with pytest.raises(InvalidInput) as refused:
        load_task(task, overrides=overrides)
    (finding,) = refused.value.findings
    assert (finding.code, str(finding.place)) == ("TASK226", f"--set {override}")
