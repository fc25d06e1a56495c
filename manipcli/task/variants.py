"""Variants of a task: the overrides that select another engine and half the physics step."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.judge.measured_run import Variant, engine_override
from manipcli.spec import load
from manipcli.spec.simulation import SimulationSpec
from manipcli.task.vocabulary import task_spec


def simulation_of(path: Path, *, overrides: Sequence[str] = (), seed: int | None = None) -> SimulationSpec:
    """The block `simulation` of a task file.

    Raises:
        InvalidInput: the file is invalid.
    """
    return load.load_task(path, model=task_spec(), overrides=overrides, seed=seed).spec.simulation


def overrides_of(
    variant: Variant, path: Path, *, overrides: Sequence[str] = (), seed: int | None = None
) -> tuple[str, ...]:
    """`overrides`, then those of the variant: the engine and, for half the step, the step of the task over 2.

    The control period stays, so the number of physics steps per control tick doubles.

    Raises:
        InvalidInput: the file is invalid.
    """
    chosen = (*overrides, engine_override(variant))
    return (*chosen, half_step_override(path, overrides=chosen, seed=seed)) if variant.half_step else chosen


def half_step_override(path: Path, *, overrides: Sequence[str] = (), seed: int | None = None) -> str:
    """The override that halves the physics step of a task.

    Raises:
        InvalidInput: the file is invalid.
    """
    return f"simulation.step={simulation_of(path, overrides=overrides, seed=seed).step / 2.0!r}"
