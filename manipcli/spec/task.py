"""Spec of a task file: robot, controllers, scene, steps and expectations.

`steps`, `until` and `expect` hold members of seams; `unions` builds their unions from the registry, so this module
imports no member. A step is a mapping with exactly one verb key and the common keys of `StepSpec`.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Final, Literal, get_args

from pydantic import AfterValidator, Field, field_validator, model_validator

from manipcli.core.text import escape
from manipcli.spec.agree import AgreeSpec
from manipcli.spec.base import Model, problem
from manipcli.spec.baseline import BaselineSpec
from manipcli.spec.clearance import ClearanceSpec, PartPair
from manipcli.spec.condition import ID, ID_HINT, ConditionSpec, ExpectationSpec, KeyedSpec, WatchSpec
from manipcli.spec.expression import NAME as PARAM
from manipcli.spec.keep import Keeps
from manipcli.spec.plan import PlanSpec
from manipcli.spec.planner import PlannerSpec
from manipcli.spec.quantity import Frequency, Length, Mass, Pause, Turn
from manipcli.spec.reactions import OnFail, ReplanSpec, RetrySpec
from manipcli.spec.robot import PoseSpec, Vector3, Version
from manipcli.spec.simulation import SimulationSpec
from manipcli.spec.vary import VarySpec

__all__ = [
    "BodySpec", "BoxSpec", "CupSpec", "CylinderSpec", "Fraction", "FrameSpec", "MeshSpec", "RatesSpec",
    "RecordSpec", "Size", "SphereSpec", "StepSpec", "TaskSpec", "TraySpec", "UrdfSpec", "Vector3",
]  # fmt: skip

Fraction = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[Length, Field(ge=1e-6, le=100.0)]


class BoxSpec(Model):
    """A solid box; its frame is at its centre."""

    size: tuple[Size, Size, Size] = Field(description="Full lengths along x, y, z [m], 1 um to 100 m.")


class SphereSpec(Model):
    """A solid sphere; its frame is at its centre."""

    radius: Size = Field(description="Radius [m], 1 um to 100 m.")


class CylinderSpec(Model):
    """A solid upright cylinder; its frame is in the middle of its bottom."""

    radius: Size = Field(description="Radius [m], 1 um to 100 m.")
    height: Size = Field(description="Height [m], 1 um to 100 m.")


class CupSpec(Model):
    """An open cup: a floor disc and a ring of `segments` wall boxes; its frame is in the middle of its bottom."""

    radius: Size = Field(description="Outer radius [m], 1 um to 100 m.")
    height: Size = Field(description="Outer height [m], 1 um to 100 m.")
    wall: Size = Field(0.004, description="Thickness of wall and floor [m], 1 um to 100 m. Default 4 mm.")
    segments: Annotated[int, Field(ge=6, le=64, description="Wall boxes, 6 to 64. Default 16.")] = 16


class TraySpec(Model):
    """An open tray: floor and four walls; its frame is in the middle of its bottom."""

    size: tuple[Size, Size, Size] = Field(description="Outer lengths along x, y, z [m], 1 um to 100 m.")
    wall: Size = Field(0.005, description="Thickness of walls and floor [m], 1 um to 100 m. Default 5 mm.")


MeshCollision = Literal["hull", "parts"]
"""The shape for contact of a mesh: its convex hull, or convex parts of it."""
_COLLISION: Final = (
    "Shape of a mesh for contact: `hull`, its convex hull; `parts`, its convex parts, so that a bowl is hollow (needs "
    "`manipcli[coacd]`). Default: `hull` for a mesh that fills at least 90 % of its hull, else `parts`."
)


class MeshSpec(Model):
    """A mesh file (STL, OBJ, Collada); for contact it is its convex hull or convex parts."""

    file: str = Field(description="Path, relative to this file, or `package://NAME/...`.")
    scale: Annotated[float, Field(ge=1e-6, le=1e6, description="Factor on all three axes, 1e-6 to 1e6. Default 1.")] = (
        1.0
    )
    collision: MeshCollision | None = Field(None, description=_COLLISION)


class UrdfSpec(Model):
    """A single-link URDF file as an object."""

    file: str = Field(description="Path, relative to this file, or `package://NAME/...`.")
    collision: MeshCollision | None = Field(None, description=_COLLISION)


class BodySpec(Model):
    """A body of the scene: exactly one shape key, one placement, and contact parameters.

    Placement: `pose` (world), or `rests_on: BODY` with `at: [x, y]` (world; yaw by `yaw`), or `inside: CONTAINER`, in
    its middle or offset from it by `at: [x, y]`.
    """

    box: BoxSpec | None = Field(None, description="Shape: a solid box.")
    sphere: SphereSpec | None = Field(None, description="Shape: a solid sphere.")
    cylinder: CylinderSpec | None = Field(None, description="Shape: a solid upright cylinder.")
    cup: CupSpec | None = Field(None, description="Shape: an open cup.")
    tray: TraySpec | None = Field(None, description="Shape: an open tray.")
    mesh: MeshSpec | None = Field(None, description="Shape: a mesh file.")
    urdf: UrdfSpec | None = Field(None, description="Shape, mass and inertia from a single-link URDF.")
    pose: PoseSpec | None = Field(None, description="Start pose of its frame in the world.")
    rests_on: str | None = Field(
        None, description="The body it rests on, which must not be tilted; `at` gives the position."
    )
    at: tuple[Length, Length] | None = Field(
        None,
        description="x, y [m]. With `rests_on`, which needs it: in the world. With `inside`: from the middle of the "
        "container, along its axes.",
    )
    yaw: Turn = Field(
        0.0, description="Rotation about the world's z axis [rad]; with `inside`, the container's. Default 0."
    )
    inside: str | None = Field(None, description="The container on whose floor it lies; it must not be tilted.")
    fixed: bool = Field(
        False, description="Whether it never moves; a movable body is at most 10 m long. Default false."
    )
    mass: Annotated[Mass, Field(gt=0, le=1e5)] | None = Field(
        None, description="Mass [kg], above 0 to 100 t; required unless `fixed` or `urdf`."
    )
    friction: Annotated[float, Field(ge=0)] = Field(
        0.8,
        description="Sliding friction coefficient, 0 or more; the engine multiplies it by the other body's. "
        "Default 0.8.",
    )
    rolling_friction: Annotated[
        float, Field(ge=0, description="Rolling friction coefficient, 0 or more. Default 0.")
    ] = 0.0
    spinning_friction: Annotated[
        float, Field(ge=0, description="Spinning friction coefficient, 0 or more. Default 0.")
    ] = 0.0
    restitution: Fraction = Field(
        0.0, description="Coefficient of restitution, 0 to 1; the engine multiplies it by the other body's. Default 0."
    )
    color: tuple[Fraction, Fraction, Fraction, Fraction] | None = Field(
        None, description="Red, green, blue, opacity, each 0 to 1; only for pictures."
    )


class FrameSpec(Model):
    """A named frame, fixed in `parent`: `world` or a body of the scene."""

    parent: str = Field("world", description="`world` or a body. Default `world`.")
    pose: PoseSpec = Field(PoseSpec(), description="Pose of the frame in its parent. Default: identity.")


Rate = Annotated[Frequency, Field(gt=0)]
SLOWEST: Final = 20.0
"""Lowest rate [Hz] at which the end of a run can be judged."""


class RatesSpec(Model):
    """Recording rates of topics [Hz]: the control rate divided by a whole number."""

    joint_states: Rate | None = Field(None, description="Measured joints [Hz], 20 or more. Default: the control rate.")
    tf: Rate | None = Field(None, description="Links and bodies [Hz], 20 or more. Default: the control rate.")
    controller_state: Rate | None = Field(
        None, description="State of every controller [Hz], 20 or more. Default: the control rate."
    )
    reference: Rate | None = Field(None, description="Reference of every controller, for plots [Hz]. Default 100 Hz.")
    error: Rate | None = Field(None, description="Error of every controller, for plots [Hz]. Default 100 Hz.")
    actuator_states: Rate | None = Field(
        None, description="Actuators, behind the transmissions [Hz]; efforts at the gears. Default 100 Hz."
    )
    wrench: Rate | None = Field(None, description="Wrench of every force sensor [Hz]. Default: the control rate.")

    @property
    def given(self) -> dict[str, float]:
        """Rates that are set, by topic."""
        rates = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: rate for name, rate in rates.items() if rate is not None}


ChosenTopic = Literal[
    "joint_states", "tf", "controller_state", "reference", "error", "actuator_states", "wrench", "contacts", "goals"
]
"""Optional topics; `goals` are the action topics of the controllers."""
JUDGED: Final = ("joint_states", "tf", "controller_state")
"""Topics that the judge reads together, at the ticks at which all of them are recorded."""


class RecordSpec(Model):
    """Recorded topics and their rates. Small topics, one-time messages and joint states are always recorded."""

    rates: RatesSpec = Field(RatesSpec(), description="How often topics are recorded.")
    topics: tuple[ChosenTopic, ...] | None = Field(
        None, description="The optional topics to record; `joint_states` is always recorded. Default: all."
    )

    @model_validator(mode="after")
    def _consistent(self) -> RecordSpec:
        for name, rate in self.rates.given.items():
            if name in self.left_out:
                raise problem("conflict", f"'{name}' has a rate, but is not among `topics`", at=("rates", name))
            if name in JUDGED and rate < SLOWEST:
                message = f"'{name}' is recorded at {rate:g} Hz; judging needs at least {SLOWEST:g} Hz"
                raise problem("conflict", message, at=("rates", name), hint=f"record it at {SLOWEST:g} Hz or more")
        return self

    def strides(self, period: float) -> dict[str, int]:
        """Control ticks of `period` [s] between two messages of each topic with a rate."""
        return {name: max(1, round(1.0 / (rate * period))) for name, rate in self.rates.given.items()}

    @property
    def left_out(self) -> frozenset[str]:
        """Topics that are not recorded."""
        return frozenset() if self.topics is None else frozenset(get_args(ChosenTopic)) - {*self.topics, "joint_states"}


TAG: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NAME = re.compile(r"\w(?:[\w .+-]{0,98}[\w+-])?")


class StepSpec(KeyedSpec):
    """Common keys of every step. `body` is the validated block under the verb."""

    id: str | None = Field(None, description="Names the step in logs and reports. Default: the verb and a number.")
    until: ConditionSpec | None = Field(
        None,
        description="Condition that the step waits for after its motion (`pour`: in its dwell; a `guarded` `move`: "
        "also during the motion), for 30 s or until its `timeout`.",
    )
    timeout: Annotated[Pause, Field(gt=0)] | None = Field(
        None, description="Time after which the step fails [s], above 0 to 1 h."
    )
    keep: Keeps = Field(
        (),
        description="Constraints on the step's motions, one mapping or a list: `keep: {upright: 10 deg, tool_speed: "
        "0.25}`. A path that keeps them is searched; checked at every tick of the plan, not of the run.",
    )
    allow: tuple[PartPair, ...] = Field(
        (),
        description="Pairs of parts that may touch in this step: `[[robot/palm, shelf], [cup, tray]]`; a part is a "
        "body, `robot/LINK`, or `robot` for each of its links.",
    )
    on_fail: OnFail = Field(
        "stop",
        description="After a failure: `stop` ends the run, `continue` goes on (the failure has no effect on the "
        "verdict), `{retry: n, with: {param: value}}` re-plans and retries the step. Default `stop`.",
    )

    @property
    def retry(self) -> RetrySpec | None:
        """How the step is retried; None if it is not."""
        return self.on_fail if isinstance(self.on_fail, RetrySpec) else None

    @property
    def may_fail(self) -> bool:
        """Whether the run goes on after the last attempt failed."""
        return (self.on_fail if self.retry is None else self.retry.then) == "continue"

    @property
    def verb(self) -> str:
        """Verb of the step."""
        return self.word

    @field_validator("id", mode="after")
    @classmethod
    def _id(cls, own: str | None) -> str | None:
        if own is not None and not ID.fullmatch(own):
            raise problem("conflict", f"'{own}' is not a valid id", hint=ID_HINT)
        return own


def _usable(name: str) -> str:
    if not PARAM.fullmatch(name):
        hint = "use letters, digits and '_'; begin with a letter from a to z or '_'"
        raise problem("conflict", f"'{escape(name)}' is not a valid parameter name", key=True, hint=hint)
    return name


ParamName = Annotated[str, AfterValidator(_usable)]


class TaskSpec(Model):
    """A task: robot, controllers, scene, steps and expectations."""

    # `unions.task_model` replaces `steps`, `expect` and `watch` by unions of the registered members.
    task: str = Field(description="The name of the task and of its log.", min_length=1)
    version: Version = None
    robot: str = Field(description="Path of the robot file, relative to this file.", min_length=1)
    controllers: str = Field(description="Path of the controllers file, relative to this file.", min_length=1)
    description: str = Field("", description="Purpose of the task, in words.")
    tags: tuple[str, ...] = Field((), description="Words that select it among tests: `-k slow`; markers in pytest.")
    params: dict[ParamName, bool | int | float | str] = Field(
        {}, description="Values for `$name` anywhere below, also in arithmetic: `2 * $tilt + 5 deg`."
    )
    simulation: SimulationSpec = Field(SimulationSpec(), description="Engine and clock.")
    planner: PlannerSpec = Field(PlannerSpec(), description="Search for paths. Default: `rrt_connect`.")
    record: RecordSpec = Field(RecordSpec(), description="Recorded topics and their rates.")
    floor: bool = Field(True, description="Whether there is a floor at z = 0. Default true.")
    scene: dict[str, BodySpec] = Field({}, description="The bodies, by name.")
    frames: dict[str, FrameSpec] = Field({}, description="Named frames, for poses to refer to.")
    start: str | None = Field(
        None,
        description="Named pose in which the robot starts. Default: `home` if the robot has it; else every joint at 0, "
        "or at the limit nearest to 0.",
    )
    replan: bool | ReplanSpec = Field(
        True,
        description="Whether a step is re-planned when its measured start differs from the planned one, and the "
        "tolerances of that comparison. Default true.",
    )
    clearance: ClearanceSpec = Field(
        ClearanceSpec(), description="The distance that planned motions keep between parts that must not touch."
    )
    vary: dict[str, VarySpec] = Field(
        {},
        description="Values that `--sample N` draws, by path as for `--set`; `*` matches every name: "
        "`scene.cup.at: {offset: {uniform: [-2 cm, 2 cm]}}`.",
    )
    baseline: BaselineSpec = Field(BaselineSpec(), description="Allowed changes relative to the blessed baseline.")
    plan: PlanSpec = Field(PlanSpec(), description="How the plan is chosen.")
    agree: AgreeSpec = Field(AgreeSpec(), description="Allowed differences between the runs of several engines.")
    steps: tuple[StepSpec, ...] = Field(min_length=1, description="What to do, in order; one verb per step.")
    expect: tuple[ExpectationSpec, ...] = Field(
        (), description="What must hold: at the end, at all times, or in a step."
    )
    watch: tuple[WatchSpec, ...] = Field(
        (),
        description="Conditions that stop the robot and end the run when violated: `never` or `always`, at all times "
        "or `during` steps.",
    )

    @property
    def judged(self) -> tuple[ExpectationSpec, ...]:
        """Everything judged from the recording: expectations, then watches."""
        return (*self.expect, *self.watch)

    @property
    def judged_at(self) -> tuple[tuple[str, int], ...]:
        """Location in the file of each of `judged`."""
        return tuple((key, k) for key in ("expect", "watch") for k in range(len(getattr(self, key))))

    @model_validator(mode="after")
    def _recordable(self) -> TaskSpec:
        """Checks that every rate divides the control rate, and that the judged topics coincide often enough."""
        period = self.simulation.control_period
        strides = self.record.strides(period)
        for name, rate in self.record.rates.given.items():
            ticks = 1.0 / (rate * period)
            if abs(ticks - strides[name]) > 1e-6 * ticks:
                most = 1.0 / period
                message = f"{rate:g} Hz does not divide the control rate, {most:g} Hz"
                strides_near = range(max(1, int(ticks / 2)), int(2 * ticks) + 2)
                plain = [most / n for n in strides_near if abs(most / n - round(most / n, 3)) < 1e-9 * most]
                near = min(plain or [most / max(1, round(ticks))], key=lambda choice: abs(choice - rate))
                hint = f"write '{near:.10g} Hz'" + (", the control rate" if near == most else "")
                raise problem("conflict", message, at=("record", "rates", name), hint=hint)
        common = math.lcm(*(strides.get(name, 1) for name in JUDGED if name not in self.record.left_out))
        if common * period > 1.0 / SLOWEST + 1e-9:
            message = f"these rates coincide every {common * period:g} s; judging needs {1.0 / SLOWEST:g} s or less"
            raise problem("conflict", message, at=("record", "rates"), hint="choose rates that divide each other")
        return self

    @field_validator("tags", mode="after")
    @classmethod
    def _words(cls, tags: tuple[str, ...]) -> tuple[str, ...]:
        """Checks that each tag is a valid pytest marker."""
        for k, tag in enumerate(tags):
            if not TAG.fullmatch(tag):
                hint = "use letters, digits and '_'; begin with a letter"
                raise problem("conflict", f"{tag[:100]!r} is not a valid tag", at=(k,), hint=hint)
        return tags

    @field_validator("task", mode="after")
    @classmethod
    def _file_name(cls, name: str) -> str:
        """Checks that the name is a valid file name on every system, without a folder."""
        if not _NAME.fullmatch(name):
            hint = "use at most 100 letters, digits, '_', '-', '+', '.' and inner spaces"
            raise problem("conflict", f"{name[:100]!r} is not a valid task name: it names the log file", hint=hint)
        return name

    @field_validator("steps", mode="after")
    @classmethod
    def _named(cls, steps: tuple[StepSpec, ...]) -> tuple[StepSpec, ...]:
        """Gives every step an id: its own, or its verb and the next free number."""
        given = {step.id for step in steps}
        counts: dict[str, int] = {}
        named: list[StepSpec] = []
        for step in steps:
            number = counts.get(step.verb, 0) + 1
            while step.id is None and f"{step.verb}_{number}" in given:
                number += 1
            counts[step.verb] = number
            named.append(step if step.id else step.model_copy(update={"id": f"{step.verb}_{number}"}))
        return tuple(named)
