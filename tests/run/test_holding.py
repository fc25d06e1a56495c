"""Why something is no longer in the hand: too little force, or enough of it in the wrong places."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.model.state import Contact
from manipcli.run.grasp_margin import GraspMargin
from manipcli.task.load_task import load_task

POUR = Path(__file__).resolve().parents[2] / "tasks" / "pour.yaml"


@pytest.fixture(scope="module")
def holding() -> GraspMargin:
    task = load_task(POUR)
    return GraspMargin(task.robot, task.scene)


def told(holding: GraspMargin, *forces: float) -> str:
    """Of the cup of 150 g (1.47 N) with friction 1, pressed by one link after the other."""
    links = ("palm", "finger_1_distal_link", "finger_3_proximal_link")
    contacts = [Contact("cup", f"robot/{link}", force, 0.0) for link, force in zip(links, forces, strict=False)]
    holding.taken("cup", [*contacts, Contact("cup", "desk", 1.0, 0.0)])
    return holding.summary("cup")


def test_force_that_hardly_carries_is_compared_to_the_weight(holding: GraspMargin) -> None:
    assert told(holding, 1.0, 0.2).endswith("carries 1.2 N, its weight is 1.47 N")
    assert told(holding, 1.5, 1.5).endswith("its weight is 1.47 N; maximum lift acceleration before slip: 10 m/s2")


def test_force_that_is_ample_is_not_the_cause_and_the_links_are_named(holding: GraspMargin) -> None:
    """More than three times the weight, 4.41 N."""
    assert "maximum lift acceleration" in told(holding, 2.2, 2.2)
    assert told(holding, 8.0, 9.0).endswith(
        "its weight is 1.47 N; the force is sufficient, check the contact points: "
        "finger_1_distal_link (9 N), palm (8 N)"
    )
