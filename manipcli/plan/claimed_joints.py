"""Claims of controllers on joints during planning, and the parts of a step that no controller can command.

A trajectory goes to one active controller, and so does a goal of the hand: neither can be split. The files alone
determine this for every step, so it is checked before anything is planned.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from manipcli.conditions.condition import Problem
from manipcli.core.errors import Loc, Place
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.plan.hand import handless
from manipcli.spec.controllers import Interface, Role
from manipcli.spec.controllers_file import ControllersSpec

_GRIPPER = "add a controller of type `gripper` for the hand's joints to the controllers file"
_THIS_TYPE = "`type: gripper`"


@dataclass(frozen=True, slots=True)
class Claim:
    """One controller: its role for steps, joints, command interfaces and state; its type and its place in the file."""

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
    """All controllers of a robot at one point of a task; `following`: the types that follow trajectories."""

    controllers: tuple[Claim, ...]
    following: tuple[str, ...] = ()

    @classmethod
    def of(cls, spec: ControllersSpec, place: Callable[..., Place | None] = lambda *_: None) -> Claims:
        """The controllers of a file, as at the start; `place` gives the line and column of a location in it."""
        return cls(
            tuple(
                Claim(
                    name,
                    own.role,
                    own.joints,
                    own.interfaces,
                    own.active,
                    own.type,
                    place("controllers", name, "type"),
                )
                for name, own in spec.controllers.items()
            ),
            following=tuple(name for name, kind in type(spec).types.items() if kind.role == "follower"),
        )

    def switched(self, activated: Sequence[str], deactivated: Sequence[str]) -> Claims:
        """The claims after a switch; a name in both lists is active."""
        controllers = tuple(
            replace(claim, active=claim.name in activated or (claim.active and claim.name not in deactivated))
            for claim in self.controllers
        )
        return replace(self, controllers=controllers)

    @property
    def followers(self) -> tuple[Claim, ...]:
        """The active controllers that follow trajectories."""
        return tuple(claim for claim in self.controllers if claim.active and claim.role == "follower")

    @property
    def grippers(self) -> tuple[Claim, ...]:
        """The active controllers that open and close a hand."""
        return tuple(claim for claim in self.controllers if claim.active and claim.role == "hand")

    @property
    def hand(self) -> tuple[str, ...]:
        """The joints of all gripper controllers, active or not."""
        return tuple(dict.fromkeys(name for claim in self.controllers if claim.role == "hand" for name in claim.joints))


def unknown_controller(claims: Claims, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if no controller has this name, else empty."""
    known = [claim.name for claim in claims.controllers]
    if name in known:
        return ()
    message = f"controller '{name}' is not in the controllers file"
    return (Problem(loc, message, did_you_mean(name, known, kind="controllers")),)


def arm_joints(robot: RobotModel, hand: Sequence[str]) -> tuple[str, ...]:
    """The independent joints from the root to the tool, without the hand's; empty for a robot without a tool."""
    return above(robot, "" if robot.tool is None else robot.tool.link, hand)


def above(robot: RobotModel, link: str, hand: Sequence[str]) -> tuple[str, ...]:
    """The independent joints from the root to a link, without the hand's."""
    by_child = {joint.child: joint for joint in robot.joints}
    found = []
    while link in by_child:
        joint = by_child[link]
        if joint.independent and joint.name not in hand:
            found.append(joint.name)
        link = joint.parent
    return tuple(reversed(found))


def unfollowed(claims: Claims, joints: Sequence[str], loc: Loc) -> tuple[Problem, ...]:
    """A problem unless one controller follows trajectories of all these joints."""
    followed = {name for claim in claims.followers for name in claim.joints}
    gripped = [
        name for name in joints if name not in followed and any(name in claim.joints for claim in claims.grippers)
    ]
    if gripped:
        message = f"joint '{gripped[0]}' belongs to a gripper controller, which does not follow trajectories"
        return (Problem(loc, message, "move the hand with `move`, `grasp` or `release`"),)
    owners = [claim for claim in claims.followers if set(joints) & set(claim.joints)]
    if len(owners) < 2:
        return tuple(_unserved(claims, "follower", name, loc) for name in joints if name not in followed)[:1]
    shares = " and ".join(f"'{_first(joints, claim)}' ({claim.name})" for claim in owners)
    hint = "use one step per controller, or give the joints one controller in the controllers file"
    if not claims.hand:
        hint += f"; if one of them moves a hand, change it to {_THIS_TYPE}"
    return (Problem(loc, f"one step cannot move joints of {len(owners)} controllers: {shares}", hint),)


def unmoved_joints(claims: Claims, joints: Sequence[str], loc: Loc) -> tuple[Problem, ...]:
    """Problems unless one controller follows trajectories of the arm joints, and one gripper controller the hand's."""
    arm = [name for name in joints if name not in claims.hand]
    return unfollowed(claims, arm, loc) + (_not_one_hand(claims, loc) if len(arm) < len(joints) else ())


def unmoved_tool(claims: Claims, robot: RobotModel, loc: Loc) -> tuple[Problem, ...]:
    """A problem unless the robot has a tool, and one controller follows trajectories of the joints that move it."""
    if robot.tool is None:
        hint = "add `tool: {link: ...}` to the robot file"
        return (Problem(loc, f"robot '{robot.name}' has no tool frame to move", hint),)
    joints = arm_joints(robot, claims.hand)
    if not joints:
        hint = "set another link under `tool` in the robot file"
        return (Problem(loc, f"no joint of robot '{robot.name}' moves its tool link '{robot.tool.link}'", hint),)
    return unfollowed(claims, joints, loc)


def unmoved_hand(claims: Claims, robot: RobotModel, posture: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem unless one gripper controller moves the hand to this pose of the robot."""
    if handless(robot, posture):
        return ()
    posed = set(robot.pose(posture).joints)
    if posed & set(claims.hand):
        return _not_one_hand(claims, loc)
    message, hint = f"pose '{posture}' has no joint that a gripper controller moves", _GRIPPER
    owners = [claim for claim in claims.controllers if claim.interfaces and posed & set(claim.joints)]
    if len(owners) == 1 and not claims.hand:
        (owner,) = owners
        message += f": its joints belong to controller {owner.described} of type `{owner.type}`"
        mixed = bool(set(owner.joints) & set(arm_joints(robot, ())))
        move = f"remove the hand's joints from '{owner.name}', and {_GRIPPER}"
        hint = move if mixed else f"change it to {_THIS_TYPE}"
    return (Problem(loc, message, hint),)


def no_hand(robot: RobotModel) -> Problem:
    """The problem of a robot without a gripper controller, for every step that uses a hand."""
    return Problem((), f"no gripper controller moves a hand of robot '{robot.name}'", _GRIPPER)


def _not_one_hand(claims: Claims, loc: Loc) -> tuple[Problem, ...]:
    if len(claims.grippers) < 2:
        moved = [name for claim in claims.grippers for name in claim.joints]
        return tuple(_unserved(claims, "hand", name, loc) for name in claims.hand if name not in moved)[:1]
    names = ", ".join(f"'{claim.name}'" for claim in claims.grippers)
    message = f"{len(claims.grippers)} gripper controllers are active, but a step moves one hand: {names}"
    return (Problem(loc, message, "keep one gripper controller; move other fingers with type `joint_trajectory`"),)


def _unserved(claims: Claims, role: Role, joint: str, loc: Loc) -> Problem:
    what = "follows trajectories of" if role == "follower" else "opens and closes a hand with"
    able = [claim.name for claim in claims.controllers if claim.role == role and joint in claim.joints]
    if able:
        message = f"controller '{able[0]}' is not active here; it {what} joint '{joint}'"
        return Problem(loc, message, f"add a step before it: `switch_controllers: {able[0]}`")
    message = f"no controller {what} joint '{joint}'"
    types = " or ".join(", ".join(f"`{name}`" for name in claims.following).rsplit(", ", 1))
    hint = f"add the joint to a controller of type {types} in the controllers file"
    owner = next((claim for claim in claims.controllers if claim.interfaces and joint in claim.joints), None)
    if owner is not None:
        message += f": it belongs to controller {owner.described} of type `{owner.type}`"
        hint = f"change the type of '{owner.name}' to {types}"
    return Problem(loc, message, hint)


def _first(joints: Sequence[str], claim: Claim) -> str:
    return next(name for name in joints if name in claim.joints)
