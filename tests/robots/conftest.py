"""Small arms of four and five joints with a hand of two sliding fingers, as files in a folder."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest
import yaml

Row = tuple[str, str, tuple[float, float, float], float]
"""A joint: type, axis, where it is in the link before [m], and half its range [rad or m]."""

_TURN: Final = ("revolute", "0 0 1", (0.0, 0.0, 0.06), 2.9)
# The plane of the arm passes the axis of the base at 12 mm, so the hand never points straight away from it.
_SHOULDER: Final = ("revolute", "0 1 0", (0.0, 0.012, 0.06), 2.0)
_ELBOW: Final = ("revolute", "0 1 0", (0.0, 0.0, 0.2), 2.6)
_WRIST: Final = ("revolute", "0 1 0", (0.0, 0.0, 0.2), 2.2)
ARMS: Final[dict[str, tuple[Row, ...]]] = {
    "five": (_TURN, _SHOULDER, _ELBOW, _WRIST, ("revolute", "0 0 1", (0.0, 0.0, 0.04), 2.9)),
    "four": (_TURN, _SHOULDER, _ELBOW, _WRIST),
    "palletizer": (
        _TURN,
        _SHOULDER,
        ("mimic joint_2", "0 1 0", (0.0, 0.0, 0.2), 2.0),
        ("revolute", "0 1 0", (0.0, 0.0, 0.03), 2.6),
        ("mimic joint_4", "0 1 0", (0.0, 0.0, 0.2), 2.6),
        ("revolute", "0 0 1", (0.03, 0.0, 0.0), 2.9),
    ),
    "scara": (
        ("revolute", "0 0 1", (0.0, 0.0, 0.26), 2.9),
        ("revolute", "0 0 1", (0.2, 0.0, 0.0), 2.6),
        ("prismatic", "0 0 1", (0.2, 0.0, 0.0), 0.12),
        ("revolute", "0 0 1", (0.0, 0.0, -0.06), 2.9),
    ),
}
"""The first two are upright in their zero pose; the others always point the hand down. A joint `mimic JOINT` turns
against that joint, as the rods of a palletizer do."""
HOME: Final = {
    "five": [0.0, 0.0, 1.57, 1.57, 0.0],
    "four": [0.0, 0.0, 1.57, 1.57],
    "palletizer": [0.0, -0.3, 1.6, 0.0],
    "scara": [-0.6, 1.2, 0.05, 0.0],
}
STIFFNESS: Final = {
    "five": (120.0, 120.0, 60.0, 20.0, 3.0),
    "four": (120.0, 120.0, 60.0, 20.0),
    "palletizer": (120.0, 120.0, 60.0, 3.0),
    "scara": (120.0, 60.0, 2000.0, 3.0),
}
"""[N m/rad or N/m] Of the joints, from the base."""
HAND: Final = 0.04
"""[m] From the last joint to the palm's face; the tool is 4 cm further, between the finger tips."""

TASK: Final = """\
task: pick_place
robot: robot.yaml
controllers: controllers.yaml
scene:
  table: {{box: {{size: [0.8, 0.8, 0.04]}}, pose: {{xyz: [0.5, 0, -0.02]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 50 g, rests_on: table, at: {at}, friction: 0.9}}
start: home
steps:
  - pick: {{object: block, approach: {approach}, grasp: {{posture: closed, force: 7 N}}}}
  - lift: {{object: block, by: [6 cm, 12 cm]}}
  - place: {{object: block, at: {to}, onto: table}}
  - move: {{to: home}}
expect:
  - near: {{object: block, to: [{to[0]}, {to[1]}, 0.02], within: 1 cm}}
"""


def write_arm(folder: Path, kind: str) -> None:
    """`arm.urdf`, `robot.yaml` and `controllers.yaml` of one of `ARMS`."""
    rows = ARMS[kind]
    names = [f"joint_{k}" for k, row in enumerate(rows, start=1) if not row[0].startswith("mimic")]
    down = -1.0 if kind in ("palletizer", "scara") else 1.0
    parts = [_link("base", (0.0, 0.0, 0.04), 1.0, 0.1)]
    for k, (type_, axis, at, half) in enumerate(rows, start=1):
        ahead = rows[k][2] if k < len(rows) else (0.0, 0.0, down * HAND)
        parts.append(_joint(f"joint_{k}", type_, f"link_{k - 1}" if k > 1 else "base", f"link_{k}", axis, at, half))
        parts.append(_link(f"link_{k}", ahead, 0.2))
    last = f"link_{len(rows)}"
    for side, sign in (("left", 1), ("right", -1)):
        at = (0.0, 0.005 * sign, down * HAND)
        parts.append(_joint(f"finger_{side}", "prismatic", last, side, f"0 {sign} 0", at, 0.03))
        parts.append(_link(side, (0.0, 0.0, down * 0.06), 0.03, 0.01))
    (folder / "arm.urdf").write_text(f'<robot name="{kind}">\n' + "".join(parts) + "</robot>\n")
    hand = ["finger_left", "finger_right"]
    robot = {
        "robot": kind,
        "description": "arm.urdf",
        "groups": {"arm": {"joints": names, "tip": last}, "hand": {"joints": hand}},
        "poses": {
            "home": {"arm": HOME[kind], "hand": "open"},
            "open": {"hand": [0.03, 0.03]},
            "closed": {"hand": [0.0, 0.0]},
        },
        "tool": {"link": last, "pose": {"xyz": [0, 0, down * (HAND + 0.04)], "rpy": [math.acos(down), 0, 0]}},
        "limits": {f"joint_{k + 1}": {"acceleration": 8} for k in range(len(rows))}
        | {name: {"acceleration": 2} for name in hand},
    }
    controllers = {
        "arm_controller": {
            "type": "joint_trajectory",
            "joints": names,
            "command_interface": "effort",
            "inverse_dynamics": True,
            "gains": {name: {"p": p, "d": 0.01 * p} for name, p in zip(names, STIFFNESS[kind], strict=True)},
        },
        "hand_controller": {
            "type": "gripper",
            "joints": hand,
            "gains": {name: {"p": 2000, "d": 20} for name in hand},
            "speed": 0.05,
        },
    }
    (folder / "robot.yaml").write_text(yaml.safe_dump(robot, sort_keys=False))
    (folder / "controllers.yaml").write_text(yaml.safe_dump({"controllers": controllers}, sort_keys=False))


@pytest.fixture
def few_joints(tmp_path: Path) -> Callable[..., Path]:
    """Writes the files of an arm, and a task that picks a block at a place and sets it down at another."""

    def write(kind: str, *, at: tuple[float, float], to: tuple[float, float], approach: str = "{}") -> Path:
        write_arm(tmp_path, kind)
        task = tmp_path / "task.yaml"
        task.write_text(TASK.format(at=list(at), to=list(to), approach=approach))
        return task

    return write


def _link(name: str, ahead: tuple[float, float, float], mass: float, thick: float = 0.03) -> str:
    """A box along the way to the next joint, clear of both."""
    size = [max(0.6 * abs(length), thick) for length in ahead]
    xx, yy, zz = (side * side for side in size)
    ixx, iyy, izz = (f"{mass / 12 * both + 1e-5:.3e}" for both in (yy + zz, xx + zz, xx + yy))
    middle, sides = (" ".join(f"{value:g}" for value in values) for values in ([length / 2 for length in ahead], size))
    origin, box = f'<origin xyz="{middle}"/>', f'<geometry><box size="{sides}"/></geometry>'
    return (
        f' <link name="{name}">\n  <inertial>{origin}<mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>\n'
        f"  <visual>{origin}{box}</visual>\n  <collision>{origin}{box}</collision>\n </link>\n"
    )


def _joint(
    name: str, type_: str, parent: str, child: str, axis: str, at: tuple[float, float, float], half: float
) -> str:
    leader = type_.removeprefix("mimic ") if type_.startswith("mimic") else ""
    mimic = f'<mimic joint="{leader}" multiplier="-1"/>' if leader else ""
    type_ = "revolute" if leader else type_
    lower = 0.0 if name.startswith("finger") else -half
    xyz = " ".join(f"{value:g}" for value in at)
    return (
        f' <joint name="{name}" type="{type_}">\n  <parent link="{parent}"/><child link="{child}"/>\n'
        f'  <origin xyz="{xyz}"/><axis xyz="{axis}"/>\n'
        f'  <limit lower="{lower}" upper="{half}" velocity="2" effort="40"/>{mimic}\n </joint>\n'
    )
