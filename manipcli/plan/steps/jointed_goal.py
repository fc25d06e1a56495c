"""What `open`, `close` and `turn` share: what they move, from where to where, and what `check` refuses."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, ClassVar, Final

from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.core.errors import NotPlannable
from manipcli.core.prose import amount, between, named
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.jointed import does_not_stay, position_of
from manipcli.plan.motion import JointGoal, PlanningState, StepPlan
from manipcli.plan.operating import Handling, ways
from manipcli.plan.planner import Planner
from manipcli.plan.pushing import pushes
from manipcli.plan.ranges import Range
from manipcli.plan.steps.grasp import DEFAULT_FORCE
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.joints import SceneJoint, joints_of
from manipcli.scene.scene import SEPARATOR, Frame, Scene
from manipcli.spec.base import Model
from manipcli.spec.names import BodyName, PoseName
from manipcli.spec.quantity import Force

WITHIN: Final = {"m": 0.005, "rad": math.radians(3.0)}
"""Tolerance of the position that a step moves a joint to."""
LABELS: Final = {"open": "pull", "close": "push", "turn": "turn"}
"""The phase of a step in which the joint moves."""
PLACEHOLDER: Final = "world"
"""The parent of a joint of a file with faults, of which only the name is known."""
ROUNDING: Final = 1e-9


class HandleSpec(Model):
    """The fields of a step that moves a jointed thing by its handle."""

    renamed: ClassVar = RENAMED
    verb: ClassVar[str] = ""

    object: BodyName = Field(description="The body with one joint, or the link that a joint moves: `BODY/LINK`.")
    part: str = Field("handle", description="The part that the hand takes or pushes. Default: `handle`.")
    approach: Annotated[Range, Field(description="Length of the straight approach [m].")] = (0.06, 0.12)
    retreat: Annotated[Range, Field(description="Length of the straight withdrawal [m].")] = (0.06, 0.12)
    posture: PoseName = Field("closed", description="The named pose that the hand closes towards.")
    open: PoseName = Field("open", description="The named pose of the open hand.")
    force: Force = Field(
        DEFAULT_FORCE,
        gt=0,
        description="Contact force at which a finger stops [N]; a position-controlled finger presses with its effort "
        "limit regardless.",
    )
    velocity_scaling: VelocityScaling = 0.3


def moved_joint(scene: Scene, name: str) -> SceneJoint | None:
    """The joint of a body with a single one, or of a link, by the name of the body; None: it has none, or several."""
    own = [joint for joint in scene.joints if joint.child == name] or [*joints_of(scene.joints, name)]
    return own[0] if len(own) == 1 and own[0].parent != PLACEHOLDER else None


def handle_of(scene: Scene, joint: SceneJoint, part: str) -> Frame | None:
    """The part of the link that a joint moves; None: the link has no such part."""
    frame = scene.frame(f"{joint.child}{SEPARATOR}{part}")
    return frame if frame is not None and frame.parent == joint.child else None


def joint_and_handle(scene: Scene, spec: HandleSpec) -> tuple[SceneJoint, Frame]:
    """What a checked spec names."""
    joint = moved_joint(scene, spec.object)
    assert joint is not None  # refused by `check_handle`
    handle = handle_of(scene, joint, spec.part)
    assert handle is not None
    return joint, handle


def by_hand(
    spec: HandleSpec,
    planner: Planner,
    state: PlanningState,
    joint: SceneJoint,
    handle: Frame,
    goal: JointGoal,
    *,
    push: bool = False,
) -> Candidates:
    """The ways to take the handle and to move the joint to the goal; no motion where it is there already.

    Raises:
        NotPlannable: the joint would not stay at the goal, the hand holds something, or the robot is too near to
            something already.
    """
    handling = Handling(
        joint, handle, goal, LABELS[spec.verb], spec.approach, spec.retreat, spec.posture, spec.open, spec.force,
        spec.velocity_scaling,
    )  # fmt: skip
    if goal.short(position_of(planner, state, joint)) <= goal.within:
        there = StepPlan((), state, joint=goal)
        return Candidates([Candidate(lambda: there, name="it is there already")])
    what = f"cannot {spec.verb} '{spec.object}'"
    if why := does_not_stay(planner, state, joint, goal):
        name = joint.name.rpartition(SEPARATOR)[2]
        hint = f"move it to where it stays, or add `joints: {{{name}: {{friction: ...}}}}` to its body"
        raise NotPlannable(f"{what}: {why}", hint=hint)
    planner.free_hand(state, joint.child)
    planner.free_start(state)
    options = itertools.chain(pushes(handling, planner, state) if push else (), ways(handling, planner, state))
    return Candidates(options, what=what, decides="branch", explain=handling.explain)


def opening(joint: SceneJoint) -> float:
    """1 or -1: the direction in which a joint opens, towards the limit that is further from where it is closed."""
    return 1.0 if joint.upper - joint.closed >= joint.closed - joint.lower else -1.0


def most(joint: SceneJoint) -> float:
    """[rad or m] by which it opens at most; infinite without limits."""
    return max(joint.upper - joint.closed, joint.closed - joint.lower)


def check_handle(spec: HandleSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """What has no joint, or several, or no such part; a robot without fingers; unknown postures."""
    return (
        _unmovable(spec, scene)
        + _fingerless(robot)
        + unknown_posture(robot, spec.posture, ("posture",))
        + unknown_posture(robot, spec.open, ("open",))
    )


def _unmovable(spec: HandleSpec, scene: Scene) -> tuple[Problem, ...]:
    name = spec.object
    own = joints_of(scene.joints, name)
    joint = moved_joint(scene, name)
    if any(each.parent == PLACEHOLDER for each in own):
        return ()
    if joint is None and own:
        links = ", ".join(f"`{each.child}`" for each in own)
        message = f"'{name}' has {len(own)} joints; which is meant?"
        return (Problem(("object",), message, f"name the link: {links}", code="TASK370"),)
    if joint is None:
        jointed = [joint.name.rpartition(SEPARATOR)[0] for joint in scene.joints]
        known = list(dict.fromkeys([*jointed, *(each.child for each in scene.joints if each.parent != PLACEHOLDER)]))
        if name not in [body.name for body in scene.bodies]:
            return (Problem(("object",), f"'{name}' is not in the scene", did_you_mean(name, known)),)
        hint = f"bodies with joints: {', '.join(known)}" if known else "a body from a `urdf` with joints has them"
        return (Problem(("object",), f"'{name}' has no joint", hint, code="TASK370"),)
    if handle_of(scene, joint, spec.part) is None:
        parts = [part for part in scene.parts(joint.child) if handle_of(scene, joint, part) is not None]
        hint = f"add a link '{spec.part}' on a fixed joint to its file, or name a part: `part: {parts[0]}`"
        message = f"'{name}' has no part '{spec.part}' to take it by"
        return (Problem(("part",) if spec.part != "handle" else ("object",), message, hint, code="TASK372"),)
    return ()


def _fingerless(robot: RobotModel) -> tuple[Problem, ...]:
    if robot.holding is None:
        return ()
    message = f"robot '{robot.name}' holds by {robot.holding.kind}: it cannot take a handle"
    return (Problem(("object",), message, "use a robot whose hand closes by its fingers"),)


def beyond(joint: SceneJoint, wanted: float, limit: float, key: str, verb: str) -> tuple[Problem, ...]:
    """TASK373: `wanted` [rad or m] by which a joint is to move, of which it can `limit`."""
    if wanted <= limit + ROUNDING:
        return ()
    message = f"'{joint.name}' {verb} by {amount(limit, joint.unit)} at most, not by {amount(wanted, joint.unit)}"
    return (Problem((key,), message, f"lower `{key}`, or change the limits of the joint", code="TASK373"),)


def taking(spec: HandleSpec) -> str:
    """How, for clauses: `take its part 'handle' ...`."""
    return (
        f"approach its part {named(spec.part)} straight over {between(spec.approach, 'm')}, close the hand (pose "
        f"{named(spec.posture)}) until each finger presses with {amount(spec.force, 'N')}, follow the path of the "
        f"joint, open the hand (pose {named(spec.open)}), and withdraw it by {between(spec.retreat, 'm')}"
        f"{at_share(spec.velocity_scaling, 0.3)}"
    )


def travel(scene: Scene | None, name: str, value: float) -> str:
    """A position of the joint of an object in its unit; without a scene, in the units that it may have."""
    joint = None if scene is None else moved_joint(scene, name)
    return f"{amount(value, 'rad')} or {amount(value, 'm')}" if joint is None else amount(value, joint.unit)


def uncommanded(spec: HandleSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool or a hand without a controller."""
    return (
        unmoved_tool(claims, robot, ("object",))
        + unmoved_hand(claims, robot, spec.posture, ("posture",))
        + unmoved_hand(claims, robot, spec.open, ("open",))
    )
