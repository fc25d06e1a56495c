"""Checks whose findings come from reading links, joints and transmissions: tree structure, physics, gears."""

from functools import partial

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import CUBE, INERTIAL, LIMIT, another, bare_joint, one_joint, robot

topology_check = partial(reading_check, "topology")
physics_check = partial(reading_check, "physics")
readiness_check = partial(reading_check, "readiness")

READING_TREE: tuple[Check, ...] = (
    topology_check(
        "URDF005",
        "duplicate-name",
        "Two links or two joints have the same name",
        "Programs differ in which of the two they use; PyBullet crashes on a duplicate joint.",
        robot('<link name="base"/><link name="base"/>'),
    ),
    topology_check(
        "URDF006",
        "undefined-link",
        "A joint names a link that is not in the description",
        "The usual cause is a name changed in only one place, or a missing prefix in a macro.",
        robot(
            '<link name="base"/><link name="tip"/><joint name="j" type="fixed"><parent link="bsae"/>'
            '<child link="tip"/></joint>'
        ),
    ),
    topology_check(
        "URDF007",
        "several-roots",
        "The description has more than one root link",
        "A description is one tree. PyBullet crashes on two; other programs keep the first and drop the rest.",
        robot('<link name="base"/><link name="lost"/>'),
    ),
    topology_check(
        "URDF014",
        "mimic-target",
        "A mimic joint follows an unknown or fixed joint, or has a multiplier of 0",
        "The joint would be free instead of coupled: one finger of a gripper would swing loosely.",
        bare_joint('<mimic joint="k"/>', kind="continuous"),
    ),
    topology_check(
        "URDF080",
        "no-link",
        "The description has no link",
        "There is nothing to load. The usual cause is a xacro file that defines macros but calls none.",
        robot(),
    ),
    topology_check(
        "URDF081",
        "loop",
        "Links form a loop",
        "A URDF is a tree; closed chains need another format or a mimic joint. If all links form loops, programs find "
        "no root link; PyBullet crashes on a loop beside a root.",
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
        "The pose of the link is undefined; PyBullet crashes on it.",
        robot('<link name="base"/><joint name="j" type="fixed"><parent link="base"/><child link="base"/></joint>'),
    ),
    topology_check(
        "URDF084",
        "mimic-circle",
        "Joints mimic each other in a circle, or a joint mimics itself",
        "In general no position satisfies such a coupling.",
        bare_joint('<mimic joint="j"/>', kind="continuous"),
    ),
    topology_check(
        "URDF085",
        "mimic-chain",
        "A joint mimics a joint that mimics another",
        "manipcli follows the chain to its end; Gazebo and ros2_control follow one step, or refuse it.",
        one_joint(
            more=another('<mimic joint="j"/>')
            + another('<mimic joint="k"/>', origin='<origin xyz="0 0 2"/>')
            .replace('"other"', '"third"')
            .replace('name="k"', 'name="l"')
        ),
        severity="note",
    ),
    physics_check(
        "URDF086",
        "soft-limits",
        "The soft limits of a joint have no effect, because k_position is missing or 0",
        "k_position is the velocity per distance to the soft limit; with 0 the joint does not slow down before it.",
        one_joint(f'{LIMIT}<safety_controller soft_lower_limit="-0.5" soft_upper_limit="0.5" k_velocity="1"/>'),
        severity="warning",
    ),
    physics_check(
        "URDF009",
        "axis",
        "The axis of a joint is zero or too long",
        "An axis of 0 0 0 silently makes all states in PyBullet NaN from the first step.",
        one_joint('<axis xyz="0 0 0"/>' + LIMIT),
    ),
    physics_check(
        "URDF010",
        "limits",
        "Required limits of a joint are missing, or limits are invalid",
        "Planning needs limits with lower below upper and no negative velocity or effort; PyBullet silently accepts "
        "any.",
        one_joint('<limit lower="1" upper="-1" velocity="1" effort="1"/>'),
    ),
    physics_check(
        "URDF011",
        "inertia",
        "A mass or inertia is physically impossible",
        "An engine divides by it: PyBullet sets such an inertia to zero and the joint never moves.",
        one_joint(tip=INERTIAL.replace('ixx="', 'ixx="-') + CUBE),
    ),
    physics_check(
        "URDF031",
        "zero-mass",
        "A link has an inertial with mass 0",
        "It is ignored, which is fine for a frame such as tool0; URDF100 reports a joint that moves no mass at all.",
        one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
        severity="note",
    ),
    physics_check(
        "URDF034",
        "axis-length",
        "The axis of a joint does not have unit length",
        "manipcli normalises it; programs that do not normalise scale positions and velocities with its length.",
        one_joint('<axis xyz="0 0 2"/>' + LIMIT),
        severity="warning",
    ),
    physics_check(
        "URDF035",
        "locked-joint",
        "A moving joint has equal lower and upper limits",
        "The joint cannot move. If this is intended, make its type fixed.",
        one_joint('<limit lower="0" upper="0" velocity="1" effort="1"/>'),
        severity="warning",
    ),
    physics_check(
        "URDF036",
        "unstated-limit",
        "A velocity or effort limit is 0 or missing, or one end of a range is missing",
        "Many descriptions contain zeros there, which are read as missing. Time-optimal trajectories need the limit, "
        "and the robot file can add it. A missing lower or upper limit is 0, as in other programs.",
        one_joint('<limit lower="-1" upper="1" velocity="0" effort="1"/>'),
        severity="warning",
    ),
    physics_check(
        "URDF037",
        "point-mass",
        "A link with a mass has no moments of inertia",
        "A point mass is fine if it is fixed to a larger body, and an error (URDF011) if a joint moves it.",
        one_joint(tip=INERTIAL.replace("0.02", "0"), kind="fixed", inside=""),
        severity="warning",
    ),
    physics_check(
        "URDF038",
        "singular-inertia",
        "An inertia is singular by rounding",
        "The least moment of a thin rod rounds to 0. Engines divide by it, so a millionth of the largest is used.",
        one_joint(tip=INERTIAL.replace('izz="0.02"', 'izz="0"') + CUBE),
        severity="note",
    ),
    readiness_check(
        "URDF015",
        "transmission",
        "A transmission has no type or joint, names an unknown joint, or has a reduction of 0",
        "ros_control rejects it at start-up, or silently loads it with a reduction of 1.",
        one_joint(more='<transmission name="t"><joint name="j"/></transmission>'),
    ),
)
