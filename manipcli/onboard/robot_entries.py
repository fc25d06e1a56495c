"""Entries of a robot file: groups, poses and limits, each with its evidence."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.core.text import listed
from manipcli.model.hand.closure import Closure
from manipcli.model.hand.parts import Arm, RobotParts
from manipcli.model.robot import RobotModel
from manipcli.onboard.from_srdf import StatedParts
from manipcli.onboard.home import Home
from manipcli.onboard.limits import ProposedLimits
from manipcli.onboard.writer import Entry, Value


def group_entries(robot: RobotModel, parts: RobotParts, arm_name: str, hand_name: str) -> dict[str, Entry]:
    """The groups of the arm and of the hand: the arm as a chain, or as joints where the chain has more of them."""
    found: dict[str, Entry] = {}
    if parts.arm is not None:
        why = parts.arm_evidence
        if parts.others:
            why += f"; not commanded, held by brakes: {listed(parts.others)}"
        arm: dict[str, Value] = {"chain": {"base": parts.arm.base, "tip": parts.arm.tip}}
        if not _is_whole_chain(robot, parts.arm):
            arm = {"joints": list(parts.arm.joints), "tip": parts.arm.tip}
        found[arm_name] = Entry(arm, why)
    if parts.hand is not None:
        found[hand_name] = Entry({"joints": list(parts.hand.joints)}, parts.hand_evidence)
    return found


def _is_whole_chain(robot: RobotModel, arm: Arm) -> bool:
    """Whether the arm has all the independent joints between its base and its tip."""
    above = {joint.child: joint for joint in robot.joints}
    names, at = [], arm.tip
    while at != arm.base and at in above:
        if above[at].independent:
            names.append(above[at].name)
        at = above[at].parent
    return at == arm.base and tuple(reversed(names)) == arm.joints


def pose_entries(
    robot: RobotModel,
    parts: RobotParts,
    home: Home,
    closure: Closure | None,
    arm_name: str,
    hand_name: str,
    stated: StatedParts | None,
) -> dict[str, Entry]:
    """The poses: states of an SRDF, home, open, closed."""
    found: dict[str, Entry] = {}
    for name, by_group in (stated.poses if stated is not None else {}).items():
        found[name] = Entry({group: dict(values) for group, values in by_group.items()}, "a state of the SRDF")
    hand: dict[str, Value] = {hand_name: "open"} if closure is not None else {}
    if parts.arm is not None:
        arm: list[float] = [round(float(home.q[k]), 4) for k in robot.indices(parts.arm.joints)]
        found["home"] = Entry({arm_name: arm, **hand}, home.evidence)
    elif hand:
        found["home"] = Entry({**hand})
    if closure is not None:
        rounded = [[round(float(value), 4) for value in values] for values in (closure.opened, closure.closed)]
        found["open"] = Entry({hand_name: [*rounded[0]]}, closure.evidence, not closure.measured)
        found["closed"] = Entry({hand_name: [*rounded[1]]})
    return found


def limit_entries(limits: Mapping[str, ProposedLimits]) -> dict[str, Entry]:
    """The limits; the same evidence is written once."""
    found: dict[str, Entry] = {}
    before = ""
    for name, own in limits.items():
        row: dict[str, Value] = dict(own.spec.model_dump(exclude_unset=True))
        why = own.evidence
        if own.missing:
            why = f"{listed(own.missing)} missing in the description or unusable; {why}"
        found[name] = Entry(row, "" if why == before else why, bool(own.missing))
        before = why
    return found
