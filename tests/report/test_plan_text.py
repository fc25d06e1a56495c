"""The text of a plan."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from manipcli.core.errors import NotPlannable
from manipcli.plan.candidates import Dropped
from manipcli.report.plan_text import render_text


def test_refused_candidates_are_grouped_and_the_one_taken_is_named() -> None:
    dropped = [Dropped(f"yaw {k}", NotPlannable(f"approach: {k}.5 mm too near")) for k in range(90)]
    dropped.append(Dropped("far", NotPlannable("reach: out of reach")))
    still = SimpleNamespace(stream=None)
    step = SimpleNamespace(id="pick_1", candidate="from the top", dropped=dropped, plan=still)
    only = SimpleNamespace(id="wait_1", candidate="", dropped=(), plan=still)
    plan: Any = SimpleNamespace(
        motions=(),
        steps=(step, only),
        every=(step, only),
        branches={},
        combinations=(),
        branch="",
        items=(),
        duration=0.0,
        clearances=tuple,
        path_kinds=tuple,
        margins=tuple,
        grasps=tuple,
        stated_clearances=tuple,
    )
    text = render_text("t", plan)
    assert "pick_1 takes candidate 92: from the top" in text and "wait_1" not in text
    assert [line.split()[:3] for line in text.splitlines() if line.startswith("     ")] == [
        ["90", "pick_1", "approach"],
        ["1", "pick_1", "reach"],
    ]
