"""`pick`: reach an object, approach it straight, and close the hand on it.

- pick: {object: cup, approach: {from: side, distance: [8 cm, 14 cm]}, grasp: {posture: wrap, force: 8 N}}
- pick: {object: pan, part: handle, approach: {from: top, yaw: 0, frame: pan/handle}}
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, get_args

from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.conditions.frames import fixed_frame, unknown_part
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.core.prose import amount, between, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates, first
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.clauses import approached, at_share
from manipcli.plan.face_frames import clear_of, face_frames
from manipcli.plan.grasp_frames import Direction, GraspFrame, GraspFrames, first_fitting, part_alone
from manipcli.plan.grasp_margin import carries
from manipcli.plan.hand import handless
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.place_goals import heading
from manipcli.plan.planner import CLEARANCE, NOTHING, Planner
from manipcli.plan.ranges import Range, spread
from manipcli.plan.reached_frames import reached_frames
from manipcli.plan.step import StepMember
from manipcli.plan.steps.grasp import GraspSpec, close, pressing_more, ungripped, with_reflex
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.tool_axes import misplaced, overlaps, too_wide
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.scene import SEPARATOR, Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.names import FrameName, MovableName, PoseName
from manipcli.spec.quantity import Angle, Length, Turn

SLOPES_DEG = (0.0, 30.0, 60.0)
"""Candidate slopes of the straight approach: along the hand's axis, or from above it, which folds the arm less."""
FURTHER = 60
"""Maximum number of further grasp frames that are tried where none of the usual ones has a plan."""
ATTEMPTS = 24
"""Maximum number of plans that are tried for further frames within reach."""
FEW = 8
"""Restarts of the inverse kinematics for a further frame, of which there are many."""
BRANCHES = 6
"""Maximum number of frames that are tried in another configuration of the arm, if it cannot follow the approach."""
LEVEL = 1e-6
"""[rad] A pitch this near to 0 or 90 deg is one from the side or from the top."""

WEAK = 6
"""Grasps that seem unable to hold the weight are tried last, and at once after so many of them."""

_OTHERWISE = (
    "change the approach, the height of the grasp or the opening of the hand: "
    "`approach: {from: ..., yaw: ...}`, `grasp: {height: ...}`, `open: ...`"
)
_STRONGER = "grasp it with more force, `grasp: {force: ...}`, or elsewhere: `grasp: {height: ...}`, `approach: {...}`"
_HIGHER = "grasp the object where the closing fingers have room, for example higher: `grasp: {height: ...}`"
_AIM = (
    "check `tool: {link: ..., pose: {rpy: ...}}` in the robot file: the tool's +z must point to the object, "
    "and the arm cannot reach that orientation"
)


class ApproachSpec(Model):
    """From where the hand comes."""

    from_: Direction | None = Field(
        None,
        alias="from",
        description="`side`: horizontally, `top`: from straight above. Default: from the side if possible, else from "
        "the top; with `yaw`: from the side.",
    )
    yaw: Turn | None = Field(
        None,
        description="Direction of the approach about the vertical [rad]; from the top: the yaw of the hand. Default: "
        "away from the robot's base; from the top: the yaw of the object, plus quarter turns.",
    )
    frame: FrameName | None = Field(
        None,
        description="Frame from whose x axis `yaw` is measured: `base`, a body, a part of one or a named frame. "
        "Default: `world`.",
    )
    pitch: Annotated[Angle, Field(ge=-math.pi / 2, le=math.pi / 2)] | None = Field(
        None,
        description="Angle of the approach below the horizontal, instead of `from` [rad]: 0 is `from: side`, 90 deg is "
        "`from: top`.",
    )
    distance: Annotated[Range, Field(description="Length of the straight approach [m].")] = (0.08, 0.14)

    @model_validator(mode="after")
    def _one(self) -> ApproachSpec:
        if self.from_ is not None and self.pitch is not None:
            message = f"`pitch` and `from: {self.from_}` both set the angle of the approach"
            raise problem("conflict", message, at=("pitch",), hint="remove one of them", key=True)
        if self.frame is not None and self.yaw is None:
            raise problem("conflict", "`frame` needs `yaw`", at=("frame",), hint="add `yaw: 0`", key=True)
        return self

    @property
    def direction(self) -> Direction | None:
        """From where the hand comes; None if not set, or at an angle."""
        if self.pitch is not None:
            level, down = abs(self.pitch) < LEVEL, abs(self.pitch - math.pi / 2) < LEVEL
            return "side" if level else "top" if down else None
        return "side" if self.from_ is None and self.yaw is not None else self.from_


class PickGraspSpec(GraspSpec):
    """The grasp of a pick; the object is that of the pick."""

    object: None = Field(None, description="Not allowed: the pick has the object.")
    height: Length | None = Field(
        None,
        description="Of the tool above the bottom of the object, or of its `part` [m]. Default: its middle; from the "
        "top higher, if that is out of reach.",
    )


class PickSpec(Model):
    """Open the hand, reach an object, approach it straight, and close the hand on it.

    The tool's +z is the direction of approach, its y the direction in which the fingers close. If a later step cannot
    be planned with this grasp, other grasps are tried, as far as `approach` and `height` leave them open: with the hand
    rotated by half a turn, from above, from the other sides, sloping from above, higher and lower, with other rolls of
    the hand; at a mesh also at opposite points of its surface. An arm of four or five joints also tries each pitch
    between side and top at the yaw that it has there.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The object to pick.")
    part: str | None = Field(
        None, description="The part of the object that the hand closes on (`handle`). Default: the whole object."
    )
    approach: ApproachSpec = Field(ApproachSpec(), description="From where the hand comes.")
    grasp: PickGraspSpec = Field(PickGraspSpec(), description="How the hand closes.")
    open: PoseName = Field("open", description="The pose of the hand while approaching.")
    velocity_scaling: VelocityScaling = Field(
        1.0,
        description="Share of the velocity, acceleration and jerk limits while reaching; the approach uses half.",
    )


def candidates(spec: PickSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Grasp frames, distances and slopes of the approach; last, other configurations of the arm.

    Raises:
        NotPlannable: the hand already holds something.
    """
    planner.free_hand(state, spec.object)
    before = _clear(spec, planner, state)
    state = before.end
    planner.free_start(state)
    body = planner.scene.body(spec.object)
    X_WO, yaw = planner.body_pose(state, spec.object), spec.approach.yaw
    part = None if spec.part is None else planner.scene.frame(f"{spec.object}{SEPARATOR}{spec.part}")
    if part is not None:
        body, X_WO = part_alone(body, part), X_WO @ part.X_PF
    if yaw is not None and spec.approach.frame is not None:
        yaw += heading(planner.frame(spec.approach.frame, state).R)
    frames = GraspFrames(
        body, X_WO, planner.robot.X_WB, planner.tool_pose(state).R,
        direction=spec.approach.direction, yaw=yaw, height=spec.grasp.height,
        pitch=None if spec.approach.direction is not None else spec.approach.pitch,
    )  # fmt: skip
    fingerless = handless(planner.robot, spec.grasp.posture)
    touching = planner.hand_contacts(spec.object) if fingerless else NOTHING
    usual = face_frames(frames, planner.robot) if fingerless else frames.usual()
    out_of_reach: dict[GraspFrame, NotPlannable | None] = {}
    lines: dict[GraspFrame, tuple[float, float, Array]] = {}
    unlikely: set[GraspFrame] = set()  # no approach to these was within reach so far
    attempts = 0
    weak: list[Candidate] = []
    starts: list[tuple[float, Transform]] = []  # of approaches, out of reach

    def attempt(frame: GraspFrame, distance: float, slope: float, further: bool, avoid: Array | None) -> StepPlan:
        nonlocal attempts
        builder = MotionBuilder(planner, state)
        if frame not in out_of_reach:  # checked once: it does not depend on distance and slope
            near = MotionBuilder(planner, state, allowed=touching)
            out_of_reach[frame] = near.unreachable("approach", frame.X_WT, hand=spec.open)
        refusal = out_of_reach[frame]
        if refusal is not None:
            others = sorted(part for part in refusal.parts - {spec.object} if not part.startswith("robot/"))
            nearer = f"move '{others[0]}' away" if others else f"move '{spec.object}' nearer"
            hint = _OTHERWISE if refusal.reason == "touches" and not others else f"{nearer}, or {_OTHERWISE}"
            if refusal.reason == "orientation":
                sides = [word for word in get_args(Direction) if spec.approach.direction not in (None, word)]
                hint = "; or set ".join([_AIM, *(f"`approach: {{from: {word}}}`" for word in sides)])
            raise refusal.but(hint=hint)
        attempts += further
        before_approach = backed_off(frame.X_WT, distance, slope)
        with planner.solver.trying(FEW) if frame in unlikely else nullcontext():
            try:
                builder.reach(
                    "reach",
                    before_approach,
                    speed=spec.velocity_scaling,
                    hand=spec.open,
                    avoid=() if avoid is None else (avoid,),
                )
            except NotPlannable as far:
                unlikely.add(frame)
                if far.reason not in ("reach", "orientation"):
                    raise
                starts.append((distance, before_approach))
                where = f"reach: the approach of {readable(distance, 'm')} starts out of reach: "
                raise far.but(
                    cause=where + far.cause.removeprefix("reach: "),
                    hint=_shorter(spec.object, distance, before_approach),
                ) from far
        try:
            builder.straight("approach", frame.X_WT, speed=spec.velocity_scaling / 2, allowed=touching)
            if fingerless:
                clear_of(planner, builder.now, spec.object)
        except NotPlannable as bent:
            if bent.reason == "line":
                lines.setdefault(frame, (distance, slope, builder.now.position))
            raise
        close(builder, spec.grasp, spec.object, roomier=_HIGHER)
        planned = with_reflex(builder.plan(), spec.grasp, planner, spec.object)
        planned = replace(planned, motions=(*before.motions, *planned.motions))
        if spec.grasp.until == "contact" and len(weak) < WEAK and not carries(planner, planned):
            weak.append(Candidate(lambda: planned, name=f"{frame.name}, by a weak grasp", grasp=frame.X_WT.R))
            raise NotPlannable(
                f"close: the contacts of the hand cannot hold the weight of '{spec.object}'", hint=_STRONGER
            )
        return planned

    def quickly(frame: GraspFrame, distance: float, slope: float, further: bool, avoid: Array | None) -> StepPlan:
        with planner.solver.trying(FEW):
            return attempt(frame, distance, slope, further, avoid)

    def candidate(
        frame: GraspFrame, distance: float, slope: float, further: bool = False, avoid: Array | None = None
    ) -> Candidate:
        sloping = f" at a slope of {math.degrees(slope):.0f} deg" if slope else ""
        branch = "" if avoid is None else ", in another configuration of the arm"
        name = f"{frame.name}, approach of {readable(distance, 'm')}{sloping}{branch}"
        plan = partial(quickly if further else attempt, frame, distance, slope, further, avoid)
        return Candidate(plan, name=name, grasp=frame.X_WT.R)

    def touched() -> bool:
        return any(why is None or why.reason == "touches" for why in out_of_reach.values())

    def options() -> Iterator[Candidate]:
        for one in grasps():
            yield one
            if len(weak) == WEAK:
                break  # the predicted contacts are not as they seem
        yield from weak

    def grasps() -> Iterator[Candidate]:
        for k, frame in enumerate((*usual, *frames.higher())):
            if k >= len(usual) and (fingerless or not touched()):
                break  # a higher grasp is not nearer
            for distance, slope in itertools.product(spread(spec.approach.distance), slopes()):
                yield candidate(frame, distance, slope)
        if fingerless or (not touched() and _beyond(planner, state, usual[0].X_WT)):
            return  # no other orientation is nearer
        overlapping = overlaps(planner, state, spec.object, spec.open)
        reached = reached_frames(frames, planner.solver, state.position, planner.rng)
        for frame in reached:
            if overlapping(frame.X_WT):
                continue
            for distance, slope in itertools.product(spread(spec.approach.distance), slopes()):
                yield candidate(frame, distance, slope)
        for frame in first_fitting(frames.further(), lambda X_WT: not overlapping(X_WT), FURTHER):
            for distance, slope in _brief(spec.approach.distance):
                if attempts >= ATTEMPTS:
                    break
                yield candidate(frame, distance, slope, True)
                if out_of_reach.get(frame) is not None:
                    break
        for frame, (distance, slope, position) in tuple(lines.items())[:BRANCHES]:
            yield candidate(frame, distance, slope, True, position)

    def explain(refusal: NotPlannable) -> NotPlannable:
        if fingerless:
            return refusal
        amiss = misplaced(planner, state, spec.open, spec.grasp.posture)
        wide = too_wide(planner, state, spec.object, spec.open, [frame.X_WT for frame in usual])
        nearer = _shorter(spec.object, *min(starts, key=lambda start: start[0])) if starts else None
        own = None if refusal.hint is None else refusal.hint.removeprefix(f"move '{spec.object}' away, or ")
        hints = dict.fromkeys(hint for hint in (amiss or wide, nearer, own) if hint is not None)
        # An earlier step may have put the object where it cannot be picked.
        return refusal.but(hint="; or ".join(hints) or None, parts=refusal.parts | {spec.object})

    return Candidates(options(), what=f"cannot pick '{spec.object}'", decides="grasp", explain=explain)


def _shorter(body: str, distance: float, X_WT: Transform) -> str:
    """The hint for an approach that starts out of reach of an arm that reaches the object."""
    x, y, z = X_WT.p
    where = f"({x:.3f}, {y:.3f}, {z:.3f}) m, {readable(distance, 'm')} before it"
    return f"shorten `approach: {{distance: ...}}`: the arm reaches '{body}', but not the start at {where}"


def _brief(distance: Range) -> tuple[tuple[float, float], ...]:
    """(distance [m], slope [rad]) of the approaches to a further frame: fewer than to a usual one."""
    middle, straight, sloping = spread(distance)[0], *slopes()[:2]
    return tuple(dict.fromkeys(((middle, straight), (middle, sloping), (distance[0], straight))))


def _beyond(planner: Planner, state: PlanningState, X_WT: Transform) -> bool:
    """Whether no orientation of the tool reaches the point of a frame."""
    try:
        with planner.solver.trying(FEW):
            planner.solver.leaving("rotation").solve(X_WT, state.position, planner.rng)
    except NotPlannable:
        return True
    return False


def _clear(spec: PickSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """Withdrawal from the object if the hand is around it or near it, after a failed grasp; else no motion."""
    if planner.distance(state, spec.object) >= CLEARANCE:
        return StepPlan((), state)

    def attempt(distance: float, slope: float) -> StepPlan:
        builder = MotionBuilder(planner, state)
        builder.open(spec.open, around=spec.object)
        X_WT = backed_off(planner.tool_pose(state), distance, slope)
        builder.withdraw(X_WT, spec.object, speed=spec.velocity_scaling / 2, grazing=True)
        return builder.plan()

    ways = itertools.product(spread(spec.approach.distance), slopes())
    options = [Candidate(partial(attempt, *way)) for way in ways]
    return first(Candidates(options, what=f"cannot withdraw from '{spec.object}'"))


def backed_off(X_WG: Transform, distance: float, slope: float) -> Transform:
    """The tool pose moved back by `distance` [m] along its axis, and up at the `slope` [rad] of that line."""
    up = Transform.of(xyz=(0.0, 0.0, distance * math.tan(slope)))
    return up @ X_WG @ Transform.of(xyz=(0.0, 0.0, -distance))


def slopes() -> tuple[float, ...]:
    """The candidate slopes [rad], the straight one first."""
    return tuple(math.radians(slope) for slope in SLOPES_DEG)


def check(spec: PickSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown object, part, frame or postures."""
    unknown = unknown_body(scene, spec.object, ("object",), movable=True, carried=True)
    if spec.part is not None and not unknown:
        unknown += unknown_part(scene, spec.object, spec.part, ("part",))
    if spec.approach.frame is not None:
        unknown += fixed_frame(robot, scene, spec.approach.frame, ("approach", "frame"))
    return (
        unknown
        + unknown_posture(robot, spec.grasp.posture, ("grasp", "posture"))
        + unknown_posture(robot, spec.open, ("open",))
    )


def uncommanded(spec: PickSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool or a hand without a controller."""
    return (
        unmoved_tool(claims, robot, ("object",))
        + unmoved_hand(claims, robot, spec.grasp.posture, ("grasp", "posture"))
        + unmoved_hand(claims, robot, spec.open, ("open",))
        + ungripped(spec.grasp, robot, claims, ("grasp", "reflex"))
    )


def clause(spec: PickSpec, robot: RobotModel) -> str:
    approach, grasp = spec.approach, spec.grasp
    part = "" if spec.part is None else f" by its part {named(spec.part)}"
    height = "" if grasp.height is None else f" {amount(grasp.height, 'm')} above its bottom"
    until = ", or until it is in that pose" if grasp.until == "posture" else ""
    return (
        f"pick {named(spec.object)}{part}{approached(approach.from_, approach.pitch, approach.yaw, approach.frame)}: "
        f"open the hand (pose {named(spec.open)}), approach straight over {between(approach.distance, 'm')}, and close "
        f"the hand (pose {named(grasp.posture)}){height} until each finger presses with {amount(grasp.force, 'N')}"
        f"{until}{pressing_more(spec.grasp)}{at_share(spec.velocity_scaling, 1.0)}"
    )


MEMBER = StepMember(
    name="pick", spec=PickSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause
)
