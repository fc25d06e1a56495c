"""What `record:` leaves out is told where an expectation needs it."""

from pathlib import Path

import pytest

from manipcli.flow.load import load_task

POUR = Path(__file__).resolve().parents[2] / "tasks" / "pour.yaml"


@pytest.mark.parametrize(
    ("topics", "told"),
    [
        ("[tf, controller_state]", {"no_collision": "contacts"}),
        ("[contacts, controller_state]", {"inside": "tf", "upright": "tf", "near": "tf"}),
        ("[tf, contacts]", {"tracking": "controller_state"}),
        ("[tf, contacts, controller_state]", {}),
    ],
)
def test_an_expectation_without_its_topic_is_a_warning_at_its_place(topics: str, told: dict[str, str]) -> None:
    task = load_task(POUR, overrides=[f"record.topics={topics}"])
    found = [finding for finding in task.findings if finding.code == "TASK234"]
    assert {finding.message.split("'")[1]: finding.message.split("'")[3] for finding in found} == told
    assert all(finding.severity == "warning" and finding.place is not None for finding in found)
