"""Small arms of four and five joints with a hand of two sliding fingers, as files in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import yaml

Row = tuple[str, str, float, float, float]
"""A joint: type, axis, its offset along y and along z of the link before [m], and half its range [rad or m]."""

ARMS: Final[dict[str, tuple[Row, ...]]] = {
    # The plane of the arm passes the axis of the base at 12 mm, so the hand never points straight away from it.
    "five": (
        ("revolute", "0 0 1", 0.0, 0.06, 2.9),
        ("revolute", "0 1 0", 0.012, 0.06, 2.0),
        ("revolute", "0 1 0", 0.0, 0.2, 2.6),
        ("revolute", "0 1 0", 0.0, 0.2, 2.2),
        ("revolute", "0 0 1", 0.0, 0.04, 2.9),
    ),
    "four": (
        ("revolute", "0 0 1", 0.0, 0.06, 2.9),
        ("revolute", "0 1 0", 0.012, 0.06, 2.0),
        ("revolute", "0 1 0", 0.0, 0.2, 2.6),
        ("revolute", "0 1 0", 0.0, 0.2, 2.2),
    ),
}
HOME: Final = {"five": [0.0, 0.0, 1.57, 1.57, 0.0], "four": [0.0, 0.0, 1.57, 1.57]}
HAND: Final = 0.04
"""[m] From the last joint to the palm's face; the tool is 4 cm further, between the finger tips."""


def write_arm(folder: Path, kind: str) -> None:
    """`arm.urdf`, `robot.yaml` and `controllers.yaml` of one of `ARMS`, upright in its zero pose."""
    rows = ARMS[kind]
    names = [f"joint_{k}" for k in range(1, len(rows) + 1)]
    parts = [_link("base", "0.1 0.1 0.04", 0.02, 1.0)]
    for k, (type_, axis, y, z, half) in enumerate(rows, start=1):
        ahead = rows[k][3] if k < len(rows) else HAND
        parts.append(_joint(names[k - 1], type_, f"link_{k - 1}" if k > 1 else "base", f"link_{k}", axis, y, z, half))
        parts.append(_link(f"link_{k}", f"0.03 0.03 {0.6 * ahead:g}", 0.5 * ahead, 0.2))
    last = f"link_{len(rows)}"
    for side, sign in (("left", 1), ("right", -1)):
        parts.append(_joint(f"finger_{side}", "prismatic", last, side, f"0 {sign} 0", 0.005 * sign, HAND, 0.03))
        parts.append(_link(side, "0.02 0.01 0.05", 0.03, 0.03))
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
        "tool": {"link": last, "pose": {"xyz": [0, 0, HAND + 0.04]}},
        "limits": {name: {"acceleration": 8} for name in names} | {name: {"acceleration": 2} for name in hand},
    }
    controllers = {
        "arm_controller": {
            "type": "joint_trajectory",
            "joints": names,
            "command_interface": "effort",
            "inverse_dynamics": True,
            "gains": {name: {"p": 150, "d": 8} for name in names},
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


def _link(name: str, size: str, z: float, mass: float) -> str:
    x, y, height = (float(word) for word in size.split())
    inertia = [mass / 12 * (a * a + b * b) + 1e-5 for a, b in ((y, height), (x, height), (x, y))]
    ixx, iyy, izz = (f"{value:.3e}" for value in inertia)
    origin, box = f'<origin xyz="0 0 {z:g}"/>', f'<geometry><box size="{size}"/></geometry>'
    return (
        f' <link name="{name}">\n  <inertial>{origin}<mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>\n'
        f"  <visual>{origin}{box}</visual>\n  <collision>{origin}{box}</collision>\n </link>\n"
    )


def _joint(name: str, type_: str, parent: str, child: str, axis: str, y: float, z: float, half: float) -> str:
    lower = 0.0 if name.startswith("finger") else -half
    return (
        f' <joint name="{name}" type="{type_}">\n  <parent link="{parent}"/><child link="{child}"/>\n'
        f'  <origin xyz="0 {y:g} {z:g}"/><axis xyz="{axis}"/>\n'
        f'  <limit lower="{lower}" upper="{half}" velocity="2" effort="40"/>\n </joint>\n'
    )
