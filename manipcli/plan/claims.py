"""Which controller commands which joints, and what of a step no controller could carry out.

A trajectory goes to one active controller, and so does a goal of the hand: neither can be split. This is known from the
files alone, step by step, so it is told before anything is planned.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from manipcli.conditions.condition import Problem
from manipcli.core.errors import Loc, Place
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import Interface, Role
from manipcli.spec.controllers_file import ControllersSpec

_GRIPPER = "add a controller of type `gripper` for the hand's joints to the controllers file"
_THIS_TYPE = "`type: gripper`"


@dataclass(frozen=True, slots=True)
class Claim:
    """One controller: what steps may ask of it, what it commands of its joints while active, and whether it is; its
    type and where it stands in the controllers file."""

    name: str
    role: Role
    joints: tuple[str, ...]
    interfaces: tuple[Interface, ...]
    active: bool
    type: str = ""
    place: Place | None = None

    @property
    def described(self) -> str:
        """`'arm' (controllers.yaml:3:3)`."""
        return f"'{self.name}'" if self.place is None else f"'{self.name}' ({self.place})"


@dataclass(frozen=True, slots=True)
class Claims:
    """All controllers of a robot, at some moment of a task; `following`: the types that follow trajectories."""

    controllers: tuple[Claim, ...]
    following: tuple[str, ...] = ()

    @classmethod
    def of(cls, spec: ControllersSpec, place: Callable[..., Place | None] = lambda *_: None) -> Claims:
        """Those of a controllers file, at the start; `place` of a location in it."""
        return cls(
            tuple(
                Claim(
                    name, one.role, one.joints, one.interfaces, one.active, one.type, place("controllers", name, "type")
                )
                for name, one in spec.controllers.items()
            ),
            following=tuple(name for name, one in type(spec).types.items() if one.role == "follower"),
        )

    def switched(self, activated: Sequence[str], deactivated: Sequence[str]) -> Claims:
        """The same after a switch; a name of both is active."""
        controllers = tuple(
            replace(one, active=one.name in activated or (one.active and one.name not in deactivated))
            for one in self.controllers
        )
        return replace(self, controllers=controllers)

    @property
    def followers(self) -> tuple[Claim, ...]:
        """Those that follow trajectories now."""
        return tuple(one for one in self.controllers if one.active and one.role == "follower")

    @property
    def grippers(self) -> tuple[Claim, ...]:
        """Those that open and close a hand now."""
        return tuple(one for one in self.controllers if one.active and one.role == "hand")

    @property
    def hand(self) -> tuple[str, ...]:
        """The joints that are a hand's: those of all gripper controllers, active or not."""
        return tuple(dict.fromkeys(name for one in self.controllers if one.role == "hand" for name in one.joints))


def unknown_controller(claims: Claims, name: str, loc: Loc) -> tuple[Problem, ...]:
    """Empty if there is a controller of this name."""
    known = [one.name for one in claims.controllers]
    if name in known:
        return ()
    message = f"there is no controller '{name}' in the controllers file"
    return (Problem(loc, message, did_you_mean(name, known, kind="controllers")),)


def arm_joints(robot: RobotModel, hand: Sequence[str]) -> tuple[str, ...]:
    """The independent joints from the root to the tool that are not the hand's; none for a robot without a tool."""
    by_child = {joint.child: joint for joint in robot.joints}
    link = "" if robot.tool is None else robot.tool.link
    found = []
    while link in by_child:
        joint = by_child[link]
        if joint.independent and joint.name not in hand:
            found.append(joint.name)
        link = joint.parent
    return tuple(reversed(found))


def unfollowed(claims: Claims, joints: Sequence[str], loc: Loc) -> tuple[Problem, ...]:
    """Empty if one controller follows trajectories of all these joints."""
    followed = {name for claim in claims.followers for name in claim.joints}
    gripped = [
        name for name in joints if name not in followed and any(name in claim.joints for claim in claims.grippers)
    ]
    if gripped:
        message = f"joint '{gripped[0]}' is moved by a gripper controller, which follows no trajectory"
        return (Problem(loc, message, "`move`, `grasp` or `release` move the hand"),)
    owners = [claim for claim in claims.followers if set(joints) & set(claim.joints)]
    if len(owners) < 2:
        return tuple(_sleeping(claims, "follower", name, loc) for name in joints if name not in followed)[:1]
    shares = " and ".join(f"'{_first(joints, claim)}' ({claim.name})" for claim in owners)
    hint = "move them one controller after the other, or give them one controller in the controllers file"
    if not claims.hand:
        hint += f"; if one of them moves a hand, give it {_THIS_TYPE}"
    return (Problem(loc, f"joints of {len(owners)} controllers cannot be moved at once: {shares}", hint),)


def unmoved_joints(claims: Claims, joints: Sequence[str], loc: Loc) -> tuple[Problem, ...]:
    """Empty if one controller follows trajectories of these joints, and one moves those of them that are the hand's."""
    arm = [name for name in joints if name not in claims.hand]
    return unfollowed(claims, arm, loc) + (_not_one_hand(claims, loc) if len(arm) < len(joints) else ())


def unmoved_tool(claims: Claims, robot: RobotModel, loc: Loc) -> tuple[Problem, ...]:
    """Empty if the robot has a tool, and one controller follows trajectories of the joints that move it."""
    if robot.tool is None:
        hint = "add `tool: {link: ...}` to the robot file"
        return (Problem(loc, f"robot '{robot.name}' has no tool frame, so there is nothing to lead there", hint),)
    joints = arm_joints(robot, claims.hand)
    if not joints:
        hint = "say another link under `tool` in the robot file"
        return (Problem(loc, f"no joint of robot '{robot.name}' moves its tool at link '{robot.tool.link}'", hint),)
    return unfollowed(claims, joints, loc)


def unmoved_hand(claims: Claims, robot: RobotModel, posture: str, loc: Loc) -> tuple[Problem, ...]:
    """Empty if one gripper controller moves the hand to this pose of the robot."""
    posed = set(robot.pose(posture).joints)
    if posed & set(claims.hand):
        return _not_one_hand(claims, loc)
    message, hint = f"pose '{posture}' has no joint that a gripper controller moves", _GRIPPER
    owners = [one for one in claims.controllers if one.interfaces and posed & set(one.joints)]
    if len(owners) == 1 and not claims.hand:
        (owner,) = owners
        message += f": its joints are those of controller {owner.described}, of type `{owner.type}`"
        mixed = bool(set(owner.joints) & set(arm_joints(robot, ())))
        hint = f"take the hand's joints from '{owner.name}', and {_GRIPPER}" if mixed else f"give it {_THIS_TYPE}"
    return (Problem(loc, message, hint),)


def no_hand(robot: RobotModel) -> Problem:
    """What keeps a robot from every step with a hand."""
    return Problem((), f"no gripper controller moves a hand of robot '{robot.name}'", _GRIPPER)


def _not_one_hand(claims: Claims, loc: Loc) -> tuple[Problem, ...]:
    if len(claims.grippers) < 2:
        moved = [name for claim in claims.grippers for name in claim.joints]
        return tuple(_sleeping(claims, "hand", name, loc) for name in claims.hand if name not in moved)[:1]
    names = ", ".join(f"'{claim.name}'" for claim in claims.grippers)
    message = f"a step moves one hand, and {len(claims.grippers)} gripper controllers move joints of hands: {names}"
    return (Problem(loc, message, "give one gripper controller; one of type `joint_trajectory` moves other fingers"),)


def _sleeping(claims: Claims, role: Role, joint: str, loc: Loc) -> Problem:
    """Nobody who is active does what a step asks of a joint."""
    what = "follows trajectories of" if role == "follower" else "opens and closes a hand with"
    able = [one.name for one in claims.controllers if one.role == role and joint in one.joints]
    if able:
        message = f"controller '{able[0]}', which {what} joint '{joint}', is not active here"
        return Problem(loc, message, f"add a step before it: `switch_controllers: {able[0]}`")
    message = f"no controller {what} joint '{joint}'"
    types = " or ".join(", ".join(f"`{name}`" for name in claims.following).rsplit(", ", 1))
    hint = f"add the joint to a controller of a type that does, in the controllers file: {types}"
    owner = next((one for one in claims.controllers if one.interfaces and joint in one.joints), None)
    if owner is not None:
        message += f": it is one of controller {owner.described}, of type `{owner.type}`"
        hint = f"give '{owner.name}' a type that does: {types}"
    return Problem(loc, message, hint)


def _first(joints: Sequence[str], claim: Claim) -> str:
    return next(name for name in joints if name in claim.joints)
