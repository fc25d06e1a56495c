"""The margin of damping against the recurrence that it stands for."""

import numpy as np
import pytest

from manipcli.control.stability import damping_findings, damping_margin


@pytest.mark.parametrize(("kd", "settles"), [(1.5, True), (3.9, True), (4.1, False)])
def test_a_margin_of_two_is_where_the_sampled_damper_stops_settling(kd, settles):
    inertia, step = 0.002, 0.001
    v = 1.0
    for _ in range(2000):
        v += step * (-kd * v) / inertia
    assert (abs(v) < 1.0) == settles == bool(damping_margin(kd, step=step, inertia=inertia) < 2.0)


def test_findings_name_the_joint_and_the_gain_to_stay_below():
    findings = damping_findings(["a", "b", "c"], [1.0, 3.0, 5.0], step=1e-3, inertia=np.full(3, 0.0021))
    assert [f.message.split(":")[0] for f in findings] == ["b", "c"]
    assert "rings" in findings[0].message
    assert "unstable" in findings[1].message
    assert "below kd 2.1" in findings[1].hint
    assert {f.severity for f in findings} == {"warning"}
