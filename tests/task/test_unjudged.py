"""What `record:` leaves out, or the engine does not know, is told where a condition needs it."""

from pathlib import Path

import pytest

from manipcli.task.load_task import load_task

POUR = Path(__file__).resolve().parents[2] / "tasks" / "pour.yaml"


@pytest.mark.slow
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
    found = [finding for finding in task.findings if finding.code == "TASK236"]
    assert {finding.message.split("'")[1]: finding.message.split("'")[3] for finding in found} == told
    assert all(finding.severity == "warning" and finding.place is not None for finding in found)


def test_a_watch_without_its_topic_is_a_warning_at_its_place() -> None:
    watch = "watch=[{always: {rests_on: {object: cup, of: desk}}}]"
    task = load_task(POUR, overrides=[watch, "record.topics=[tf, controller_state]"])
    told = [finding.message for finding in task.findings if finding.code == "TASK236"]
    assert any(message.startswith("'rests_on' cannot be judged") for message in told)


@pytest.mark.parametrize(("engine", "doubted"), [("pybullet", False), ("kinematic", True)])
def test_an_until_that_asks_for_references_is_a_warning_where_they_come_true_at_once(
    engine: str, doubted: bool
) -> None:
    steps = "steps=[{wait: 1 s, until: {tracking: {group: arm, within: 0.1}}}]"
    overrides = [f"simulation.engine={engine}", "expect=[]", "record.topics=[tf, controller_state]", steps]
    found = load_task(POUR, overrides=overrides).findings
    assert any("tracking is ideal" in one.message for one in found) == doubted
    assert any(one.code == "TASK237" for one in found) == doubted


@pytest.mark.slow
def test_an_until_that_needs_physics_is_a_warning_where_there_is_none() -> None:
    task = load_task(POUR, overrides=["simulation.engine=kinematic"])
    (finding,) = (one for one in task.findings if one.code == "TASK237")
    assert finding.severity == "warning"
    assert finding.message.startswith("`until` is not waited for: the engine has no physics")
    assert finding.place is not None
    line = POUR.read_text().splitlines()[finding.place.line - 1]
    assert line.strip().startswith("until:")
    assert not [one for one in load_task(POUR).findings if one.code == "TASK237"]
