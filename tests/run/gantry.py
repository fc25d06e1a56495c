"""A gantry with a hand: three sliding joints and a yaw joint that carries the link `palm`, z out of the hand."""

from __future__ import annotations

from pathlib import Path


def mass(kg: float, moment: float) -> str:
    moments = " ".join(f'{name}="{moment if name in ("ixx", "iyy", "izz") else 0}"' for name in MOMENTS)
    return f'<inertial><mass value="{kg}"/><inertia {moments}/></inertial>'


MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
LIMIT = '<limit lower="-0.5" upper="0.5" effort="500" velocity="1"/>'
LINKS = "".join(f'<link name="{name}">{mass(2, 0.02)}</link>' for name in ("rail", "bridge", "trolley", "quill"))
JOINTS = f"""
  <joint name="x" type="prismatic"><parent link="rail"/><child link="bridge"/><axis xyz="1 0 0"/>{LIMIT}</joint>
  <joint name="y" type="prismatic"><parent link="bridge"/><child link="trolley"/><axis xyz="0 1 0"/>{LIMIT}</joint>
  <joint name="z" type="prismatic"><parent link="trolley"/><child link="quill"/><axis xyz="0 0 -1"/>{LIMIT}</joint>
  <joint name="yaw" type="revolute"><parent link="quill"/><child link="palm"/><origin rpy="3.14159265358979 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="50" velocity="3"/></joint>"""
ROBOT = """robot: gantry
description: gantry.urdf
mount: {xyz: [0, 0, 0.55]}
groups: {arm: {chain: {base: rail, tip: palm}}GROUP}
poses: {home: {arm: [0, 0, 0.1, 0]}POSES}
tool: {link: palm, pose: {xyz: [0, 0, TOOL]}, holding: HOLDING}
default_acceleration: 4
"""
CONTROLLERS = """controllers:
  arm: {type: joint_trajectory, joints: [x, y, z, yaw], command_interface: position}
"""
TASK = """task: gantry
robot: robot.yaml
controllers: controllers.yaml
start: home
simulation: {engine: ENGINE}
scene:
  table: {box: {size: [1.2, 1.2, 0.1]}, pose: {xyz: [0, 0, 0.05]}, fixed: true}
  block: {box: {size: [0.04, 0.04, 0.04]}, at: [0.1, 0.1], rests_on: table, mass: MASS}
steps:
  - pick: {object: block, approach: {from: top}, grasp: {force: 5 N}}
  - lift: {object: block, by: 6 cm}
"""
PLACE = """  - place: {object: block, at: [-0.1, 0], onto: table, clearance: 3 cm}
expect:
  - near: {object: block, to: [-0.1, 0, 0.12], within: 2 mm}
"""


def written(
    folder: Path,
    hand: str,
    *,
    engine: str,
    mass: str,
    holding: str = "friction",
    tool: float = 0.0,
    joint: str = "",
    opened: float = 0.0,
    closed: float = 0.0,
    more: str = "",
) -> Path:
    """The path of a task: pick, lift, and `more`. `hand`: URDF of the palm and all below; `joint`: that drives it."""
    (folder / "gantry.urdf").write_text(f'<robot name="gantry">{LINKS}{hand}{JOINTS}</robot>')
    group = f", hand: {{joints: [{joint}]}}" if joint else ""
    poses = f", open: {{hand: [{opened}]}}, closed: {{hand: [{closed}]}}" if joint else ""
    robot = ROBOT.replace("GROUP", group).replace("POSES", poses).replace("TOOL", str(tool)).replace("HOLDING", holding)
    (folder / "robot.yaml").write_text(robot)
    gains = f"gains: {{{joint}: {{p: 20, d: 0.2}}}}"
    gripper = f"  hand: {{type: gripper, joints: [{joint}], command_interface: effort, {gains}}}\n" if joint else ""
    (folder / "controllers.yaml").write_text(CONTROLLERS + gripper)
    (folder / "task.yaml").write_text(TASK.replace("ENGINE", engine).replace("MASS", mass) + more)
    return folder / "task.yaml"
