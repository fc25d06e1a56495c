"""Moving a joint of the scene by hand: the hand takes a handle or pushes it, follows the joint's path, and lets go.

The hand that holds the handle is stiff along the path and soft across it and about all axes, where the joint guides
it. It leads by the force that moves the joint over its stiffness along the path, so that the joint arrives.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.units import readable
from manipcli.model.grasp import friction_coefficient
from manipcli.plan.arm_force import refuse_weak
from manipcli.plan.candidates import Candidate
from manipcli.plan.compliance import Compliance, compliant
from manipcli.plan.grasp_frames import GraspFrame
from manipcli.plan.handle_frames import handle_frames
from manipcli.plan.jointed import LEVER, along, moved_to, needed, position_of, tool_twist, weight, wrench_of
from manipcli.plan.motion import JointGoal, PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.ranges import Range, spread
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import Frame

ALONG: Final = 3000.0
"""[N/m] Stiffness of the hand along the path of the joint."""
ACROSS: Final = 400.0
"""[N/m] Stiffness across it."""
ABOUT: Final = 30.0
"""[N m/rad] Stiffness of the orientation."""
FEW: Final = 8
"""Restarts of the inverse kinematics for a grasp frame."""
MOST: Final = 40
"""Maximum number of grasp frames that the arm reaches and that are tried."""
TURNING: Final = 150.0
"""[N m/rad] Stiffness about the axis of a hinge that the hand is on."""
RESERVE: Final = 0.7
"""Share of the friction between fingers and handle that a plan uses."""
HOOKED: Final = 0.7
"""Cosine between path and closing direction above which a finger is behind the handle."""
LEAD: Final = 0.02
"""[rad or m] The hand leads by this at most."""
CREEP: Final = 1e-3
"""[rad/s or m/s] Speed at which friction is overcome."""


@dataclass(frozen=True, slots=True)
class Handling:
    """How a hand moves a joint.

    Attributes:
        joint: it moves.
        handle: the part that it takes.
        goal: where the joint goes.
        label: of the motion along the path.
        approach, retreat: lengths [m] of the straight approach and of the withdrawal.
        posture, open: poses of the hand, closed and open.
        force: [N] with which each finger presses.
        speed: share of the limits.
        weak: the refusals of ways in which hand or arm cannot give the force; None: one way has the force.
    """

    joint: SceneJoint
    handle: Frame
    goal: JointGoal
    label: str
    approach: Range
    retreat: Range
    posture: str
    open: str
    force: float
    speed: float
    weak: list[NotPlannable | None] = field(default_factory=list)

    def explain(self, refusal: NotPlannable) -> NotPlannable:
        """The refusal of all ways; by the force, if none has it."""
        weak = [each for each in self.weak if each is not None]
        if not weak or len(weak) < len(self.weak):
            return refusal
        what = refusal.cause.partition(",")[0]
        return refusal.but(cause=f"{what}: {weak[0].cause}", hint=weak[0].hint)

    @contextmanager
    def forced(self) -> Iterator[None]:
        """Keeps a refusal inside for `explain`."""
        try:
            yield
        except NotPlannable as refusal:
            self.weak.append(refusal)
            raise
        self.weak.append(None)


def ways(handling: Handling, planner: Planner, state: PlanningState) -> Iterator[Candidate]:
    """The ways to take the handle, the preferred first."""
    joint = handling.joint
    X_WP = planner.body_pose(state, joint.child) @ handling.handle.X_PF
    size = np.zeros(3) if handling.handle.size is None else handling.handle.size
    outward = _outward(planner, state, handling, X_WP)
    refused: dict[GraspFrame, NotPlannable | None] = {}
    tried = 0

    def attempt(frame: GraspFrame, distance: float) -> StepPlan:
        builder = MotionBuilder(planner, state, verb=handling.label, allowed=planner.touching(state, joint.child))
        with planner.solver.trying(FEW):
            if frame not in refused:
                refused[frame] = builder.unreachable("approach", frame.X_WT, hand=handling.open)
            if (refusal := refused[frame]) is not None:
                raise refusal
            back = frame.X_WT @ Transform.of(xyz=(0.0, 0.0, -distance))
            builder.reach("reach", back, speed=1.0, hand=handling.open)
        builder.straight("approach", frame.X_WT, speed=handling.speed)
        refuse_force(handling, planner, builder.now, gripped=True)
        builder.close(handling.posture, force=handling.force, must_hold=True, body=joint.child)
        follow(handling, planner, builder)
        builder.open(handling.open, must_arrive=True)
        return withdrawn(handling, planner, builder)

    for frame in handle_frames(X_WP, size, outward, planner.tool_pose(state).R):
        for distance in spread(handling.approach):
            name = f"{frame.name}, approach of {readable(distance, 'm')}"
            yield Candidate(partial(attempt, frame, distance), name=name, grasp=frame.X_WT.R)
            if refused.get(frame) is not None:
                break
        tried += refused.get(frame) is None
        if tried >= MOST:
            return


def _outward(planner: Planner, state: PlanningState, handling: Handling, X_WP: Transform) -> Array:
    """(3,) unit vector from the link to the handle: along the axis of the handle from which the link is furthest."""
    body, X_WC = planner.scene.body(handling.joint.child), planner.body_pose(state, handling.joint.child)
    size = np.zeros(3) if handling.handle.size is None else handling.handle.size
    away = X_WP.R.T @ (X_WP.p - X_WC.apply(body.centre))
    half = np.abs((X_WC.R.T @ X_WP.R).T) @ body.size / 2.0
    # How far the handle reaches out of the box about the link, per axis: the link's box includes it.
    room = np.abs(away) + size / 2.0 - half
    order = np.argsort(size, kind="stable")
    if size[order[2]] > 1.5 * size[order[1]]:
        room[order[2]] = -np.inf
    k = int(np.argmax(room))
    return np.asarray(np.sign(away[k]) * X_WP.R[:, k])


def follow(handling: Handling, planner: Planner, builder: MotionBuilder) -> None:
    """Move the link with the hand to the goal, and further by the lead of the compliant hand."""
    joint, goal, state = handling.joint, handling.goal, builder.now
    X_WT = planner.tool_pose(state)
    here = position_of(planner, state, joint)
    sense = float(np.sign(goal.position - here))
    twist = tool_twist(planner, state, joint, X_WT)
    law, stiffness = compliance(twist, X_WT)
    lead = needed(joint, goal.position, CREEP * sense, weight(planner, state, joint, goal.position)) / stiffness
    beyond = goal.position + max(-LEAD, min(LEAD, lead))
    with compliant(builder, law):
        try:
            builder.along(handling.label, along(planner, state, joint, beyond, X_WT), speed=handling.speed)
        except NotPlannable as refusal:
            if refusal.reason == "line":
                raise refusal.but(hint=f"move '{joint.parent}' nearer, or move its joint less far") from refusal
            raise


def refuse_force(handling: Handling, planner: Planner, state: PlanningState, *, gripped: bool) -> None:
    """Check that the arm can move the joint from here, and that the fingers hold the handle.

    Raises:
        NotPlannable: the arm is too weak; or two fingers, `gripped` and none of them behind the handle, hold less by
            Coulomb's law than the joint needs.
    """
    joint, X_WT = handling.joint, planner.tool_pose(state)
    here = position_of(planner, state, joint)
    sense = float(np.sign(handling.goal.position - here))
    efforts = (
        needed(joint, q, CREEP * sense, weight(planner, state, joint, q)) for q in (here, handling.goal.position)
    )
    effort = max(efforts, key=abs)
    wrench = wrench_of(tool_twist(planner, state, joint, X_WT), effort)
    size = float(np.linalg.norm(wrench[:3]))
    held = RESERVE * 2.0 * friction_coefficient(planner.robot, planner.scene.body(joint.child)) * handling.force
    hooked = abs(float(X_WT.R[:, 1] @ wrench[:3])) >= HOOKED * size
    with handling.forced():
        refuse_weak(planner, state.position, wrench, handling.label)
        if gripped and size > held and not hooked:
            message = f"{handling.label}: two fingers hold {held:.3g} N by friction, the joint needs {size:.4g} N"
            raise NotPlannable(message, hint="press more, `force: ...`, or take a handle that fits behind a finger")


def compliance(twist: Array, X_WT: Transform) -> tuple[Compliance, float]:
    """The compliance of a hand that moves with a `twist` (6), and its stiffness in the position of the joint.

    It is stiff along the path of the tool, soft across it and about all axes. Where it only turns, near the axis of a
    hinge, it is stiff about this axis.
    """
    linear, angular = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    turns = linear < LEVER * angular
    path = X_WT.R.T @ (twist[3:] / angular if turns else twist[:3] / linear)
    other = np.eye(3)[int(np.argmin(np.abs(path)))]
    x = np.cross(other, path)
    x /= np.linalg.norm(x)
    X_TC = Transform.of(R=np.column_stack([x, np.cross(path, x), path]))
    stiffness = np.array([ACROSS, ACROSS, ACROSS if turns else ALONG, ABOUT, ABOUT, TURNING if turns else ABOUT])
    own = TURNING * angular**2 if turns else ALONG * linear**2
    return Compliance(frozen(stiffness), X_TC=X_TC), own


def withdrawn(handling: Handling, planner: Planner, builder: MotionBuilder) -> StepPlan:
    """The plan with a withdrawal straight back, the shortest first; the joint is at its goal."""
    X_WT = planner.tool_pose(builder.now)
    refused: NotPlannable | None = None
    for distance in sorted(spread(handling.retreat)):
        for grazing in (False, True):
            attempt = builder.copy()
            back = X_WT @ Transform.of(xyz=(0.0, 0.0, -distance))
            try:
                attempt.withdraw(back, handling.joint.child, speed=handling.speed, grazing=grazing)
            except NotPlannable as refusal:
                refused = refused or refusal
                continue
            plan = attempt.plan()
            end = moved_to(planner, plan.end, handling.joint, handling.goal.position)
            return replace(plan, end=end, joint=handling.goal)
    assert refused is not None
    raise refused
