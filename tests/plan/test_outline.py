"""The outline of a plan in a log: what is written reads back; anything else reads as no plan."""

import json

import pytest

from manipcli.plan.motion import Motion
from manipcli.plan.outline import PlanOutline, StepOutline

STEPS = (StepOutline("up", "move", "a.yaml:3:5", 1.25), StepOutline("hold", "wait", "a.yaml:4:5", 0.5))


def test_what_is_written_reads_back():
    outline = PlanOutline(STEPS, ("a.yaml:9:5",))
    assert PlanOutline.read(outline.to_json()) == outline


def test_a_step_is_written_with_its_motions():
    step = StepOutline("hold", "wait", "", 0.5, (Motion("dwell", trajectory=None, grip=None, duration=0.5),))
    (written,) = json.loads(PlanOutline((step,)).to_json())["steps"]
    assert written["motions"] == [{"label": "dwell", "duration": 0.5}]


def test_a_plan_that_names_no_places_is_read():
    content = {"steps": [{"id": "up", "verb": "move", "planned_duration": 1}]}
    assert PlanOutline.read(json.dumps(content).encode()) == PlanOutline((StepOutline("up", "move", "", 1.0),))


@pytest.mark.parametrize(
    "content",
    [None, b"", b"\xff", b"[]", b"3", b'{"steps": 3}', b'{"steps": [{"id": "up"}]}', b"[" * 100_000,
     b'{"steps": [{"id": "up", "verb": "move", "planned_duration": 1' + b"0" * 400 + b"}]}"],
)  # fmt: skip
def test_what_is_not_a_plan_reads_as_none(content):
    assert PlanOutline.read(content) == PlanOutline()
