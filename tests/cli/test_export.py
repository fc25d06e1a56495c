"""`manipcli export --ros2`: reading the files back gives the same plan and the same motion."""

from __future__ import annotations

import os
import re
import stat
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from manipcli.description.expanded import unread_description
from manipcli.description.srdf import read_srdf
from manipcli.description.urdf.urdf import read_parts
from manipcli.model.self_collision_cache import self_collision_matrix
from manipcli.record.definition import Array as ArrayType
from manipcli.record.definition import Message, Number, Text, Type, read_definition
from manipcli.record.read.reading import open_recording
from manipcli.record.schemas import DEFINITIONS
from manipcli.report.ros2.files import _script as ros2_script
from manipcli.report.ros2.goals import LONGEST
from manipcli.report.ros2.srdf import REASONS
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan, plan_task

RunCli = Callable[..., Any]
ROOT = Path(__file__).parents[2]
PICK: dict[str, Any] = {
    "task": "pick",
    "robot": str(ROOT / "robots/panda/robot.yaml"),
    "controllers": str(ROOT / "controllers/panda.yaml"),
    "scene": {
        "table": {"box": {"size": [0.6, 0.8, 0.2]}, "pose": {"xyz": [0.55, 0, 0.1]}, "fixed": True},
        "block": {
            "box": {"size": [0.04, 0.04, 0.05]}, "mass": 0.08, "rests_on": "table", "at": [0.5, -0.15], "friction": 0.9
        },
    },
    "steps": [
        {"pick": {"object": "block", "approach": {"from": "top"}, "grasp": {"force": 7}}},
        {"lift": {"object": "block", "by": [0.08, 0.15]}},
        {"place": {"object": "block", "at": [0.5, 0.0], "onto": "table"}},
    ],
}  # fmt: skip
WRIST: dict[str, Any] = {
    "task": "swing",
    "robot": str(ROOT / "robots/arm7_hand3/robot.yaml"),
    "controllers": "controllers.yaml",
    "start": "home",
    "simulation": {"engine": "kinematic"},
    "steps": [
        {"move": {"to": {"joint_7": 0.3}}},
        {"id": "shut", "grasp": {"posture": "wrap", "until": "posture"}},
        {"switch_controllers": {"to": ["spare"]}},
        {"id": "goal", "follow": {
            "trajectory": {"joint_names": ["joint_7"], "points": [
                {"positions": [0.1], "time_from_start": {"sec": 1}},
                {"positions": [0.3], "velocities": [0.0], "time_from_start": {"sec": 2}},
            ]},
            "path_tolerance": [{"name": "joint_7", "position": 0.2, "velocity": 0.0, "acceleration": 0.0}],
            "goal_time_tolerance": {"sec": 0, "nanosec": 500000000},
        }},
        {"wait": {"duration": 0.5}},
    ],
}  # fmt: skip
ARM = [f"joint_{k}" for k in range(1, 8)]
HAND = [f"finger_{k}_{part}" for k in (1, 2, 3) for part in ("proximal", "distal")]
SPARE: dict[str, Any] = {
    "arm": {"type": "computed_torque", "joints": ARM},
    "spare": {"type": "joint_trajectory", "joints": ARM, "command_interface": "position", "active": False},
    "hand": {"type": "gripper", "joints": HAND, "gains": {name: {"p": 3, "d": 0.02} for name in HAND}},
}

GOALS = {
    "control_msgs/JointTolerance": "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n",
    "control_msgs/GripperCommand": "float64 position\nfloat64 max_effort\n",
    "trajectory_msgs/JointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n"
    ),
}
"""Definitions of control_msgs and trajectory_msgs, besides those that logs embed."""
TYPES = {
    "control_msgs/action/FollowJointTrajectory": (
        "trajectory_msgs/JointTrajectory trajectory\ncontrol_msgs/JointTolerance[] path_tolerance\n"
        "control_msgs/JointTolerance[] goal_tolerance\nbuiltin_interfaces/Duration goal_time_tolerance\n"
    ),
    "control_msgs/action/GripperCommand": "control_msgs/GripperCommand command\n",
}
SRDF = {
    "robot": {"name"}, "group": {"name"}, "chain": {"base_link", "tip_link"}, "group_state": {"name", "group"},
    "end_effector": {"name", "parent_link", "group", "parent_group"}, "passive_joint": {"name"},
    "virtual_joint": {"name", "type", "parent_frame", "child_link"}, "disable_collisions": {"link1", "link2", "reason"},
    "joint": {"name", "value"},
}  # fmt: skip
"""The elements and attributes that srdfdom parses."""


@pytest.fixture(scope="module")
def picked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `task.yaml` and its export in `out`."""
    from manipcli.cli.app import main

    folder = tmp_path_factory.mktemp("picked")
    (folder / "task.yaml").write_text(yaml.safe_dump(PICK, sort_keys=False))
    assert main(["export", str(folder / "task.yaml"), "--allow-outside", "--ros2", str(folder / "out")]) == 0
    return folder


def planned(path: Path) -> Plan:
    return plan_task(load_task(path, allow_outside=True))


def goals(folder: Path) -> list[tuple[str, dict[str, Any]]]:
    return [(file.stem, yaml.safe_load(file.read_text())) for file in sorted((folder / "goals").iterdir())]


def read_back(folder: Path) -> Path:
    """A task that sends the goals of `out`: `follow` for the arm, `grasp` and `release` for the hand."""
    steps: list[dict[str, Any]] = []
    for name, goal in goals(folder / "out"):
        if "trajectory" in goal:
            fingers = [["block", f"robot/panda_{side}finger"] for side in ("left", "right")]
            steps.append({"follow": goal, "allow": [["block", "table"], *fingers]})
        elif name.endswith("close"):
            steps.append({"grasp": {"object": "block", "force": 7}})
        elif name.endswith("open"):
            steps.append({"release": {}})
    path = folder / "back.yaml"
    path.write_text(yaml.safe_dump(PICK | {"controllers": "out/controllers.yaml", "steps": steps}, sort_keys=False))
    return path


def test_a_task_of_the_exported_files_has_the_same_plan_and_makes_the_same_motion(
    picked: Path, call_cli: RunCli
) -> None:
    back = read_back(picked)
    before, after = ([m.trajectory for m in planned(path).motions] for path in (picked / "task.yaml", back))
    for one, other in zip(before, after, strict=True):
        if one is None or other is None:
            assert one is other
            continue
        assert one.names == other.names
        assert other.times[-1] == pytest.approx(one.times[-1], abs=1e-9)
        at = np.arange(0.0, min(one.times[-1], other.times[-1]), 1e-3)
        np.testing.assert_allclose(other.sample(at)[0], one.sample(at)[0], atol=2e-7)
    for name in ("task", "back"):
        ran = call_cli("run", f"{name}.yaml", "--allow-outside", "--log", f"{name}.mcap", "--force", cwd=picked)
        assert ran.code == 0, ran.err
    one, other = (open_recording(picked / f"{name}.mcap").states for name in ("task", "back"))
    grasped = 1450  # [ticks] until the hand closes: contacts amplify differences
    assert len(one.position) == len(other.position)
    np.testing.assert_allclose(other.position[:grasped], one.position[:grasped], atol=5e-6)
    np.testing.assert_allclose(other.position, one.position, atol=1e-4)


def test_every_field_of_a_goal_is_in_the_definition_of_its_action(picked: Path) -> None:
    script = (picked / "out/send_goals.sh").read_text()
    sent = {file: kind for kind, file in re.findall(r"^send \S+ (\S+) (\S+)", script, re.M)}
    assert {*sent.values()} == TYPES.keys()
    for name, goal in goals(picked / "out"):
        kind = sent[f"goals/{name}.yaml"]
        parts = [TYPES[kind], *(f"{'=' * 80}\nMSG: {key}\n{text}" for key, text in (DEFINITIONS | GOALS).items())]
        assert [*strange(goal, read_definition(f"{kind}_Goal", "".join(parts)))] == []
        assert len((picked / f"out/goals/{name}.yaml").read_bytes()) <= LONGEST


def strange(value: Any, kind: Type) -> Iterator[str]:
    """What is not as in the definition."""
    match kind:
        case Message():
            for key, inner in value.items():
                field = kind.field(key)
                yield from [f"{kind.name}.{key}"] if field is None else strange(inner, field.type)
        case ArrayType():
            for item in value:
                yield from strange(item, kind.element)
        case Number():
            if isinstance(value, bool) or not isinstance(value, float if "float" in kind.name else int):
                yield f"{value!r} is not {kind.name}"
        case Text():
            if not isinstance(value, str):
                yield f"{value!r} is not a string"


def test_the_srdf_has_what_srdfdom_parses_and_the_robot_has(picked: Path) -> None:
    robot = load_task(picked / "task.yaml", allow_outside=True).robot
    root = ET.parse(picked / "out/robot.srdf").getroot()
    for element in root.iter():
        assert {*element.attrib} <= SRDF[element.tag]
    assert [group.get("name") for group in root.findall("group")] == ["arm", "hand"]
    assert root.find("group/chain") is not None
    effector = root.find("end_effector")
    assert effector is not None
    assert (effector.get("parent_link"), effector.get("parent_group")) == ("panda_link8", "arm")
    for state in root.findall("group_state"):
        pose = robot.pose(str(state.get("name")))
        values = dict(zip(pose.joints, pose.positions, strict=True))
        assert all(values[str(each.get("name"))] == float(str(each.get("value"))) for each in state)
    disabled = {(e.get("link1"), e.get("link2")): e.get("reason") for e in root.findall("disable_collisions")}
    pairs = self_collision_matrix(robot).pairs
    assert disabled == {(p.a, p.b): REASONS[p.kind] for p in pairs if p.kind != "sometimes"}
    assert {*disabled.values()} >= {"Adjacent", "Never"}


def test_the_srdf_reads_back_as_the_robot(picked: Path) -> None:
    robot = load_task(picked / "task.yaml", allow_outside=True).robot
    read = read_srdf(picked / "out/robot.srdf")
    arm, hand = (read.group(name) for name in ("arm", "hand"))
    assert arm is not None and hand is not None
    assert (arm.chain, hand.joints) == (("panda_link0", "panda_link8"), robot.group("hand").joints)
    for pose in robot.poses:
        states = [state.positions for state in read.states if state.name == pose.name]
        found = {joint: value for state in states for joint, value in state.items()}
        assert found == dict(zip(pose.joints, pose.positions, strict=True))
    assert [effector.parent_link for effector in read.end_effectors] == ["panda_link8"]


def test_the_urdf_is_the_robot_with_the_interfaces_that_its_controllers_claim(picked: Path) -> None:
    task = load_task(picked / "task.yaml", allow_outside=True)
    text = (picked / "out/robot.urdf").read_bytes()
    parts = read_parts(unread_description(text, "robot.urdf"))
    known = read_parts(unread_description(task.robot.urdf.encode(), "robot.urdf"))
    assert [joint.name for joint in parts.joints] == [joint.name for joint in known.joints]
    assert [link.name for link in parts.links] == [link.name for link in known.links]
    offered = {
        joint.get("name"): [each.get("name") for each in joint.findall("command_interface")]
        for joint in ET.fromstring(text).findall("ros2_control/joint")
    }
    claimed = {name: list(own.interfaces) for own in task.controllers.controllers.values() for name in own.joints}
    assert offered == claimed | {"panda_finger_joint2": []}  # a mimic joint


def test_no_path_of_this_machine_is_written(picked: Path) -> None:
    for file in (picked / "out").rglob("*.*"):
        text = file.read_text()
        assert str(ROOT) not in text
        assert str(picked) not in text
        assert not re.search(r'filename="(?!package://)', text)


@pytest.fixture
def ros2(tmp_path: Path) -> dict[str, str]:
    """An environment in which `ros2` notes its arguments; a goal whose action has `FAIL` in its name is aborted."""
    tool = tmp_path / "bin" / "ros2"
    tool.parent.mkdir()
    tool.write_text(
        '#!/bin/sh\nprintf "%s %s %s %s\\n" "$1" "$2" "$3" "$4" >> "$NOTED"\n'
        'case "$3" in *"$FAIL"*) echo "Goal finished with status: ABORTED";; '
        '*) echo "Goal finished with status: SUCCEEDED";; esac\n'
    )
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
    path = f"{tool.parent}{os.pathsep}{os.environ['PATH']}"
    return {"PATH": path, "NOTED": str(tmp_path / "noted"), "FAIL": "nothing"}


def test_the_script_sends_the_goals_in_order_and_stops_at_the_first_that_fails(
    picked: Path, ros2: dict[str, str]
) -> None:
    script = [str(picked / "out/send_goals.sh")]
    assert subprocess.run(script, env=ros2, check=False, capture_output=True).returncode == 0
    noted = Path(ros2["NOTED"])
    sent = [line.split()[2] for line in noted.read_text().splitlines()]
    arm, hand = "/arm_controller/follow_joint_trajectory", "/hand_controller/gripper_cmd"
    assert sorted(sent[:2]) == [arm, hand]  # both at once
    assert sent[2:] == [arm, hand, arm, arm, arm, hand, arm]
    noted.unlink()
    assert subprocess.run(script, env=ros2 | {"FAIL": "grip"}, check=False, capture_output=True).returncode != 0
    assert len(noted.read_text().splitlines()) <= 2


def test_controllers_that_ros_lacks_get_trajectories_and_are_named(tmp_path: Path, call_cli: RunCli) -> None:
    (tmp_path / "task.yaml").write_text(yaml.safe_dump(WRIST, sort_keys=False))
    (tmp_path / "controllers.yaml").write_text(yaml.safe_dump({"controllers": SPARE}))
    ran = call_cli("export", "task.yaml", "--allow-outside", "--ros2", "out", cwd=tmp_path)
    assert ran.code == 0, ran.err
    assert "arm: ROS has no `computed_torque`: a trajectory controller on the position interface instead" in ran.err
    assert "hand: ROS's gripper controller has one joint; this hand of 6 gets trajectories" in ran.err
    sent = dict(goals(tmp_path / "out"))
    assert [*sent] == ["01.01_move_1_move", "02.01_shut_close", "04.01_goal_follow"]
    assert {*sent["01.01_move_1_move"]["trajectory"]["joint_names"]} == {*ARM}  # ROS wants all joints of a controller
    assert sent["02.01_shut_close"]["trajectory"]["points"][-1]["positions"] == [0.6] * 6
    goal, given = sent["04.01_goal_follow"], WRIST["steps"][3]["follow"]
    assert goal["path_tolerance"] == given["path_tolerance"]
    assert goal["goal_time_tolerance"] == given["goal_time_tolerance"]
    points = goal["trajectory"]["points"]
    assert points[-1]["positions"][0] == 0.3
    assert len(points) < 100  # of 2001 ticks
    assert "accelerations" not in points[0]  # the curve is not smooth: nothing is made up
    script = (tmp_path / "out/send_goals.sh").read_text()
    assert "ros2 control switch_controllers --strict --activate spare --deactivate arm\n" in script
    assert "/spare/follow_joint_trajectory" in script
    assert "sleep 0.500" in script
    assert "update_rate" not in ran.err
    changed = {
        "steps": WRIST["steps"][:2],
        "simulation": {"engine": "kinematic", "step": 0.001, "control_period": 0.003},
    }
    (tmp_path / "task.yaml").write_text(yaml.safe_dump(WRIST | changed, sort_keys=False))
    ran = call_cli("export", "task.yaml", "--allow-outside", "--ros2", "out", "--force", cwd=tmp_path)
    assert "`update_rate` is a whole number: 333 Hz for the control period of 0.003 s, 333.333 Hz" in ran.err
    assert "goals has other files, which the script does not send: 04.01_goal_follow.yaml" in ran.err


def test_a_robot_is_exported_with_its_controllers(tmp_path: Path, call_cli: RunCli) -> None:
    robot, own = ROOT / "robots/panda/robot.yaml", ROOT / "controllers/panda.yaml"
    ran = call_cli("export", robot, "--controllers", own, "--ros2", "out", cwd=tmp_path)
    assert ran.code == 0, ran.err
    assert {*yaml.safe_load((tmp_path / "out/controllers.yaml").read_text())} == {
        "controller_manager", "arm_controller", "hand_controller"
    }  # fmt: skip
    other = ROOT / "controllers/iiwa7.yaml"
    wrong = call_cli("export", robot, "--controllers", other, "--ros2", "other", cwd=tmp_path)
    assert wrong.code == 4
    assert "lbr_iiwa_joint_1" in wrong.err
    assert not (tmp_path / "other").exists()


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path: Path, call_cli: RunCli) -> None:
    robot, out = ROOT / "robots/differential_wrist/robot.yaml", tmp_path / "out"
    out.mkdir()
    (out / "robot.urdf").write_text("mine")
    ran = call_cli("export", robot, "--ros2", "out", cwd=tmp_path)
    assert ran.code == 4
    assert "'out' is not empty; nothing was written" in ran.err
    assert (out / "robot.urdf").read_text() == "mine"
    assert call_cli("export", robot, "--ros2", "out", "--force", cwd=tmp_path).code == 0
    assert sorted(file.name for file in out.iterdir()) == ["README.md", "robot.srdf", "robot.urdf"]
    assert call_cli("export", robot, "--ros2", "out/robot.urdf", cwd=tmp_path).code == 4
    assert call_cli("export", robot, "--ros2", "other", "--seed", "1", cwd=tmp_path).code == 4
    assert not (tmp_path / "other").exists()


def test_no_name_leaves_its_comment_in_the_script() -> None:
    script = ros2_script("Task 't' of robot 'r\ntouch owned\r\nrm x'", (), ())
    assert all(line.startswith("#") for line in script.splitlines() if "owned" in line or "rm x" in line)
