"""Limits of `agree.margins` that cannot be used: found before a run, all of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.conditions.members import CONDITIONS
from manipcli.core.errors import InvalidInput
from manipcli.core.units import parse_unit
from manipcli.pipeline import load_task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: nod
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
scene:
  ball: {{sphere: {{radius: 2 cm}}, mass: 50 g, pose: {{xyz: [1, 0, 0.02]}}}}
steps:
  - wait: 0.2 s
expect:
  - duration: {{below: 6 s}}
  - step_done: {{step: wait_1}}
  - all: [{{near: {{object: ball, to: [1, 0, 0], within: 1 m}}}}, {{at_rest: {{object: ball}}}}]
    id: both
  - never: {{collision: [robot, floor]}}
    id: free
watch:
  - always: {{at_pose: {{pose: home, within: 9 deg}}}}
    id: posed
agree:
  margins:
"""
FIRST = TASK.count("\n") + 1


def messages(tmp_path: Path, *lines: str) -> list[tuple[str, int, str]]:
    path = tmp_path / "nod.yaml"
    path.write_text(TASK + "".join(f"    {line}\n" for line in lines))
    with pytest.raises(InvalidInput) as refused:
        load_task(path)
    found = refused.value.findings
    return [(each.code, each.place.line - FIRST if each.place else -1, each.message) for each in found]


def test_all_limits_in_a_unit_that_their_margin_never_has_are_reported_at_once(tmp_path: Path) -> None:
    lines = ("duration: 1 cm", "step_done: 1 cm", "both: 3 s", "free: 1 mm", "posed: 2 N", "dration: 1 s")
    assert messages(tmp_path, *lines) == [
        ("TASK246", 0, "agree.margins.duration: '1 cm' is a length; the margin is in s"),
        ("TASK246", 1, "agree.margins.step_done: '1 cm' is a length; the margin is without a unit"),
        ("TASK246", 2, "agree.margins.both: '3 s' is a time; the margin is in m or m/s"),
        ("TASK246", 3, "agree.margins.free: '1 mm' is a length; the margin is in N"),
        ("TASK246", 4, "agree.margins.posed: '2 N' is a force; the margin is in rad or m"),
        ("TASK230", 5, "agree.margins.dration: the task has no expectation 'dration'"),
    ]


def test_amounts_that_fit_shares_and_numbers_are_accepted(tmp_path: Path) -> None:
    """Where parts with several units are combined, any of these: the run shows which one decides."""
    path = tmp_path / "nod.yaml"
    for both in ("1 cm", "2 cm/s", "10 %", "0.5"):
        limits = f"{{duration: 0.1 s, step_done: 1 %, both: {both}, free: 1 N, posed: 1 deg}}"
        path.write_text(TASK.replace("  margins:\n", f"  margins: {limits}\n"))
        assert load_task(path).findings == ()


def test_each_condition_states_units_that_can_be_read() -> None:
    """Otherwise its limits could not be checked."""
    for member in CONDITIONS:
        assert member.units
        for unit in filter(None, member.units):
            assert parse_unit(unit).dimension.symbol
