"""What is found while links, joints and transmissions are read: the tree they make, and what no body or gear has."""

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import CUBE, INERTIAL, LIMIT, one_joint

READING_TREE: tuple[Check, ...] = (
    reading_check(
        "URDF005",
        name="duplicate-name",
        tier="topology",
        summary="Two links or two joints have the same name",
        reason="Which of the two is meant depends on the program; PyBullet crashes on a joint that is there twice.",
        bad='<robot name="r"><link name="base"/><link name="base"/></robot>',
    ),
    reading_check(
        "URDF006",
        name="undefined-link",
        tier="topology",
        summary="A joint names a link that is not in the description",
        reason="Mostly a name that was changed in one place, or a prefix that one macro lacks.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="fixed"><parent link="bsae"/><child link="tip"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF007",
        name="several-roots",
        tier="topology",
        summary="The description has more than one root link",
        reason="A description is one tree. PyBullet crashes on two; other programs keep the first and lose the rest.",
        bad='<robot name="r"><link name="base"/><link name="lost"/></robot>',
    ),
    reading_check(
        "URDF014",
        name="mimic-target",
        tier="topology",
        summary="A mimic joint follows a joint that is not there or does not move, or multiplies it by 0",
        reason="The joint would be free where the robot has a coupling: half of a gripper hangs loose.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="continuous"><parent link="base"/><child link="tip"/><mimic joint="k"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF080",
        name="no-link",
        tier="topology",
        summary="The description has no link",
        reason="There is nothing to load; mostly a xacro file that only defines macros and calls none.",
        bad='<robot name="r"></robot>',
    ),
    reading_check(
        "URDF081",
        name="loop",
        tier="topology",
        summary="Links form a loop",
        reason=(
            "A URDF is a tree; closed chains need another format or a mimic joint. Without a root a program finds no "
            "link at all; beside a root, PyBullet crashes."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="a"/><link name="b"/>'
            '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
            '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF082",
        name="two-parents",
        tier="topology",
        summary="A link is the child of two joints",
        reason="A URDF is a tree: the second joint closes a chain. PyBullet crashes on it.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/></joint>'
            '<joint name="k" type="fixed"><parent link="base"/><child link="tip"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF083",
        name="self-joint",
        tier="topology",
        summary="A joint joins a link to itself",
        reason="It says nothing about where the link is; PyBullet crashes on it.",
        bad=(
            '<robot name="r">'
            '<link name="base"/>'
            '<joint name="j" type="fixed"><parent link="base"/><child link="base"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF084",
        name="mimic-circle",
        tier="topology",
        summary="Joints mimic each other in a circle, or one mimics itself",
        reason="No position satisfies such a coupling but by chance.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="continuous"><parent link="base"/><child link="tip"/><mimic joint="j"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF009",
        name="axis",
        tier="physics",
        summary="The axis of a joint is zero, or too long to be a direction",
        reason=(
            "A joint about the axis 0 0 0 turns all states of PyBullet into NaN from the first step on, without a word."
        ),
        bad=one_joint('<axis xyz="0 0 0"/>' + LIMIT),
    ),
    reading_check(
        "URDF010",
        name="limits",
        tier="physics",
        summary="A joint has no limits where it needs them, or limits that cannot be",
        reason=(
            "Without limits, with lower above upper or with negative ones no planner can promise anything; PyBullet "
            "takes them without a word."
        ),
        bad=one_joint('<limit lower="1" upper="-1" velocity="1" effort="1"/>'),
    ),
    reading_check(
        "URDF011",
        name="inertia",
        tier="physics",
        summary="A mass or inertia is one that no body has",
        reason="An engine divides by it: PyBullet sets such an inertia to zero and the joint stands still for ever.",
        bad=one_joint(tip=INERTIAL.replace('ixx="', 'ixx="-') + CUBE),
    ),
    reading_check(
        "URDF031",
        name="zero-mass",
        tier="physics",
        severity="note",
        summary="A link has an inertial of mass 0",
        reason=(
            "It counts as having none: fine for a frame such as tool0; a joint that moves nothing else is told as "
            "URDF100."
        ),
        bad=one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
    ),
    reading_check(
        "URDF034",
        name="axis-length",
        tier="physics",
        severity="warning",
        summary="The axis of a joint is not of unit length",
        reason=(
            "Only its direction is used here; programs that take it as it is scale velocities and positions with it."
        ),
        bad=one_joint('<axis xyz="0 0 2"/>' + LIMIT),
    ),
    reading_check(
        "URDF035",
        name="locked-joint",
        tier="physics",
        severity="warning",
        summary="A joint moves by its type and has equal limits",
        reason="Nothing can be planned for it; where it is meant to stand still, its type is fixed.",
        bad=one_joint('<limit lower="0" upper="0" velocity="1" effort="1"/>'),
    ),
    reading_check(
        "URDF036",
        name="unstated-limit",
        tier="physics",
        severity="warning",
        summary="A limit of velocity or effort is 0 or missing, or one end of a range is missing",
        reason=(
            "Many descriptions carry zeros there. It counts as not stated; a plan in minimal time needs it, and the "
            "robot file can state it. A lower or upper end that is missing counts as 0, as everywhere."
        ),
        bad=one_joint('<limit lower="-1" upper="1" velocity="0" effort="1"/>'),
    ),
    reading_check(
        "URDF037",
        name="point-mass",
        tier="physics",
        severity="warning",
        summary="A link with a mass has no moments of inertia",
        reason=(
            "A point mass: fine where it is fixed to a larger body, impossible (an error, URDF011) where a joint turns "
            "it."
        ),
        bad=one_joint(tip=INERTIAL.replace("0.02", "0"), kind="fixed", inside=""),
    ),
    reading_check(
        "URDF015",
        name="transmission",
        tier="readiness",
        summary="A transmission lacks its type or joint, names an unknown joint, or has a reduction of 0",
        reason="ros_control refuses it at start-up, or worse: loads it with a reduction of 1.",
        bad=one_joint(more='<transmission name="t"><joint name="j"/></transmission>'),
    ),
)
