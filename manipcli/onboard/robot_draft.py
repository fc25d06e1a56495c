"""The entries of a robot file for a description: groups, poses, tool, limits, mount; each with its evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.description.elements import Joint
from manipcli.model.configuration import with_mimics, zero_configuration
from manipcli.model.hand.closure import Closure, HandShape
from manipcli.model.hand.measure import measure_hand
from manipcli.model.hand.parts import Hand, RobotParts, guess_parts
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.hand.tool_frame import ToolFrame
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel, Tool
from manipcli.onboard.from_srdf import StatedParts
from manipcli.onboard.home import CLEARANCES, Home, HomeSearch, guess_home
from manipcli.onboard.limits import ProposedLimits, propose_limits
from manipcli.onboard.mount import guess_mount, hung_up
from manipcli.onboard.robot_entries import group_entries, limit_entries, pose_entries
from manipcli.onboard.writer import Entry, Value
from manipcli.scene.scene import Scene

NOTHING_TO_HOLD_WITH: Final = "the fingers have no collision shapes, so that they cannot hold anything"


@dataclass(frozen=True, slots=True, eq=False)
class RobotDraft:
    """What was found out.

    Attributes:
        robot: with its mount, tool and limits, without groups and poses.
        parts: its arm and hand.
        arm_name, hand_name: of their groups.
        entries: of the robot file, behind `robot`, `description` and `args`.
        home: (n) the start.
        search: scores of configurations of the arm; None without an arm.
        hand, frame: what was measured on the hand; None without one.
        notes: for the user.
    """

    robot: RobotModel
    parts: RobotParts
    arm_name: str
    hand_name: str
    entries: Mapping[str, Entry]
    home: Array
    search: HomeSearch | None
    closure: Closure | None
    frame: ToolFrame | None
    notes: tuple[str, ...]


def draft_robot(bare: RobotModel, scene: Scene, stated: StatedParts | None = None) -> RobotDraft:
    """Everything about a robot that its description leaves open.

    Args:
        bare: the robot of a description, with its root at the world's origin.
        scene: the floor.
        stated: what an SRDF states; it replaces guesses.
    """
    kinematics = Kinematics(bare)
    points = ShapePoints(kinematics)
    parts = guess_parts(bare, points, kinematics)
    if stated is not None:
        parts = stated.merged(parts)
    names = (stated.arm_name, stated.hand_name) if stated is not None else ("arm", "hand")
    notes: list[str] = list(stated.notes) if stated is not None else []
    arm = parts.arm.joints if parts.arm else ()
    fingers = parts.hand.joints if parts.hand else ()
    zero = zero_configuration(bare)
    closure, frame, shape = _hand(bare, parts.hand, kinematics, points, zero, notes, stated)
    limits = propose_limits(kinematics, arm, fingers, _lengths(kinematics, points, (*arm, *fingers), zero))
    tool, tool_entry = _tool(parts, frame)
    mount, mount_entry = guess_mount(kinematics, points, parts, shape, closure, zero)
    robot = replace(bare, tool=tool, X_WB=mount, joints=_limited(bare, limits))
    opened = np.array(zero) if closure is None or shape is None else np.array(shape.whole(closure.opened))
    touching = stated.touching if stated is not None else ()
    ignore = (*_within_hand(robot, parts.hand), *touching)
    home, search = Home(opened, ""), None
    ignored: tuple[tuple[str, str], ...] = ()
    if parts.arm is not None:
        search = HomeSearch(robot, scene, arm, q=opened, ignore=ignore, down=parts.hand is not None)
        found = _stated_home(search, arm, stated, notes) or guess_home(search)
        if found is None:
            mount, mount_entry = hung_up(Kinematics(robot), points, opened, search.whole(search.middle))
            robot = replace(robot, X_WB=mount)
            search = HomeSearch(robot, scene, arm, q=opened, ignore=ignore, down=parts.hand is not None)
            found = guess_home(search)
        if found is None:
            home, ignored = _least_touching(search, notes)
        else:
            home, ignored = found, found.touching
    entries: dict[str, Entry] = {}
    if mount_entry is not None:
        entries["mount"] = mount_entry
    entries["groups"] = Entry(group_entries(bare, parts, *names))
    if touching:
        entries["collision_ignore"] = Entry([list(pair) for pair in touching], "`disable_collisions` of the SRDF")
    if ignored:
        entries["collision_ignore"] = Entry(
            [list(pair) for pair in (*touching, *ignored)],
            "they touch in nearly every configuration that was tried",
            True,
        )
    poses = pose_entries(robot, parts, home, closure, *names, stated)
    if poses:
        entries["poses"] = Entry(poses)
    if tool_entry is not None:
        entries["tool"] = tool_entry
    if limits:
        entries["limits"] = Entry(limit_entries(limits))
    return RobotDraft(
        replace(robot, collision_ignore=(*touching, *ignored)),
        parts,
        *names,
        entries,
        home.q,
        search,
        closure,
        frame,
        tuple(notes),
    )


def _hand(
    robot: RobotModel,
    hand: Hand | None,
    kinematics: Kinematics,
    points: ShapePoints,
    zero: Array,
    notes: list[str],
    stated: StatedParts | None,
) -> tuple[Closure | None, ToolFrame | None, HandShape | None]:
    if hand is None:
        return None, None, None
    shape = HandShape(hand, kinematics, points, zero)
    links = [link for branch in hand.branches for link in branch]
    bare = points.missing(links)
    if len(bare) == len(links):
        notes.append("the fingers have no shapes at all: poses and tool of the hand are guessed from its frames alone")
    touching = [link for link in links if robot.link(link).collisions]
    if not touching:
        notes.append(f"{NOTHING_TO_HOLD_WITH}; add their meshes, or <collision> shapes to the description")
    ends = stated.ends(shape) if stated is not None else None
    closure, frame = measure_hand(shape, ends)
    if len(bare) == len(links):
        why = "the fingers have no shapes to measure: which end opens the hand is not known"
        frame = replace(frame, evidence="between the frames of the fingers, which have no shapes to measure")
        return replace(closure, evidence=why, measured=False), frame, shape
    wide, narrow = readable(frame.widest, "m"), readable(frame.narrowest, "m")
    why = f"{closure.evidence}the gap between the fingers is at most {wide}, at least {narrow}"
    return replace(closure, evidence=why), frame, shape


def _within_hand(robot: RobotModel, hand: Hand | None) -> tuple[tuple[str, str], ...]:
    """Pairs of links of the hand: fingers may meet."""
    if hand is None:
        return ()
    links = {hand.palm, *hand.fixed, *(link for branch in hand.branches for link in branch)}
    return tuple(combinations(sorted(links), 2))


def _lengths(kinematics: Kinematics, points: ShapePoints, joints: Sequence[str], q: Array) -> dict[str, float]:
    """[m] from the axis of each joint to the farthest point that it moves, where the robot is stretched most."""
    robot, rng = kinematics.robot, np.random.default_rng(0)
    ends = [joint.limits.within_soft for joint in robot.moving_joints]
    lower, upper = np.clip(np.array(ends, dtype=float).reshape(-1, 2), -np.pi, np.pi).T
    found = dict.fromkeys(joints, 0.0)
    for sample in (q, *rng.uniform(lower, upper, (12, len(lower)))):
        here = np.array(with_mimics(robot, sample))
        for name in joints:
            joint = robot.joint(name)
            X_WJ = kinematics.forward(here, joint.child)
            links = sorted(robot.descendants(joint.child))
            frames = np.array([kinematics.forward(here, link).p for link in links])
            away = np.vstack([frames, points.at(here, links)]) - X_WJ.p
            axis = X_WJ.R @ joint.axis
            found[name] = max(found[name], float(np.linalg.norm(away - np.outer(away @ axis, axis), axis=1).max()))
    return found


def _tool(parts: RobotParts, frame: ToolFrame | None) -> tuple[Tool | None, Entry | None]:
    if frame is not None:
        pose: dict[str, Value] = {"xyz": [float(value) + 0.0 for value in frame.X_PT.p]}
        rpy = [round(float(value), 5) + 0.0 for value in frame.X_PT.rpy]
        if any(rpy):
            pose["rpy"] = [*rpy]
        X = Transform.of(xyz=frame.X_PT.p, rpy=rpy)
        return Tool(frame.link, X), Entry({"link": frame.link, "pose": pose}, frame.evidence)
    if parts.arm is not None:
        why = "the last link of the arm, which has no hand"
        return Tool(parts.arm.tip, Transform.identity()), Entry({"link": parts.arm.tip}, why)
    return None, None


def _limited(robot: RobotModel, limits: Mapping[str, ProposedLimits]) -> tuple[Joint, ...]:
    """The joints with the proposed limits."""
    found = []
    for joint in robot.joints:
        own = limits.get(joint.name)
        if own is not None:
            found.append(replace(joint, limits=replace(joint.limits, **own.spec.model_dump(exclude_unset=True))))
        else:
            found.append(joint)
    return tuple(found)


def _stated_home(search: HomeSearch, arm: tuple[str, ...], stated: StatedParts | None, notes: list[str]) -> Home | None:
    """The state of the SRDF with the best score of those that are free; the one called `home` if it is."""
    states = stated.arm_states(arm) if stated is not None else {}
    search.keep(CLEARANCES[-1])
    free = {name: q for name, q in states.items() if search.free(q) and search.within(q)}
    if "home" in states and "home" not in free:
        notes.append("the state 'home' of the SRDF is in collision or outside the limits; another home was searched")
    best = "home" if "home" in free else max(free, key=lambda name: search.score(free[name]), default=None)
    if best is None or (best != "home" and search.score(free[best]) <= 0.0):
        return None
    return Home(search.whole(free[best]), f"the state '{best}' of the SRDF")


def _least_touching(search: HomeSearch, notes: list[str]) -> tuple[Home, tuple[tuple[str, str], ...]]:
    """The middle of the ranges, and the pairs of links that touch there: nothing better was found."""
    touching = search.lasting([search.middle])
    notes.append(
        "no start free of collision was found; 'home' is the middle of the ranges: move the robot or its obstacles"
        + (f"; links that touch there are under `collision_ignore`: {len(touching)} pairs" if touching else "")
    )
    why = "the middle of the ranges: no configuration without contacts was found"
    return Home(search.whole(search.middle), why), touching
