"""A robot file and its descriptions become one robot; whatever does not fit is told with its place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Transform
from manipcli.description.lint.examine import examine
from manipcli.description.packages import Packages
from manipcli.model.build_robot import build_robot, rebuild_robot
from manipcli.model.normalised_urdf import engine_urdf, massless_joints
from manipcli.model.robot import RobotModel
from manipcli.spec.load import load_robot_text
from manipcli.spec.robot import RobotSpec

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'


def link(name: str, content: str = INERTIAL) -> str:
    return f'<link name="{name}">{content}</link>\n'


def joint(name: str, kind: str, parent: str, child: str, extra: str = "") -> str:
    limit = '<limit lower="-1" upper="1" velocity="2" effort="10"/><axis xyz="0 0 1"/>' if kind != "fixed" else ""
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{limit}{extra}</joint>\n'


ARM = (
    '<robot name="arm">\n'
    + "".join(link(name) for name in ("base", "upper", "lower", "wrist"))
    + link("flange", "")
    + joint("j1", "revolute", "base", "upper", '<origin xyz="0 0 0.1" rpy="0.1 0.2 0.3"/>')
    + joint("j2", "revolute", "upper", "lower", '<dynamics damping="0.1" friction="0.2"/>')
    + joint("slide", "prismatic", "lower", "wrist")
    + joint("end", "fixed", "wrist", "flange")
    + '<transmission name="t"><type>transmission_interface/SimpleTransmission</type>'
    + '<joint name="j1"/><actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>'
    + "</robot>"
)
HAND = (
    '<robot name="hand">\n'
    + link("palm")
    + link("left")
    + link("right")
    + joint("open", "prismatic", "palm", "left")
    + joint("follow", "prismatic", "palm", "right", '<mimic joint="open" multiplier="-1"/>')
    + "</robot>"
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "hand.urdf").write_text(HAND)
    return tmp_path / "robot.yaml"


def spec(**content: object) -> RobotSpec:
    return RobotSpec.model_validate({"robot": "r", "description": "arm.urdf", **content})


def build(file: Path, **content: object) -> RobotModel:
    return build_robot(spec(**content), file=file)[0]


def messages(file: Path, **content: object) -> str:
    with pytest.raises(InvalidInput) as caught:
        build(file, **content)
    return "\n".join(f"{finding} | {finding.hint}" for finding in caught.value.findings)


HANDED = {"attach": [{"description": "hand.urdf", "parent": "flange", "pose": {"xyz": [0, 0, 0.2]}, "prefix": "h_"}]}


def test_an_attached_description_is_welded_on_with_its_prefix(file: Path) -> None:
    robot = build(file, **HANDED)
    assert robot.joint_names == ("j1", "j2", "slide", "h_open", "h_follow")
    weld = robot.joint("h_palm_attach")
    assert (weld.type, weld.parent, weld.child) == ("fixed", "flange", "h_palm")
    np.testing.assert_array_equal(weld.X_PJ.p, [0.0, 0.0, 0.2])
    mimic = robot.joint("h_follow").mimic
    assert mimic is not None
    assert mimic.joint == "h_open"
    position = {robot.root: 0} | {joint.child: k for k, joint in enumerate(robot.joints, start=1)}
    assert all(position[joint.parent] < position[joint.child] for joint in robot.joints)
    assert [link.name for link in robot.links] == list(position)


def test_two_hands_need_prefixes(file: Path) -> None:
    twice = [{"description": "hand.urdf", "parent": "flange"}, {"description": "hand.urdf", "parent": "wrist"}]
    assert "link 'palm' already exists" in messages(file, attach=twice)
    assert "did you mean 'flange'" in messages(file, attach=[{"description": "hand.urdf", "parent": "flang"}])


def test_an_empty_root_world_is_only_where_a_hand_is_mounted(file: Path) -> None:
    above = joint("mount", "fixed", "world", "palm", '<origin xyz="0.1 0 0" rpy="0 0 1.5"/>')
    mounted = HAND.replace(link("palm"), link("world", "") + link("palm") + above)
    file.with_name("mounted.urdf").write_text(mounted)
    pose = {"xyz": [0, 0, 0.2], "rpy": [0, 0.3, 0]}
    robot = build(file, attach=[{"description": "mounted.urdf", "parent": "flange", "pose": pose}])
    weld = robot.joint("palm_attach")
    assert (weld.parent, weld.child) == ("flange", "palm")
    wanted = Transform.of(xyz=[0, 0, 0.2], rpy=[0, 0.3, 0]) @ Transform.of(xyz=[0.1, 0, 0], rpy=[0, 0, 1.5])
    np.testing.assert_allclose(weld.X_PJ.matrix, wanted.matrix, atol=1e-12)
    assert "world" not in [each.name for each in robot.links]
    file.with_name("heavy.urdf").write_text(mounted.replace(link("world", ""), link("world")))
    robot = build(file, attach=[{"description": "heavy.urdf", "parent": "flange"}])
    assert robot.joint("world_attach").parent == "flange"  # a body of its own


def test_a_chain_is_the_independent_joints_on_the_way(file: Path) -> None:
    groups = {
        "arm": {"chain": {"base": "upper", "tip": "flange"}},
        "hand": {"joints": ["h_open"], "tip": "h_palm"},
        "all": {"chain": {"base": "base", "tip": "h_left"}},
    }
    robot = build(file, **HANDED, groups=groups)
    assert robot.group("arm").joints == ("j2", "slide")
    assert (robot.group("arm").tip, robot.group("hand").tip) == ("flange", "h_palm")
    assert robot.group("all").joints == ("j1", "j2", "slide", "h_open")


@pytest.mark.parametrize(
    ("group", "expected"),
    [
        ({"chain": {"base": "base", "tip": "flang"}}, "did you mean 'flange'"),
        ({"chain": {"base": "wrist", "tip": "upper"}}, "tip link 'upper' is not below base link 'wrist'"),
        ({"chain": {"base": "wrist", "tip": "flange"}}, "no moving joint between 'wrist' and 'flange'"),
        ({"joints": ["j1", "j9"]}, "joint 'j9' is not in the robot"),
        ({"joints": ["j1", "end"]}, "joint 'end' is fixed"),
        ({"joints": ["j1", "j1"]}, "duplicate joint 'j1'"),
        ({"joints": ["h_follow"]}, "mimics 'h_open'"),
        ({"joints": ["j1"], "tip": "nowhere"}, "tip link 'nowhere' is not"),
    ],
)
def test_a_group_that_cannot_be_is_told(file: Path, group: dict[str, object], expected: str) -> None:
    assert expected in messages(file, **HANDED, groups={"g": group})


GROUPS = {"arm": {"joints": ["j1", "j2"]}, "rail": {"joints": ["slide"]}}


def test_named_poses_are_lists_names_of_joints_or_other_poses(file: Path) -> None:
    poses = {
        "home": {"arm": "up", "rail": [0.5]},
        "up": {"arm": {"j2": 0.3, "j1": -0.2}},
        "start": {"arm": "home"},
    }
    robot = build(file, groups=GROUPS, poses=poses)
    home = robot.pose("home")
    assert dict(zip(home.joints, home.positions, strict=True)) == {"j1": -0.2, "j2": 0.3, "slide": 0.5}
    start = robot.pose("start")
    assert dict(zip(start.joints, start.positions, strict=True)) == {"j1": -0.2, "j2": 0.3}


def test_no_pose_is_made_up(file: Path) -> None:
    assert build(file).poses == ()


@pytest.mark.parametrize(
    ("poses", "expected"),
    [
        ({"p": {"arm": [0.0]}}, "1 values for the 2 joints"),
        ({"p": {"arm": [0.0, 1.5]}}, "joint 'j2' at 1.5 is outside its limits -1 to 1"),
        ({"p": {"arm": {"j3": 0.0}}}, "joint 'j3' is not in group 'arm'"),
        ({"p": {"leg": [0.0]}}, "unknown group 'leg'"),
        ({"p": {"arm": "hom"}, "home": {"arm": [0, 0]}}, "did you mean 'home'"),
        ({"p": {"arm": "q"}, "q": {"arm": "p"}}, "refers to itself"),
        ({"p": {"arm": "p"}}, "refers to itself"),
        ({"p": {"rail": "q"}, "q": {"arm": [0, 0]}}, "unknown pose 'q' of group 'rail'"),
    ],
)
def test_a_pose_that_cannot_be_is_told(file: Path, poses: dict[str, object], expected: str) -> None:
    assert expected in messages(file, groups=GROUPS, poses=poses)


def test_a_group_that_a_pose_lacks_is_told_how_to_write(file: Path) -> None:
    def told(poses: dict[str, object], **groups: object) -> str | None:
        with pytest.raises(InvalidInput) as refused:
            build(file, poses=poses, **groups)
        return next(one.hint for one in refused.value.findings if one.code == "ROBOT320")

    assert told({"p": {"leg": [0.0]}}) == "define it: groups: {leg: {joints: [...]}}"
    joint = "'j1' is a joint; write its position below a group: {arm: {j1: ...}}"
    assert told({"p": {"j1": [0.0]}}, groups=GROUPS) == joint
    assert told({"p": {"j1": [0.0]}}) == joint.replace("arm", "GROUP")
    assert told({"p": {"amr": [0.0]}}, groups=GROUPS) == "did you mean 'arm'?"


def test_a_pose_of_few_digits_beyond_a_limit_is_at_it(file: Path) -> None:
    """As 90 deg under a limit of 1.570796: plans keep the limit to the last digit."""
    poses = {"p": {"arm": [1.0000003, 0.5]}, "q": {"arm": "p"}}
    robot = build(file, groups=GROUPS, poses=poses)
    assert [robot.pose(name).positions for name in "pq"] == [(1.0, 0.5), (1.0, 0.5)]


def test_a_pose_beyond_a_soft_limit_is_a_warning_where_the_limit_acts(file: Path) -> None:
    soft = {"soft_lower": 0.3, "soft_upper": 0.7, "k_position": 20.0}
    poses = {"low": {"arm": [0.1, 0.2999997]}, "high": {"arm": {"j2": 0.8}}, "good": {"arm": [0.0, 0.3]}}

    def warned(limits: dict[str, float]) -> list[tuple[str, str]]:
        findings = build_robot(spec(groups=GROUPS, poses=poses, limits={"j2": limits}), file=file)[1]
        return [(found.code, found.message) for found in findings if found.severity == "warning"]

    assert warned(soft) == [
        ("ROBOT324", "pose 'low': joint 'j2' at 0.2999997 is beyond its soft lower limit 0.3"),
        ("ROBOT324", "pose 'high': joint 'j2' at 0.8 is beyond its soft upper limit 0.7"),
    ]
    assert warned({"k_velocity": 5.0}) == []


@pytest.mark.parametrize(
    ("joint", "value", "hint"),
    [
        ("j2", 45.0, "in degrees? write '45 deg'"),
        ("j2", -90.0, None),  # beyond the limits as degrees, too
        ("j2", 1.5, None),
        ("slide", 40.0, "in millimetres? write '40 mm'"),
        ("slide", 1.5, None),
    ],
)
def test_a_pose_in_degrees_or_millimetres_is_guessed(file: Path, joint: str, value: float, hint: str | None) -> None:
    with pytest.raises(InvalidInput) as refused:
        build(file, groups={"all": {"joints": ["j1", "j2", "slide"]}}, poses={"p": {"all": {joint: value}}})
    assert [f.hint for f in refused.value.findings if f.severity == "error"] == [hint]


def test_limits_narrow_and_complete_the_description(file: Path) -> None:
    limits = {"j1": {"lower": -0.5, "velocity": 5.0, "acceleration": 3.0, "jerk": 40.0}}
    robot, findings = build_robot(spec(limits=limits, default_acceleration=7.0), file=file)
    j1, j2 = robot.joint("j1").limits, robot.joint("j2").limits
    assert (j1.lower, j1.upper, j1.velocity, j1.effort, j1.acceleration, j1.jerk) == (-0.5, 1.0, 5.0, 10.0, 3.0, 40.0)
    assert (j2.acceleration, j2.jerk) == (7.0, None)
    (note,) = findings
    assert note.severity == "note"
    assert "j2, slide" in note.message
    assert "7 rad/s2" in note.message


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"j1": {"lower": -2.0}}, "lower -2 is outside the description's -1 to 1"),
        ({"j1": {"upper": 1.1}}, "upper 1.1 is outside"),
        ({"j1": {"upper": 45.0}}, "in degrees? write '45 deg'"),
        ({"j1": {"upper": -2.0}}, "upper -2 is outside"),
        ({"j11": {"upper": 0.1}}, "did you mean 'j1'"),
        ({"end": {"velocity": 0.1}}, "not a moving joint"),
    ],
)
def test_limits_that_widen_or_name_nothing_are_told(file: Path, limits: dict[str, object], expected: str) -> None:
    assert expected in messages(file, limits=limits)


def test_tool_and_mount_are_frames(file: Path) -> None:
    robot = build(file, tool={"link": "flange", "pose": {"xyz": [0, 0, 0.1]}}, mount={"xyz": [1, 0, 0]})
    assert robot.tool is not None
    np.testing.assert_array_equal(robot.tool.X_LT.p, [0.0, 0.0, 0.1])
    np.testing.assert_array_equal(robot.X_WB.p, [1.0, 0.0, 0.0])
    assert "link 'flanges' is not in the robot" in messages(file, tool={"link": "flanges"})


def test_the_tool_is_the_tip_of_the_first_group_unless_said(file: Path) -> None:
    tool = build(file, groups={"chain": {"chain": {"base": "base", "tip": "flange"}}, **GROUPS}).tool
    assert tool is not None
    assert tool.link == "flange"
    np.testing.assert_array_equal(tool.X_LT.matrix, np.eye(4))
    assert build(file, groups=GROUPS).tool is None


def test_findings_carry_the_place_of_the_value(file: Path) -> None:
    written = load_robot_text(
        "robot: r\ndescription: arm.urdf\ngroups: {arm: {joints: [j1, j2]}}\n"
        "poses:\n  p:\n    arm:\n      - 0.0\n      - 1.5\ntool:\n  link: x\n",
        "robot.yaml",
    )
    with pytest.raises(InvalidInput) as caught:
        build_robot(written.spec, file=file, source=written.source)
    assert [str(finding.place) for finding in caught.value.findings if finding.severity == "error"] == [
        "robot.yaml:8:9",
        "robot.yaml:10:9",
    ]


def test_errors_of_all_descriptions_are_told_at_once(file: Path) -> None:
    (file.parent / "arm.urdf").write_text(ARM.replace('mass value="1"', 'mass value="-1"'))
    (file.parent / "hand.urdf").write_text(HAND.replace('type="prismatic"', 'type="prism"'))
    told = messages(file, **HANDED)
    assert "arm.urdf:2:" in told
    assert "hand.urdf:5:" in told


def test_warnings_about_a_description_are_told_and_notes_are_left_to_who_checks_it(file: Path) -> None:
    """A flange of mass 0 is fine; an axis of length 2 may be meant otherwise."""
    frame = link("flange", INERTIAL.replace('mass value="1"', 'mass value="0"'))
    doubtful = ARM.replace(link("flange", ""), frame).replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 2"/>', 1)
    (file.parent / "arm.urdf").write_text(doubtful)
    codes = {
        one.code for one in examine(file.parent / "arm.urdf", packages=Packages(file.parent / "arm.urdf")).findings
    }
    assert {"URDF031", "URDF034"} <= codes
    _, findings = build_robot(spec(default_acceleration=7), file=file)
    assert {one.code for one in findings} == {"URDF034", "ROBOT330"}


def assert_same(one: RobotModel, other: RobotModel) -> None:
    assert [link.name for link in one.links] == [link.name for link in other.links]
    for a, b in zip(one.links, other.links, strict=True):
        assert (a.inertial is None) == (b.inertial is None)
        if a.inertial is not None and b.inertial is not None:
            assert a.inertial.mass == b.inertial.mass
            np.testing.assert_array_equal(a.inertial.inertia, b.inertial.inertia)
            np.testing.assert_allclose(a.inertial.X_LI.matrix, b.inertial.X_LI.matrix, atol=1e-15)
        for mine, its in ((a.visuals, b.visuals), (a.collisions, b.collisions)):
            assert [(g.shape, g.rgba) for g in mine] == [(g.shape, g.rgba) for g in its]
            for g, h in zip(mine, its, strict=True):
                np.testing.assert_allclose(g.X_LS.matrix, h.X_LS.matrix, atol=1e-15)
    for j, k in zip(one.joints, other.joints, strict=True):
        assert (j.name, j.type, j.parent, j.child, j.mimic) == (k.name, k.type, k.parent, k.child, k.mimic)
        assert (j.limits, j.damping, j.friction) == (k.limits, k.damping, k.friction)
        np.testing.assert_allclose(j.axis, k.axis, atol=1e-15)
        # Angles go through arcus functions and back: a few bits.
        np.testing.assert_allclose(j.X_PJ.matrix, k.X_PJ.matrix, atol=1e-15)
    assert one.transmissions == other.transmissions


ROBOTS = sorted((Path(__file__).parents[2] / "robots").glob("*/robot.yaml"), key=str)
DESCRIPTIONS = {
    "arm7_hand3": "urdf/arm7_hand3.urdf.xacro",
    "panda": "package://pybullet_data/franka_panda/panda.urdf",
    "iiwa7": "package://pybullet_data/kuka_iiwa/model.urdf",
    "differential_wrist": "differential_wrist.urdf",
    "four_bar_finger": "four_bar_finger.urdf",
}


@pytest.mark.slow
@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.parent.name)
def test_what_we_write_reads_as_the_same_robot(path: Path, tmp_path: Path) -> None:
    content = RobotSpec(robot=path.parent.name, description=DESCRIPTIONS[path.parent.name])
    robot, _ = build_robot(content, file=path)
    for text in (robot.urdf, engine_urdf(robot, tmp_path)):
        assert max(len(line.encode()) for line in text.splitlines()) < 4096
    assert str(Path.cwd()) not in robot.urdf
    assert "file://" not in robot.urdf
    (tmp_path / "again.urdf").write_text(robot.urdf)
    again, _ = build_robot(
        RobotSpec(robot=robot.name, description="again.urdf"),
        file=tmp_path / "robot.yaml",
        package_path=[path.parent.parent],
    )
    assert_same(robot, again)


def test_a_hand_of_its_own_file_reads_again_too(file: Path, tmp_path: Path) -> None:
    robot = build(file, **HANDED)
    (tmp_path / "again.urdf").write_text(robot.urdf)
    assert_same(robot, build(file, description="again.urdf"))


def test_the_robot_of_a_log_names_its_meshes_as_the_log_does() -> None:
    path = Path(__file__).parents[2] / "robots" / "arm7_hand3" / "robot.yaml"
    content = RobotSpec(robot="arm7_hand3", description=DESCRIPTIONS["arm7_hand3"])
    robot, _ = build_robot(content, file=path)
    assert rebuild_robot(content, robot.urdf.encode()).urdf == robot.urdf
    assert robot.urdf.count('filename="package://arm7_hand3/') > 10


def test_a_joint_that_moves_no_mass_is_no_matter_for_physics(file: Path) -> None:
    (file.parent / "arm.urdf").write_text(ARM.replace(link("wrist"), link("wrist", "")))
    robot = build(file)
    assert massless_joints(robot) == ("slide",)
    with pytest.raises(InvalidInput, match=r"arm.urdf:.*link 'wrist' has no mass .* is moved by joint 'slide'"):
        engine_urdf(robot, file.parent)
    assert massless_joints(build(file, **HANDED)) == ()  # the hand is fixed to it
