"""One run of a task in one engine, in numbers: what `agreement` compares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from manipcli.core.errors import Loc, Place
from manipcli.judge.verdict import Verdict
from manipcli.spec.agree import AgreeSpec

HALF_STEP: Final = "half_step"


class Variant(NamedTuple):
    """A way to run a task: the engine, and whether its physics step is halved (same control period)."""

    engine: str
    half_step: bool = False

    @property
    def name(self) -> str:
        """`mujoco`, `mujoco-half_step`: in ids of tests, names of logs and tables."""
        return f"{self.engine}-{HALF_STEP}" if self.half_step else self.engine


def variants_of(engines: Sequence[str], *, check_step: bool) -> tuple[Variant, ...]:
    """The runs of a task: in each engine, with `check_step` followed by its run at half the step."""
    halves = (False, True) if check_step else (False,)
    return tuple(Variant(engine, half_step) for engine in engines for half_step in halves)


def engine_override(variant: Variant) -> str:
    """The override that selects the engine of a variant, as after `--set`."""
    return f"simulation.engine={variant.engine}"


class Number(NamedTuple):
    """A value in its SI unit."""

    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class GraspNumbers:
    """One grasp.

    Attributes:
        name: of the body, numbered from its second grasp on: `cup`, `cup_2`.
        slip, rotation: the largest of the body in the hand [m, rad]; None if unknown.
        force: the largest sum of the normal forces of the robot's links on the body [N].
    """

    name: str
    slip: float | None
    rotation: float | None
    force: float


@dataclass(frozen=True, slots=True)
class MeasuredRun:
    """One run.

    Attributes:
        variant: how it was run.
        verdict: on its log, or of a task that cannot be planned.
        step: [s] the physics step.
        wall_time: [s] of all stages.
        log: path of the log; None where nothing was run, or it was not kept.
        grasps: in order of time.
        forces: the largest normal force between two parts in each started step [N], by step id.
        agree: allowed differences, from the task file.
        places: of `agree`, steps, expectations and the task's name in the task file, by location.
    """

    variant: Variant
    verdict: Verdict
    step: float
    wall_time: float
    log: str | None = None
    grasps: tuple[GraspNumbers, ...] = ()
    forces: Mapping[str, float] = field(default_factory=dict)
    agree: AgreeSpec = field(default_factory=AgreeSpec)
    places: Mapping[Loc, Place] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.variant.name
