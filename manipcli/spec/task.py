"""The task file: which robot and controllers, what stands around, what to do, what to expect.

`steps`, `until` and `expect` hold members of seams; the loader builds their unions from the registry, so this module
imports no member. A step is a mapping with exactly one verb key beside the common keys of `StepSpec`.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Final, Literal, get_args

from pydantic import AfterValidator, Field, field_validator, model_validator

from manipcli.core.text import escape
from manipcli.core.units import EARTH_GRAVITY
from manipcli.spec.base import Model, problem
from manipcli.spec.baseline import BaselineSpec
from manipcli.spec.condition import ID, ID_HINT, ConditionSpec, ExpectationSpec, KeyedSpec, WatchSpec
from manipcli.spec.expression import NAME as PARAM
from manipcli.spec.quantity import Acceleration, Frequency, Length, Mass, Pause, Time, Turn
from manipcli.spec.reactions import OnFail, ReplanSpec, RetrySpec
from manipcli.spec.robot import PoseSpec, Vector3, Version
from manipcli.spec.vary import VarySpec

__all__ = [
    "BodySpec", "BoxSpec", "CupSpec", "CylinderSpec", "Fraction", "FrameSpec", "MeshSpec", "RatesSpec",
    "RecordSpec", "SimulationSpec", "Size", "SphereSpec", "StepSpec", "TaskSpec", "TraySpec", "UrdfSpec", "Vector3",
]  # fmt: skip

Fraction = Annotated[float, Field(ge=0, le=1)]
Size = Annotated[Length, Field(ge=1e-6, le=100.0)]


class SimulationSpec(Model):
    """Engine and clock. `control_period` is a whole multiple of `step`; `settle` is simulated before the start."""

    engine: str = Field("pybullet", description="Which engine: `pybullet` (physics), `kinematic` (commands come true).")
    step: Annotated[Time, Field(ge=1e-6, le=0.02, description="Physics step, 1 us to 20 ms. Default 1 ms.")] = 0.001
    control_period: Annotated[
        Time, Field(gt=0, le=0.05, description="Control tick, a whole multiple of `step`, to 50 ms. Default 1 ms.")
    ] = 0.001
    seed: Annotated[int, Field(ge=0, description="Of the planner and of samples, 0 or more. Default 0.")] = 0
    gravity: tuple[Acceleration, Acceleration, Acceleration] = Field(
        EARTH_GRAVITY, description="Acceleration of free fall in the world [m/s^2]. Default [0, 0, -9.81]."
    )
    settle: Annotated[Time, Field(ge=0, le=60, description="Simulated before the start, 0 to 60 s. Default 0.5 s.")] = (
        0.5
    )

    @model_validator(mode="after")
    def _whole_steps(self) -> SimulationSpec:
        steps = self.control_period / self.step
        if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
            message = (
                f"control_period ({self.control_period:g} s) must be a whole multiple of step ({self.step:g} s), "
                f"not {steps:.6g} times"
            )
            below = max(1, round(steps)) * self.step
            raise problem("conflict", message, at=("control_period",), hint=f"write {below:g}, or change `step`")
        return self


class BoxSpec(Model):
    """A solid box; its frame is at its centre."""

    size: tuple[Size, Size, Size] = Field(description="Full lengths along x, y, z [m], 1 um to 100 m.")


class SphereSpec(Model):
    """A solid sphere; its frame is at its centre."""

    radius: Size = Field(description="[m], 1 um to 100 m.")


class CylinderSpec(Model):
    """A solid upright cylinder; its frame is in the middle of its bottom."""

    radius: Size = Field(description="[m], 1 um to 100 m.")
    height: Size = Field(description="[m], 1 um to 100 m.")


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


class MeshSpec(Model):
    """A mesh file (STL, OBJ, Collada), used as its convex hull; the engine makes one of each part of an OBJ."""

    file: str = Field(description="Path, relative to this file, or `package://NAME/...`.")
    scale: Annotated[float, Field(ge=1e-6, le=1e6, description="Factor on all three axes, 1e-6 to 1e6. Default 1.")] = (
        1.0
    )


class UrdfSpec(Model):
    """A single-link URDF file as an object."""

    file: str = Field(description="Path, relative to this file, or `package://NAME/...`.")


class BodySpec(Model):
    """One thing in the scene: exactly one shape key, one way to place it, and how it behaves in contact.

    Placement: `pose` (world), or `rests_on: BODY` with `at: [x, y]` (world; yaw by `yaw`), or `inside: CONTAINER`, in
    its middle or `at: [x, y]` from there.
    """

    box: BoxSpec | None = Field(None, description="Shape: a solid box.")
    sphere: SphereSpec | None = Field(None, description="Shape: a solid sphere.")
    cylinder: CylinderSpec | None = Field(None, description="Shape: a solid upright cylinder.")
    cup: CupSpec | None = Field(None, description="Shape: an open cup.")
    tray: TraySpec | None = Field(None, description="Shape: an open tray.")
    mesh: MeshSpec | None = Field(None, description="Shape: the convex hull of a mesh file.")
    urdf: UrdfSpec | None = Field(None, description="Shape, mass and inertia from a single-link URDF.")
    pose: PoseSpec | None = Field(None, description="Where its frame starts, in the world.")
    rests_on: str | None = Field(None, description="The body that it stands on, which is not tilted; `at` says where.")
    at: tuple[Length, Length] | None = Field(
        None,
        description="x, y [m]: of `rests_on`, which needs it, in the world; of `inside` from its middle, "
        "along its axes.",
    )
    yaw: Turn = Field(0.0, description="About the world's z axis [rad]; with `inside` from the container's. Default 0.")
    inside: str | None = Field(None, description="The container on whose floor it lies; one that is not tilted.")
    fixed: bool = Field(False, description="Never moves; what can is 10 m long at most. Default false.")
    mass: Annotated[Mass, Field(gt=0, le=1e5)] | None = Field(
        None, description="[kg], above 0 to 100 t; needed unless `fixed`, `urdf`."
    )
    friction: Annotated[float, Field(ge=0)] = Field(
        0.8,
        description="Coefficient of sliding, 0 or more; the engine multiplies it by the other body's. Default 0.8.",
    )
    rolling_friction: Annotated[float, Field(ge=0, description="Coefficient of rolling, 0 or more. Default 0.")] = 0.0
    spinning_friction: Annotated[float, Field(ge=0, description="Coefficient of turning on the spot. Default 0.")] = 0.0
    restitution: Fraction = Field(
        0.0, description="Bounce, 0 to 1; the engine multiplies it by the other body's. Default 0."
    )
    color: tuple[Fraction, Fraction, Fraction, Fraction] | None = Field(
        None, description="Red, green, blue, opacity, each 0 to 1; only for pictures."
    )


class FrameSpec(Model):
    """A named frame, fixed in `parent`: `world` or a body of the scene."""

    parent: str = Field("world", description="`world` or a body. Default `world`.")
    pose: PoseSpec = Field(PoseSpec(), description="Of the frame in its parent. Default: the parent's own.")


Rate = Annotated[Frequency, Field(gt=0)]
SLOWEST: Final = 20.0
"""[Hz] below which the end of a run could not be judged."""


class RatesSpec(Model):
    """How often topics are recorded [Hz]: the control rate, or a whole part of it."""

    joint_states: Rate | None = Field(None, description="Measured joints [Hz], 20 or more. Default: the control rate.")
    tf: Rate | None = Field(None, description="Links and bodies [Hz], 20 or more. Default: the control rate.")
    controller_state: Rate | None = Field(
        None, description="Of every controller [Hz], 20 or more. Default: the control rate."
    )
    reference: Rate | None = Field(None, description="Of every controller, for plots [Hz]. Default 100 Hz.")
    error: Rate | None = Field(None, description="Of every controller, for plots [Hz]. Default 100 Hz.")
    actuator_states: Rate | None = Field(
        None, description="Behind the transmissions [Hz]; efforts as they reach the gears. Default 100 Hz."
    )
    wrench: Rate | None = Field(None, description="Of every force sensor [Hz]. Default: the control rate.")

    @property
    def given(self) -> dict[str, float]:
        """Those that are not left to the default."""
        rates = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: rate for name, rate in rates.items() if rate is not None}


ChosenTopic = Literal[
    "joint_states", "tf", "controller_state", "reference", "error", "actuator_states", "wrench", "contacts", "goals"
]
"""Topics that a task may leave out; `goals` are the action topics of the controllers."""
JUDGED: Final = ("joint_states", "tf", "controller_state")
"""What the judge looks at together: at the ticks at which all of them are recorded."""


class RecordSpec(Model):
    """What the log holds, and how often. What is small, or happens once, is always there; so are the joints."""

    rates: RatesSpec = Field(RatesSpec(), description="How often topics are recorded.")
    topics: tuple[ChosenTopic, ...] | None = Field(
        None, description="Of these topics no others are recorded; `joint_states` always is. Default: all."
    )

    @model_validator(mode="after")
    def _consistent(self) -> RecordSpec:
        for name, rate in self.rates.given.items():
            if name in self.left_out:
                raise problem("conflict", f"'{name}' has a rate, but is not among `topics`", at=("rates", name))
            if name in JUDGED and rate < SLOWEST:
                message = f"'{name}' at {rate:g} Hz is too rare to judge the run by"
                raise problem("conflict", message, at=("rates", name), hint=f"record it at {SLOWEST:g} Hz at least")
        return self

    def strides(self, period: float) -> dict[str, int]:
        """Control ticks of `period` [s] between two messages of each topic with a rate."""
        return {name: max(1, round(1.0 / (rate * period))) for name, rate in self.rates.given.items()}

    @property
    def left_out(self) -> frozenset[str]:
        """What is not recorded."""
        return frozenset() if self.topics is None else frozenset(get_args(ChosenTopic)) - {*self.topics, "joint_states"}


TAG: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NAME = re.compile(r"\w(?:[\w .+-]{0,98}[\w+-])?")


class StepSpec(KeyedSpec):
    """What every step has beside its one verb key. `body` is the validated block under the verb."""

    id: str | None = Field(None, description="Names the step in logs and reports. Default: the verb and a number.")
    until: ConditionSpec | None = Field(
        None,
        description="What the step waits for when it has moved (`pour`: in its dwell; a `guarded` `move`: on its way, "
        "too), 30 s or until its `timeout`.",
    )
    timeout: Annotated[Pause, Field(gt=0)] | None = Field(
        None, description="Fails the step after this [s], above 0 to 1 h."
    )
    on_fail: OnFail = Field(
        "stop",
        description="After a failure: `stop` ends the run, `continue` goes on (the step does not count then), "
        "`{retry: n, with: {param: value}}` tries again. Default `stop`.",
    )

    @property
    def retry(self) -> RetrySpec | None:
        """How it is tried again, if it is."""
        return self.on_fail if isinstance(self.on_fail, RetrySpec) else None

    @property
    def may_fail(self) -> bool:
        """Whether the run goes on after the last attempt has failed."""
        return (self.on_fail if self.retry is None else self.retry.then) == "continue"

    @property
    def verb(self) -> str:
        """Which step this is."""
        return self.word

    @field_validator("id", mode="after")
    @classmethod
    def _id(cls, own: str | None) -> str | None:
        if own is not None and not ID.fullmatch(own):
            raise problem("conflict", f"'{own}' cannot be an id", hint=ID_HINT)
        return own


def _usable(name: str) -> str:
    if not PARAM.fullmatch(name):
        hint = "`$name` is letters, digits and '_', and begins with a letter from a to z or with '_'"
        raise problem("conflict", f"'{escape(name)}' cannot be the name of a parameter", key=True, hint=hint)
    return name


ParamName = Annotated[str, AfterValidator(_usable)]


class TaskSpec(Model):
    """A task: with which robot, where things stand, what to do, and what must come of it."""

    # The loader replaces `steps` and `expect` by the unions that the registries offer.
    task: str = Field(description="The name of the task; names its log.", min_length=1)
    version: Version = None
    robot: str = Field(description="Path of the robot file, relative to this file.", min_length=1)
    controllers: str = Field(description="Path of the controllers file, relative to this file.", min_length=1)
    description: str = Field("", description="What it is for, in words.")
    tags: tuple[str, ...] = Field((), description="Words that choose it among tests: `-k slow`; markers in pytest.")
    params: dict[ParamName, bool | int | float | str] = Field(
        {}, description="Values for `$name` anywhere below, also in arithmetic: `2 * $tilt + 5 deg`."
    )
    simulation: SimulationSpec = Field(SimulationSpec(), description="Engine and clock.")
    record: RecordSpec = Field(RecordSpec(), description="What the log holds, and how often.")
    floor: bool = Field(True, description="Whether there is a floor at z = 0. Default true.")
    scene: dict[str, BodySpec] = Field({}, description="The bodies, by name.")
    frames: dict[str, FrameSpec] = Field({}, description="Named frames, for poses to refer to.")
    start: str | None = Field(
        None,
        description="The named pose that the robot starts in. Default: `home` if it has one; else every joint at 0, or "
        "at the limit nearest to 0.",
    )
    replan: bool | ReplanSpec = Field(
        True,
        description="Whether a step is planned again where things are not as it was planned for, and from which "
        "difference on. Default true.",
    )
    vary: dict[str, VarySpec] = Field(
        {},
        description="What `--sample N` draws, by the path of a number as after `--set`; `*` for every name: "
        "`scene.cup.at: {offset: {uniform: [-2 cm, 2 cm]}}`.",
    )
    baseline: BaselineSpec = Field(BaselineSpec(), description="How much worse than its baseline a run may be.")
    steps: tuple[StepSpec, ...] = Field(min_length=1, description="What to do, in order; one verb a step.")
    expect: tuple[ExpectationSpec, ...] = Field((), description="What must hold: at the end, all the time, in a step.")
    watch: tuple[WatchSpec, ...] = Field(
        (),
        description="What stops the robot and ends the run where it is broken: `never` or `always`, all the time or "
        "`during` steps.",
    )

    @property
    def judged(self) -> tuple[ExpectationSpec, ...]:
        """What the recording is asked: what is expected, then what was watched."""
        return (*self.expect, *self.watch)

    @property
    def judged_at(self) -> tuple[tuple[str, int], ...]:
        """Where in the file each of `judged` stands."""
        return tuple((key, k) for key in ("expect", "watch") for k in range(len(getattr(self, key))))

    @model_validator(mode="after")
    def _recordable(self) -> TaskSpec:
        """Every rate is that of the control tick, or a whole part of it."""
        period = self.simulation.control_period
        strides = self.record.strides(period)
        for name, rate in self.record.rates.given.items():
            ticks = 1.0 / (rate * period)
            if abs(ticks - strides[name]) > 1e-6 * ticks:
                most = 1.0 / period
                message = f"{rate:g} Hz is no whole part of the control rate ({most:g} Hz)"
                strides_near = range(max(1, int(ticks / 2)), int(2 * ticks) + 2)
                plain = [most / n for n in strides_near if abs(most / n - round(most / n, 3)) < 1e-9 * most]
                near = min(plain or [most / max(1, round(ticks))], key=lambda one: abs(one - rate))
                hint = f"write '{near:.10g} Hz'" + (", the control rate" if near == most else "")
                raise problem("conflict", message, at=("record", "rates", name), hint=hint)
        common = math.lcm(*(strides.get(name, 1) for name in JUDGED if name not in self.record.left_out))
        if common * period > 1.0 / SLOWEST + 1e-9:
            message = f"these rates meet only every {common * period:g} s, too rarely to judge the run by"
            raise problem(
                "conflict", message, at=("record", "rates"), hint="choose rates of which one divides the other"
            )
        return self

    @field_validator("tags", mode="after")
    @classmethod
    def _words(cls, tags: tuple[str, ...]) -> tuple[str, ...]:
        """Each can be a marker of pytest."""
        for k, tag in enumerate(tags):
            if not TAG.fullmatch(tag):
                hint = "a tag is letters, digits and '_', and begins with a letter"
                raise problem("conflict", f"{tag[:100]!r} cannot be a tag", at=(k,), hint=hint)
        return tags

    @field_validator("task", mode="after")
    @classmethod
    def _file_name(cls, name: str) -> str:
        """The name is that of a file, too, on every system, and must not lead elsewhere."""
        if not _NAME.fullmatch(name):
            hint = "a task is called by letters, digits, '_', '-', '+', '.' and spaces inside, 100 at most"
            raise problem("conflict", f"{name[:100]!r} cannot be the name of a task: it names its log", hint=hint)
        return name

    @field_validator("steps", mode="after")
    @classmethod
    def _named(cls, steps: tuple[StepSpec, ...]) -> tuple[StepSpec, ...]:
        """Every step gets an id: its own, or its verb and the next free number."""
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
