"""What is found while links, joints and transmissions are read: the tree they make, and what no body or gear has."""

from functools import partial

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import CUBE, INERTIAL, LIMIT, bare_joint, one_joint, robot

topology_check = partial(reading_check, "topology")
physics_check = partial(reading_check, "physics")
readiness_check = partial(reading_check, "readiness")

READING_TREE: tuple[Check, ...] = (
    topology_check(
        "URDF005",
        "duplicate-name",
        "Two links or two joints have the same name",
        "Which of the two is meant depends on the program; PyBullet crashes on a joint that is there twice.",
        robot('<link name="base"/><link name="base"/>'),
    ),
    topology_check(
        "URDF006",
        "undefined-link",
        "A joint names a link that is not in the description",
        "Mostly a name that was changed in one place, or a prefix that one macro lacks.",
        robot(
            '<link name="base"/><link name="tip"/><joint name="j" type="fixed"><parent link="bsae"/>'
            '<child link="tip"/></joint>'
        ),
    ),
    topology_check(
        "URDF007",
        "several-roots",
        "The description has more than one root link",
        "A description is one tree. PyBullet crashes on two; other programs keep the first and lose the rest.",
        robot('<link name="base"/><link name="lost"/>'),
    ),
    topology_check(
        "URDF014",
        "mimic-target",
        "A mimic joint follows a joint that is not there or does not move, or multiplies it by 0",
        "The joint would be free where the robot has a coupling: half of a gripper hangs loose.",
        bare_joint('<mimic joint="k"/>', kind="continuous"),
    ),
    topology_check(
        "URDF080",
        "no-link",
        "The description has no link",
        "There is nothing to load; mostly a xacro file that only defines macros and calls none.",
        robot(),
    ),
    topology_check(
        "URDF081",
        "loop",
        "Links form a loop",
        "A URDF is a tree; closed chains need another format or a mimic joint. Without a root a program finds no "
        "link at all; beside a root, PyBullet crashes.",
        robot(
            '<link name="base"/><link name="a"/><link name="b"/><joint name="j" type="fixed"><parent link="a"/>'
            '<child link="b"/></joint><joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'
        ),
    ),
    topology_check(
        "URDF082",
        "two-parents",
        "A link is the child of two joints",
        "A URDF is a tree: the second joint closes a chain. PyBullet crashes on it.",
        robot(
            '<link name="base"/><link name="tip"/><joint name="j" type="fixed"><parent link="base"/>'
            '<child link="tip"/></joint><joint name="k" type="fixed"><parent link="base"/><child link="tip"/></joint>'
        ),
    ),
    topology_check(
        "URDF083",
        "self-joint",
        "A joint joins a link to itself",
        "It says nothing about where the link is; PyBullet crashes on it.",
        robot('<link name="base"/><joint name="j" type="fixed"><parent link="base"/><child link="base"/></joint>'),
    ),
    topology_check(
        "URDF084",
        "mimic-circle",
        "Joints mimic each other in a circle, or one mimics itself",
        "No position satisfies such a coupling but by chance.",
        bare_joint('<mimic joint="j"/>', kind="continuous"),
    ),
    physics_check(
        "URDF009",
        "axis",
        "The axis of a joint is zero, or too long to be a direction",
        "A joint about the axis 0 0 0 turns all states of PyBullet into NaN from the first step on, without a word.",
        one_joint('<axis xyz="0 0 0"/>' + LIMIT),
    ),
    physics_check(
        "URDF010",
        "limits",
        "A joint has no limits where it needs them, or limits that cannot be",
        "Without limits, with lower above upper or with negative ones no planner can promise anything; PyBullet "
        "takes them without a word.",
        one_joint('<limit lower="1" upper="-1" velocity="1" effort="1"/>'),
    ),
    physics_check(
        "URDF011",
        "inertia",
        "A mass or inertia is one that no body has",
        "An engine divides by it: PyBullet sets such an inertia to zero and the joint stands still for ever.",
        one_joint(tip=INERTIAL.replace('ixx="', 'ixx="-') + CUBE),
    ),
    physics_check(
        "URDF031",
        "zero-mass",
        "A link has an inertial of mass 0",
        "It counts as having none: fine for a frame such as tool0; a joint that moves nothing else is told as URDF100.",
        one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
        severity="note",
    ),
    physics_check(
        "URDF034",
        "axis-length",
        "The axis of a joint is not of unit length",
        "Only its direction is used here; programs that take it as it is scale velocities and positions with it.",
        one_joint('<axis xyz="0 0 2"/>' + LIMIT),
        severity="warning",
    ),
    physics_check(
        "URDF035",
        "locked-joint",
        "A joint moves by its type and has equal limits",
        "Nothing can be planned for it; where it is meant to stand still, its type is fixed.",
        one_joint('<limit lower="0" upper="0" velocity="1" effort="1"/>'),
        severity="warning",
    ),
    physics_check(
        "URDF036",
        "unstated-limit",
        "A limit of velocity or effort is 0 or missing, or one end of a range is missing",
        "Many descriptions carry zeros there. It counts as not stated; a plan in minimal time needs it, and the "
        "robot file can state it. A lower or upper end that is missing counts as 0, as everywhere.",
        one_joint('<limit lower="-1" upper="1" velocity="0" effort="1"/>'),
        severity="warning",
    ),
    physics_check(
        "URDF037",
        "point-mass",
        "A link with a mass has no moments of inertia",
        "A point mass: fine where it is fixed to a larger body, impossible (an error, URDF011) where a joint turns it.",
        one_joint(tip=INERTIAL.replace("0.02", "0"), kind="fixed", inside=""),
        severity="warning",
    ),
    readiness_check(
        "URDF015",
        "transmission",
        "A transmission lacks its type or joint, names an unknown joint, or has a reduction of 0",
        "ros_control refuses it at start-up, or worse: loads it with a reduction of 1.",
        one_joint(more='<transmission name="t"><joint name="j"/></transmission>'),
    ),
)
