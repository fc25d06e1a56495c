"""Check of the name of OMPL's planner before a search needs it."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.conditions.condition import Problem
from manipcli.core.text import did_you_mean
from manipcli.plan.path_planners.ompl import OmplSpec
from manipcli.spec.planner import PlannerSpec


def algorithm_problems(spec: PlannerSpec) -> Iterator[Problem]:
    """An unknown `algorithm` of OMPL; nothing for other path planners.

    Without OMPL nothing is known about its planners: a task whose straight paths are free does not need it, and a
    search refuses.
    """
    if not isinstance(spec, OmplSpec):
        return
    try:
        from ompl import base, geometric
    except ImportError:
        return
    known = sorted(
        name for name, kind in vars(geometric).items() if isinstance(kind, type) and issubclass(kind, base.Planner)
    )
    if spec.algorithm not in known:
        near = did_you_mean(spec.algorithm, known, kind="planners", most=4)
        yield Problem(("algorithm",), f"OMPL has no planner '{spec.algorithm}'", near)
