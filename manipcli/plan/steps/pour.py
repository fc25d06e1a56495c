"""`pour`: hold a cup over a container, tilt it about a horizontal axis of the hand, wait, and tilt it back.

    - pour: {object: cup, into: tray, tilt: 120 deg, dwell: 1 s}
      until: {inside: {object: ball, of: tray}}
      timeout: 15 s

The lip (the lowest point of the rim when tilted) is placed above the centre of the container if what leaves the rim
then lands well within the container's opening, else so far before it that it lands in the middle; where that is too
uncertain, the cup tilts slower. What leaves the cup flies on in the direction w; see `plan.flight`. With c the centre
of the rim, r its radius, a the axis and w = a x z the horizontal direction in which the upright cup tips, all from O in
the world, a rotation R by theta about a puts the lip at

    p_O + R (c + r w) = p_O + (h sin(theta) + r cos(theta)) w + (h cos(theta) - r sin(theta)) z

where the second form is for a rim at the height h above O.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Final

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.core.prose import amount, between, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.carrying import carry
from manipcli.plan.claimed_joints import Claims, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.flight import PLACE_ERROR, room
from manipcli.plan.motion import PlanningState, StepPlan, Stream
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.portion import Amount, portion_of
from manipcli.plan.ranges import Range, spread
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.stream import Pouring, tilting, width
from manipcli.scene.scene import Body, Scene
from manipcli.spec.base import Model
from manipcli.spec.names import ContainerName, MovableName
from manipcli.spec.quantity import Angle, Length, Pause

YAWS_DEG = (0.0, 15.0, -15.0, 30.0, -30.0, 50.0, -50.0, 75.0, -75.0)
"""Candidate rotations of the hand about the vertical, relative to how the cup is held."""
UP = np.array([0.0, 0.0, 1.0])
ENOUGH: Final = 0.01
"""[m] With this margin the lip stays above the centre."""
EXACT: Final = 0.002
"""[m] An `aim` is met within this."""
SLOWER: Final = (1.0, 0.5, 0.2)
"""Shares of the speed of the tilt, tried in this order."""
STEEP: Final = math.radians(80.0)
"""For an `amount`, the cup tilts slowly from here on: what rolls begins to leave at 90 deg."""
DOSING: Final = math.radians(5.0)
"""[rad/s] That slowly: one after the other of many bodies leaves."""
POURING: Final = frozenset({"tilt", "dose", "dwell"})
"""Motions that an `amount` ends."""
ROUNDS: Final = 2
"""How often the lip is moved per speed: another place of the lip changes the tilt a little."""


class PourSpec(Model):
    """Carry a held object over a container, tilt it about a horizontal axis of the hand, wait, and tilt it back.

    A pour of more than 90 deg is done when all that was in the object is in the container, or with `until` when that
    condition holds. A smaller tilt may leave a part in the object.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The held container, which is tilted.")
    into: ContainerName = Field(description="The receiving container.")
    tilt: Annotated[Angle, Field(gt=0, le=math.pi, description="How far to tilt [rad].")] = math.radians(120)
    dwell: Annotated[Pause, Field(ge=0, description="Time to stay tilted [s], at most 1 h; extended by `until`.")] = 1.0
    clearance: Annotated[Range, Field(description="Lip above the receiving rim [m].")] = (0.04, 0.12)
    aim: Length | None = Field(
        None,
        description="Where what is poured lands: beyond the centre of the receiving rim in the direction of the pour "
        "[m]; negative: before it. Default: the centre, or elsewhere at least 1 cm inside the rim.",
    )
    offset: Length = Field(
        0.0,
        description="How far the lip is before the centre of the receiving rim, against the direction of the pour [m]; "
        "negative: beyond it. The lip is then not aimed; at 0 it is.",
    )
    amount: Amount | None = Field(
        None,
        description="How much is poured: a number of bodies (`10`), a share (`50 %`) or a mass (`20 g`). The cup tilts "
        "slowly from 80 deg on, and back as soon as it has left. Default: all.",
    )
    velocity_scaling: VelocityScaling = Field(
        0.5, description="Share of the velocity, acceleration and jerk limits while carrying and tilting."
    )


def candidates(spec: PourSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Heights of the lip, directions of the hand, and both senses of the tilt."""
    planner.held(state, spec.object)
    planner.free_start(state)
    body = planner.scene.body(spec.object)
    X_TO = planner.held_in_tool(state)
    R_WT = _righted(planner.body_pose(state, spec.object).R) @ planner.tool_pose(state).R
    receiver = planner.scene.body(spec.into)
    X_WR = planner.body_pose(state, spec.into)
    mouth = X_WR.apply([receiver.centre[0], receiver.centre[1], receiver.centre[2] + receiver.size[2] / 2])

    contents = planner.contents(state, spec.object)
    portion = None if spec.amount is None else portion_of(spec.amount)
    most = None if portion is None else portion.number([planner.scene.body(name) for name in contents])
    poured = frozenset((name, spec.into) for name in contents)
    over = spec.tilt > math.pi / 2
    pouring = Pouring.of(planner, state, spec.object, spec.into) if over else None
    if pouring is not None and not spec.offset:
        _refuse_narrow(pouring)

    def attempt(clearance: float, yaw: float, sense: float) -> StepPlan:
        R_WT0 = matrix_from_axis_angle(UP, yaw) @ R_WT
        a = _horizontal_axis(R_WT0)
        theta, w = sense * spec.tilt, sense * np.cross(a, UP)
        R_tilt = matrix_from_axis_angle(a, theta)
        p_LT = -R_tilt @ (_lip(body, R_WT0 @ X_TO.R, w) + R_WT0 @ X_TO.p)

        def tilted(ahead: float, share: float) -> tuple[MotionBuilder, Stream | None]:
            """The motions up to the tilt with the lip `ahead` of the mouth, and where the contents land."""
            p_WT = mouth + clearance * UP + ahead * w + p_LT
            builder = MotionBuilder(planner, state, allowed=poured)
            carry(planner, builder, "carry", Transform.of(xyz=p_WT, R=R_WT0), speed=spec.velocity_scaling)
            upright, speed = builder.now, share * spec.velocity_scaling
            builder.turn("tilt", a, theta if portion is None else sense * STEEP, speed=speed)
            tilt = tilting(planner, upright, builder.plan(), sense * a)
            if portion is not None:
                steep = builder.now
                rate = float(np.max(np.gradient(tilt.angles, tilt.times)))
                builder.turn("dose", a, theta - sense * STEEP, speed=speed * min(1.0, DOSING / rate))
                tilt = tilt.then(tilting(planner, steep, builder.plan(), sense * a))
            return builder, None if pouring is None else pouring.landing(p_WT, R_WT0, w, tilt)

        builder, stream = _aimed(spec, tilted)
        builder.dwell("dwell", spec.dwell)
        if over:
            builder.spill(spec.into, most)
        try:
            if portion is None:
                builder.back("tilt back", emptied=over and bool(poured))
            else:
                builder.turn("tilt back", a, -theta, speed=spec.velocity_scaling)
        except NotPlannable as refusal:
            if not refusal.parts & frozenset(contents):
                raise
            raise refusal.but(hint="pour from higher, `clearance: ...`: what is poured out is in the way") from refusal
        planned = builder.plan()
        if not over:
            return planned
        if portion is not None:
            tilts = [replace(motion, pours=motion.label in POURING) for motion in planned.motions]
            planned = replace(planned, motions=tuple(tilts), portion=portion)
        return replace(planned, poured=contents, into=spec.into, stream=stream)

    ways = itertools.product(spread(spec.clearance), YAWS_DEG, _senses(planner, state, mouth, R_WT))
    options = [
        Candidate(
            partial(attempt, clearance, math.radians(yaw), sense),
            name=f"lip {readable(clearance, 'm')} above the rim, hand turned {yaw:g} deg, tilt {sense:+.0f}",
        )
        for clearance, yaw, sense in ways
    ]
    return Candidates(options, what=f"cannot pour from '{spec.object}' into '{spec.into}'")


def _aimed(
    spec: PourSpec, tilted: Callable[[float, float], tuple[MotionBuilder, Stream | None]]
) -> tuple[MotionBuilder, Stream | None]:
    """The motions up to the tilt, with the lip where the contents land within the opening.

    Raises:
        NotPlannable: wherever the lip is, and however slow the tilt, they may miss it.
    """
    ahead = -spec.offset
    slower = SLOWER if spec.amount is None else SLOWER[:1]
    builder, stream = tilted(ahead, 1.0)
    if stream is None or spec.offset:
        return builder, stream
    best = builder, stream
    for share in slower:
        for _ in range(ROUNDS):
            if _hits(spec, stream):
                return builder, stream
            ahead -= stream.beyond - (spec.aim or 0.0)
            builder, landed = tilted(ahead, share)
            if landed is None:
                break
            stream = replace(landed, moved=True)
            best = max(best, (builder, stream), key=lambda one: _merit(spec, one[1]))
    builder, stream = best
    if stream.margin >= 0.0:
        return builder, stream
    what = f"what leaves the rim may land {readable(-stream.margin, 'm')} outside '{spec.into}'"
    raise NotPlannable(
        f"{what}: it leaves at {stream.speed:.2f} m/s and its landing is uncertain by {readable(stream.spread, 'm')}",
        hint="pour from lower, `clearance: ...`, or into a wider container; `offset: ...` pours without an aim",
    )


def _hits(spec: PourSpec, stream: Stream) -> bool:
    """Whether the contents land well within the opening, and where the step says."""
    if spec.aim is None:
        return stream.margin >= ENOUGH
    return stream.margin >= 0.0 and abs(stream.beyond - spec.aim) <= EXACT


def _merit(spec: PourSpec, stream: Stream) -> float:
    """[m] Its margin, less how far it misses the aim of the step."""
    return stream.margin - (0.0 if spec.aim is None else abs(stream.beyond - spec.aim))


def _refuse_narrow(pouring: Pouring) -> None:
    """Raises NotPlannable if the opening has no room for the contents however they are aimed."""
    assert pouring.receiver.interior is not None  # see `Pouring.of`
    half = room(pouring.receiver.interior, np.zeros(3)) - PLACE_ERROR
    for body, _ in pouring.heights:
        wide = width(body) / 2.0
        if wide > half:
            lack = f"'{body.name}' is {readable(2.0 * wide, 'm')} wide, the opening of '{pouring.receiver.name}'"
            more = f"{readable(2.0 * (half + PLACE_ERROR), 'm')}; expected {readable(2.0 * PLACE_ERROR, 'm')} more"
            hint = "pour into a wider container; `offset: ...` pours without an aim"
            raise NotPlannable(f"cannot pour into '{pouring.receiver.name}': {lack} {more} than that", hint=hint)


def _horizontal_axis(R_WT: Array) -> Array:
    """The first horizontal axis of the tool, z first: the axis of the last joint on most arms."""
    for axis in (R_WT[:, 2], R_WT[:, 0], R_WT[:, 1]):
        if abs(axis[2]) < math.sin(math.radians(10.0)):
            flat = np.array([axis[0], axis[1], 0.0])
            return np.asarray(flat / np.linalg.norm(flat))
    raise NotPlannable("no tool axis is horizontal, so the cup cannot be tilted about it")


def _senses(planner: Planner, state: PlanningState, mouth: Array, R_WT: Array) -> tuple[float, float]:
    """Both senses of rotation; tipping towards the receiver first."""
    w = np.cross(_horizontal_axis(R_WT), UP)
    towards = mouth - planner.tool_pose(state).p
    sense = 1.0 if float(towards @ w) >= 0.0 else -1.0
    return (sense, -sense)


def _lip(body: Body, R_WO: Array, w: Array) -> Array:
    """From O to the lip (3,), in the world, of the upright cup that will tip towards the unit vector `w`."""
    rim = R_WO @ np.array([body.centre[0], body.centre[1], body.centre[2] + body.size[2] / 2])
    radius = float(max(body.size[0], body.size[1]) / 2)
    return np.asarray(rim + radius * w)


def _righted(R_WO: Array) -> Array:
    """The smallest rotation (3, 3), in the world, that makes a tilted cup upright."""
    axis = np.cross(R_WO[:, 2], UP)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    return matrix_from_axis_angle(axis / sine, math.atan2(sine, float(R_WO[2, 2])))


def check(spec: PourSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown bodies, a body poured into itself, a lip or an aim that is not over the container, or both of these."""
    if spec.object == spec.into:
        return (Problem(loc=("into",), message=f"'{spec.object}' cannot be poured into itself"),)
    found = unknown_body(scene, spec.object, ("object",), movable=True, carried=True) + unknown_body(
        scene, spec.into, ("into",)
    )
    if found:
        return found
    if spec.aim is not None and spec.offset:
        hint = "remove `offset`: the lip is placed by the aim"
        return (Problem(loc=("offset",), message="`aim` and `offset` cannot both be given", hint=hint),)
    if spec.amount is not None and spec.tilt <= math.pi / 2:
        message = f"`amount` needs a tilt of more than 90 deg, not {readable(spec.tilt, 'rad')}"
        return (Problem(loc=("amount",), message=message, hint="write `tilt: 120 deg`: it stops earlier"),)
    reach = float(max(scene.body(spec.into).size[:2]) / 2)
    hint = f"'{spec.into}' reaches {readable(reach, 'm')} from its centre"
    for key, what, away in (("offset", "the lip", spec.offset), ("aim", "the aim", spec.aim or 0.0)):
        if abs(away) >= reach:
            message = f"{what} is {readable(abs(away), 'm')} from the centre of '{spec.into}', outside its rim"
            return (Problem(loc=(key,), message=message, hint=hint),)
    return ()


def uncommanded(spec: PourSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool without a controller."""
    return unmoved_tool(claims, robot, ("object",))


def clause(spec: PourSpec, robot: RobotModel) -> str:
    offset = f" and {_beside(-spec.offset)}" if spec.offset else ""
    aim = f", to land {_beside(spec.aim)}" if spec.aim else ""
    much = "" if spec.amount is None else f"{portion_of(spec.amount).text} "
    until = "" if spec.amount is None else ", or until as much has left"
    tilt = f"tilt it by {amount(spec.tilt, 'rad')}{until}"
    return (
        f"pour {much}from {named(spec.object)} into {named(spec.into)}: hold the lip {between(spec.clearance, 'm')} "
        f"above its rim{offset}{aim}, {tilt}, wait {amount(spec.dwell, 's')}, and "
        f"tilt it back{at_share(spec.velocity_scaling, 0.5)}"
    )


def _beside(beyond: float) -> str:
    return f"{amount(abs(beyond), 'm')} {'before' if beyond < 0.0 else 'beyond'} its centre"


MEMBER = StepMember(
    name="pour", spec=PourSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause
)
