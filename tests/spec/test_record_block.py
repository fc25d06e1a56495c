"""`record:` of a task: topics by their names, rates that the clock can keep."""

from __future__ import annotations

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.spec.load import load_task_text
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

TASK = "task: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps: [{wait: 1 s}]\n"


def loaded(text: str) -> TaskSpec:
    return load_task_text(f"{TASK}{text}".encode(), "t.yaml", model=task_spec()).spec


def test_rates_are_ticks_between_messages_and_topics_leave_the_others_out() -> None:
    spec = loaded("record: {rates: {tf: 100 Hz, joint_states: 1 kHz, error: 50}, topics: [tf, error, goals]}")
    assert spec.record.strides(spec.simulation.control_period) == {"tf": 10, "joint_states": 1, "error": 20}
    assert spec.record.left_out == {
        "controller_state", "reference", "actuator_states", "wrench", "contacts", "sensors",
    }  # fmt: skip
    usual = loaded("").record
    assert (usual.strides(0.001), usual.left_out) == ({}, frozenset())


@pytest.mark.parametrize(
    ("block", "expected", "hint"),
    [
        ("{rates: {tf: 300 Hz}}", "300 Hz does not divide the control rate, 1000 Hz", "250 Hz"),
        ("{rates: {tf: 2 kHz}}", "2000 Hz does not divide the control rate", "1000 Hz', the control rate"),
        ("{rates: {tf: 10 Hz}}", "'tf' is recorded at 10 Hz; judging needs at least 20 Hz", "20 Hz or more"),
        ("{rates: {tf: 40 Hz, joint_states: 125 Hz}}", "coincide every 0.2 s", "divide each other"),
        ("{rates: {error: 10 Hz}, topics: [tf]}", "'error' has a rate, but is not among `topics`", ""),
        ("{rates: {tff: 10 Hz}}", "tff", "tf"),
        ("{topics: [contact]}", "contact", "contacts"),
        ("{rates: {tf: 10 ms}}", "'10 ms' is a time; expected a frequency", ""),
        ("{rates: {tf: 0}}", "0", ""),
        ("{rate: {}}", "rate", "rates"),
    ],
)
def test_what_the_clock_cannot_keep_is_refused(block: str, expected: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        loaded(f"record: {block}")
    (finding,) = caught.value.findings
    assert expected in finding.message
    assert hint in (finding.hint or "")
    assert finding.place is not None
    assert finding.place.line == 5
