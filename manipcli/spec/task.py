"""Spec of a task file: robot, controllers, scene, steps and expectations.

`steps`, `until` and `expect` hold members of seams; `unions` builds their unions from the registry, so this module
imports no member. A step is a mapping with exactly one verb key and the common keys of `StepSpec`.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, ClassVar, Final

from pydantic import AfterValidator, Field, StrictBool, field_validator, model_validator

from manipcli.core.text import escape
from manipcli.spec.agree import AgreeSpec
from manipcli.spec.base import Model, problem
from manipcli.spec.baseline import BaselineSpec
from manipcli.spec.block import BlockSpec
from manipcli.spec.clearance import ClearanceSpec
from manipcli.spec.condition import ExpectationSpec, WatchSpec
from manipcli.spec.expression import NAME as PARAM
from manipcli.spec.names import PoseName
from manipcli.spec.plan import PlanSpec
from manipcli.spec.planner import PlannerSpec
from manipcli.spec.quantity import Share
from manipcli.spec.reactions import ReplanSpec
from manipcli.spec.recording import JUDGED, SLOWEST, RecordSpec
from manipcli.spec.robot import Version
from manipcli.spec.scene import BodySpec, FrameSpec
from manipcli.spec.sensors import SensorName, SensorSpec
from manipcli.spec.simulation import SimulationSpec
from manipcli.spec.step import StepSpec
from manipcli.spec.vary import VarySpec

TAG: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NAME = re.compile(r"\w(?:[\w .+-]{0,98}[\w+-])?")


def _usable(name: str) -> str:
    if not PARAM.fullmatch(name):
        hint = "use letters, digits and '_'; begin with a letter from a to z or '_'"
        raise problem("conflict", f"'{escape(name)}' is not a valid parameter name", key=True, hint=hint)
    return name


ParamName = Annotated[str, AfterValidator(_usable)]


class TaskSpec(Model):
    """A task: robot, controllers, scene, steps and expectations."""

    verbs: ClassVar[tuple[str, ...]] = ()
    """Words of the members of `steps`; set by `unions.task_model`."""

    # `unions.task_model` replaces `steps`, `expect`, `watch` and `sensors` by unions of the registered members.
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
    sensors: dict[SensorName, SensorSpec] | None = Field(
        None, description="Sensors in the scene or on the robot, by name; in addition to those of the robot file."
    )
    start: PoseName | None = Field(
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
    sample: int | None = Field(
        None,
        ge=0,
        description="Sample of `vary` that a run uses without `--sample`. Default: none, the task as written.",
    )
    baseline: BaselineSpec = Field(BaselineSpec(), description="Allowed changes relative to the blessed baseline.")
    saturation: StrictBool | Annotated[Share, Field(gt=0, le=1)] = Field(
        True,
        description="Largest share of the ticks of a step in which a motor may be at its effort limit, for all joints "
        "but those of hands: more fails the run, as an expectation that is not written. `false`: not judged. "
        "Default true: 20 %.",
    )
    plan: PlanSpec = Field(PlanSpec(), description="How the plan is chosen.")
    agree: AgreeSpec = Field(AgreeSpec(), description="Allowed differences between the runs of several engines.")
    steps: tuple[StepSpec, ...] = Field(min_length=1, description="What to do, in order; one verb per step.")
    blocks: tuple[BlockSpec, ...] = Field((), exclude=True, description="Groups of `steps`; written by the loader.")
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
