"""`insert`: put a held peg into a hole, and search for the hole where it is not found at once.

    - insert: {object: peg, into: socket, force: 15 N}
    - insert: {object: plug, into: block/hole, depth: 20 mm, search: 5 mm}

The peg is held upright above the believed hole and lowered until it is felt. If it has not dropped in, it slides along
a spiral, pressed on with a fifth of the force, until it does: see `plan.spiral`. It then goes down with the force. The
arm is soft across the hole, about the tip of the peg, so that the walls guide it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Final

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.prose import amount, between, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.arm_force import refuse_too_strong
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.carrying import carry
from manipcli.plan.claimed_joints import Claims, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.compliance import Beyond, Compliance, Pressing, compliant
from manipcli.plan.contact_line import approach_speed, effective_mass
from manipcli.plan.motion import Insertion, PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.peg_fit import Fit, best_yaws, deep, fit, section, upright
from manipcli.plan.place_goals import UPRIGHT
from manipcli.plan.planner import Planner
from manipcli.plan.ranges import Range, spread
from manipcli.plan.search_motion import search_motion
from manipcli.plan.spiral import pitch_of
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.names import ContainerName, MovableName
from manipcli.spec.quantity import Force, Length

SUNK: Final = 0.006
"""[m] A hand that is this much lower than at the rim has found the hole: more than the peg slips in it."""
DROP: Final = 0.0008
"""[m] A peg that drops by this while it slides has found the hole."""
SEARCHING: Final = 0.2
"""Share of the force with which the peg is pressed on while it slides."""
FIRM: Final = 1500.0
"""[N/m] Stiffness across the hole while it slides: friction holds it back by less than a millimetre, and a peg that
has dropped into the hole is not torn out before that is noticed."""
SOFT: Final = 400.0
"""[N/m] Stiffness across the hole on the way down."""
ALONG: Final = 1000.0
"""[N/m] Stiffness along the hole."""
LOWERING: Final = 0.01
"""[m/s] Of the reference, on the way down."""
GUIDED: Final = 0.01
"""Share of the velocity limits with which the plan goes down besides: faster, it knocks at the floor of the hole."""
IMPACT: Final = 1.3
"""Force of the first contact, at most, per force with which it slides."""
FELT: Final = 0.2
"""[s] For which a force is felt."""
KNOWN: Final = 0.002
"""[m] Least radius of the search: grasps and arms are not exact."""


class InsertSpec(Model):
    """Put a held peg into a hole, with its axis upright; where it does not drop in at once, it searches for the hole.

    The hole is the hollow of a container that is open upwards. The peg goes in with the end that is down. The arm
    yields like a spring; no controllers file is needed for it. The hole is found by what is felt, so that the believed
    place of the hole may be wrong by the radius of the search.

    It is done when the end of the peg is measured to be within 1 mm of `depth`, and the hand still holds the peg:
    `release` lets it go.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The held peg.")
    into: ContainerName = Field(description="The container whose hollow is the hole.")
    force: Annotated[Force, Field(gt=0, le=1e4)] = Field(
        15.0,
        description="Force of the tool along the hole [N], above 0; it slides with a fifth. Impacts may exceed it for "
        "a moment; the most that was felt is reported. Default 15 N.",
    )
    depth: Annotated[Length, Field(ge=0.001, le=1.0)] | None = Field(
        None,
        description="How deep the end of the peg goes, from the rim [m], 1 mm or more. Default: to the floor.",
    )
    search: Annotated[Length, Field(ge=0, le=0.1)] | None = Field(
        None, description="Radius of the spiral [m]; 0: none. Default: how well the hole is `known`, and 2 mm more."
    )
    clearance: Annotated[Range, Field(description="Height above the rim from which it is lowered [m].")] = (0.003, 0.02)
    velocity_scaling: VelocityScaling = Field(
        0.5, description="Share of the velocity, acceleration and jerk limits while carrying."
    )


def candidates(spec: InsertSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Rotations of the peg about the hole, and heights from which it is lowered."""
    planner.held(state, spec.object)
    planner.free_start(state)
    interior = planner.scene.body(spec.into).interior
    assert interior is not None  # refused by `check`
    X_WS = planner.body_pose(state, spec.into) @ interior.X_OS
    if X_WS.R[2, 2] < UPRIGHT:
        raise NotPlannable(f"'{spec.into}' is tilted; expected a hole that is open upwards", loc=("into",))
    X_WO = planner.body_pose(state, spec.object)
    if X_WO.R[2, 2] < UPRIGHT:
        raise NotPlannable(f"'{spec.object}' is not held upright", hint="grasp it as it stands, and keep it upright")
    peg = section(planner.scene.body(spec.object), spec.depth or deep(interior))
    now = (X_WS.inverse() @ X_WO).rpy[2]

    def way(yaw: float, high: float) -> Candidate:
        above, fitted = upright(peg, X_WS, interior.rim + high, yaw), fit(peg, interior, yaw)
        name = f"from {readable(high, 'm')} above, at a yaw of {math.degrees(yaw):.0f} deg"
        return Candidate(partial(_attempt, spec, planner, state, X_WS, above, fitted, high), name=name)

    ways = itertools.product(best_yaws(peg, interior, now), sorted(spread(spec.clearance)))
    return Candidates([way(*one) for one in ways], what=f"cannot insert '{spec.object}' into '{spec.into}'")


def _attempt(
    spec: InsertSpec, planner: Planner, state: PlanningState, X_WS: Transform, X_WO: Transform, fitted: Fit, high: float
) -> StepPlan:
    """Carry it above the hole at X_WO, `high` [m] above the rim, lower it, search, and press it in."""
    down, depth = -X_WS.R[:, 2], spec.depth or fitted.depth
    X_WT = X_WO @ planner.held_in_tool(state).inverse()
    builder = MotionBuilder(planner, state, allowed=frozenset({(spec.object, spec.into)}))
    carry(planner, builder, "carry", X_WT, speed=spec.velocity_scaling)
    q = builder.now.position
    refuse_too_strong(planner, q, down, spec.force)
    light = SEARCHING * spec.force
    slow = min(approach_speed(IMPACT * light, effective_mass(planner, q, down), planner.period), LOWERING)

    tip = _tip(planner, X_WO, spec.object)
    turned = X_WS.R @ np.diag([1.0, -1.0, -1.0])  # z down, along the hole
    X_TC = X_WT.inverse() @ Transform.of(xyz=tip, R=turned)
    rim = float(down @ tip) + high

    def law(
        force: float, speed: float, across: float, deep: float, otherwise: str = "", hold: float | None = FELT
    ) -> Compliance:
        pressing = Pressing(frozen([0.0, 0.0, 1.0]), force, speed, high + depth, hold=hold, yields=True)
        until = Beyond(frozen(down), rim + deep, DROP if otherwise else None, otherwise=otherwise)
        spring = Compliance.of(along=ALONG, across=across, force=pressing, X_TC=X_TC)
        return replace(spring, until=until, relative=True)

    with compliant(builder, law(light, slow, FIRM, SUNK)):
        builder.dwell("touch", high / slow + FELT)
    radius = _radius(spec, planner)
    if radius > fitted.clearance:
        none = f"no hole was found within {readable(radius, 'm')} of where '{spec.into}' is believed to be"
        with compliant(builder, law(light, LOWERING, FIRM, SUNK, none, hold=None)):
            search_motion(builder, planner, X_WT, X_WS.R, pitch_of(fitted.clearance), radius)
    X_WE = Transform.of(xyz=(high + depth) * down) @ X_WT
    with compliant(builder, law(spec.force, LOWERING, SOFT, depth if spec.depth else depth + SUNK)):
        builder.straight("insert", X_WE, speed=GUIDED * spec.velocity_scaling)
    with compliant(builder, replace(Compliance.of(along=ALONG, across=SOFT, X_TC=X_TC), here=True)):
        builder.dwell("rest", FELT)
    motions = tuple(replace(motion, awaits=False) for motion in builder.plan().motions)
    planned = Insertion(spec.object, spec.into, depth, fitted.clearance, radius)
    return StepPlan(motions, builder.now, inserted=planned)


def _tip(planner: Planner, X_WO: Transform, name: str) -> Array:
    """(3,) the middle of the lower end of the peg in the world."""
    body = planner.scene.body(name)
    return X_WO.apply([body.centre[0], body.centre[1], body.centre[2] - body.size[2] / 2.0])


def _radius(spec: InsertSpec, planner: Planner) -> float:
    """[m] of the search."""
    if spec.search is not None:
        return spec.search
    known = planner.scene.body(spec.into).known
    if known is None:
        return KNOWN
    return KNOWN + (known.radius if known.radius is not None else float(np.hypot(*known.half[:2])))


def check(spec: InsertSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown bodies, a hole without a hollow, and a peg that does not fit."""
    found = unknown_body(scene, spec.object, ("object",), movable=True) + unknown_body(scene, spec.into, ("into",))
    if found:
        return found
    if spec.object == spec.into:
        return (Problem(("into",), f"'{spec.object}' cannot be inserted into itself", "name another body"),)
    peg, hole = scene.body(spec.object), scene.body(spec.into)
    if hole.interior is None:
        hollow = [body.name for body in scene.bodies if body.interior is not None and body.name != peg.name]
        hint = f"containers here: {', '.join(hollow)}" if hollow else "a `cup` or `tray` with a thick wall is a socket"
        return (Problem(("into",), f"'{hole.name}' is a {hole.kind} and has no hollow", hint, "TASK350"),)
    depth = deep(hole.interior)
    if spec.depth is not None and spec.depth > depth + 1e-9:
        message = f"'{hole.name}' is {readable(depth, 'm')} deep; expected a depth of at most that"
        return (Problem(("depth",), message, "leave `depth` out to go to its floor", "TASK352"),)
    if not peg.geometries:
        return ()  # its description is wrong, which is another finding
    entering = section(peg, spec.depth or depth)
    fitted = max((fit(entering, hole.interior, yaw) for yaw in (0.0, math.pi / 2.0)), key=lambda each: each.clearance)
    if fitted.clearance <= 0.0:
        wide, room = readable(fitted.wide, "m"), readable(fitted.room, "m")
        message = f"'{peg.name}' is {wide} wide, the hole of '{hole.name}' only {room}"
        return (Problem(("object",), message, "use a thinner peg or a wider hole", "TASK351"),)
    return ()


def uncommanded(spec: InsertSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool without a controller."""
    return unmoved_tool(claims, robot, ("object",))


def clause(spec: InsertSpec, robot: RobotModel) -> str:
    depth = "to its floor" if spec.depth is None else f"{amount(spec.depth, 'm')} deep"
    search = "" if spec.search is None else f", searching for it within {amount(spec.search, 'm')}"
    return (
        f"insert {named(spec.object)} into {named(spec.into)}, {depth}, with {amount(spec.force, 'N')}, "
        f"lowered from {between(spec.clearance, 'm')} above its rim{search}{at_share(spec.velocity_scaling, 0.5)}"
    )


MEMBER = StepMember(
    name="insert",
    spec=InsertSpec,
    candidates=candidates,
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    compliant=lambda _: True,
    part=lambda *_: "arm",
)
