"""`agree:` of a task: amounts with their units, and what is refused with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.spec.load import load_task_text
from manipcli.spec.resolved import resolved
from manipcli.task.load_task import load_task
from manipcli.task.vocabulary import task_spec

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: nod
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
agree: {{AGREE}}
steps: [{{wait: 1 s}}]
expect: [{{duration: {{below: 9 s}}}}]
params: {{tolerance: 0.5 s}}
"""


def test_what_is_left_out_may_differ_by_any_amount() -> None:
    agree = load_task_text(TASK.replace("{AGREE}", "{}"), "a.yaml", model=task_spec()).spec.agree
    assert (agree.margin, agree.margins, agree.duration, agree.slip, agree.force) == (None, {}, None, None, None)


def test_a_resolved_task_is_equal() -> None:
    text = TASK.replace("{AGREE}", "{margin: 20 %, margins: {duration: $tolerance}, slip: 2 mm}")
    spec = load_task_text(text, "a.yaml", model=task_spec()).spec
    assert (spec.agree.margin, spec.agree.slip, spec.agree.margins) == (0.2, 0.002, {"duration": "0.5 s"})
    assert load_task_text(resolved(spec), "b.yaml", model=task_spec()).spec.agree == spec.agree


@pytest.mark.parametrize(
    ("agree", "column", "message"),
    [
        ("{margin: -1}", 17, "agree.margin: "),
        ("{margins: {duration: 5 kk}}", 29, "unknown unit 'kk'; expected an amount or a share"),
        ("{margins: {duration: '5'}}", 29, "'5' has no unit"),
        ("{margins: {duration: -1 s}}", 29, "-1 s is negative; expected 0 or more"),
        ("{margins: {duration: true}}", 29, "agree.margins.duration: "),
        ("{slip: 5 %}", 15, "expected a length"),
        ("{speed: 5 %}", 9, "unknown key 'speed'"),
    ],
)
def test_what_is_no_limit_is_refused_at_its_place(agree: str, column: int, message: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        load_task_text(TASK.replace("{AGREE}", agree), "a.yaml", model=task_spec())
    finding = refused.value.findings[0]
    assert message in finding.message
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (4, column)


def test_a_margin_of_no_expectation_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(TASK.replace("{AGREE}", "{margins: {duratoin: 1 s}}"))
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    (finding,) = refused.value.findings
    assert finding.message == "agree.margins.duratoin: the task has no expectation 'duratoin'"
    assert (finding.hint, str(finding.place)) == ("did you mean 'duration'?", f"{file}:4:19")
