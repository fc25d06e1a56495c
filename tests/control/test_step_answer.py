"""The answer to a step against the loop of `stability`, matrix by vector."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.control.gain_design import step_answer
from manipcli.control.stability import Loop, transition


@pytest.mark.parametrize("damping", [0.0, 0.2, 9.0, 11.0, 50.0])
@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("delay", [0, 2])
def test_a_step_is_the_recurrence_whose_poles_are_looked_at(damping: float, substeps: int, delay: int) -> None:
    """Of 0.02 kg m2 in 1 ms, damping is stiff from 10 N m s/rad on; in steps of a quarter, from 40."""
    loop = Loop.of_joint(0.02, p=40.0, d=1.0, damping=damping, period=1e-3, substeps=substeps, delay=delay)
    answer = step_answer(loop, 0.1, effort=np.inf)
    x = np.zeros(2 + delay)
    x[0] = -0.1  # from where it is to be
    A = transition(loop)
    for share in answer.share[:300]:
        assert share == pytest.approx(1.0 + x[0] / 0.1, abs=1e-9)
        x = A @ x
