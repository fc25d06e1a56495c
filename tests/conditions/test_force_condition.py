"""The felt force as a condition: signs, magnitudes and limits by hand, and specs that mean nothing."""

import numpy as np
import pytest
from pydantic import ValidationError

from manipcli.conditions.condition import CheckContext
from manipcli.conditions.members.force import FORCE, FeltForceSpec
from manipcli.conditions.sensed import FELT, FELT_FORCE, Readings
from manipcli.conditions.state_window import StateWindow
from manipcli.model.state import WorldState

TIMES = np.array([0.0, 0.001, 0.002])
FORCES = np.array([[0.0, 0.0, 8.0], [3.0, 0.0, 10.0], [0.0, -4.0, 12.5]])


def margins(**written):
    states = WorldState.room(1, 0, 3)
    states.time[:] = TIMES
    readings = {FELT: Readings(TIMES, np.hstack([FORCES, np.zeros((3, 3))]))}
    window = StateWindow(states, None, (), (), (), readings=readings)
    return FORCE.open(FeltForceSpec.model_validate(written), None)(window).margins


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ({"between": ["9 N", "11 N"]}, [-1.0, 1.0, -1.5]),
        ({"axis": "y", "above": -5.0}, [5.0, 5.0, 1.0]),
        ({"axis": "magnitude", "below": 11.0}, [3.0, 11.0 - np.hypot(3, 10), 11.0 - np.hypot(4, 12.5)]),
    ],
)
def test_the_margin_is_the_distance_to_the_nearer_limit(written, expected):
    np.testing.assert_allclose(margins(**written), expected, atol=1e-12)


@pytest.mark.parametrize(
    "written", [{}, {"between": [11, 9]}, {"between": [9, 11], "above": 1}, {"above": 3, "below": 2}, {"of": "hand"}]
)
def test_limits_that_mean_nothing_are_refused(written):
    with pytest.raises(ValidationError):
        FeltForceSpec.model_validate(written)


def test_it_needs_a_compliant_step():
    spec = FeltForceSpec.model_validate({"above": 1})
    (problem,) = FORCE.check(spec, CheckContext(None, None, None, sensors={}))
    assert "no step of the task is compliant" in problem.message
    assert FORCE.check(spec, CheckContext(None, None, None, sensors={FELT: FELT_FORCE})) == ()
