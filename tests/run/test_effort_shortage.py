"""How far a joint is from its reference."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from manipcli.run.effort_shortage import _errors


@pytest.mark.parametrize(("kind", "error"), [("continuous", 0.1), ("revolute", 2.0 * math.pi - 0.1)])
def test_a_continuous_joint_takes_the_shorter_way_round(kind: str, error: float) -> None:
    """It holds its reference, a turn away, and does not fall."""
    robot = SimpleNamespace(joint_names=("j",), joint=lambda _: SimpleNamespace(type=kind))
    controller = SimpleNamespace(interfaces=("effort",), joints=("j",))
    manager = SimpleNamespace(controllers=(controller,), outputs=(SimpleNamespace(position=np.array([0.1])),))
    session: Any = SimpleNamespace(robot=robot, manager=manager)
    assert _errors(session, np.array([2.0 * math.pi])) == pytest.approx([error])
