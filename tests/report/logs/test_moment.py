"""One moment of a log as text."""

from __future__ import annotations

from manipcli.report.logs.snapshot import JointMoment, Moment, render_text


def test_a_number_that_is_no_length_of_this_world_stays_short() -> None:
    joints = tuple(JointMoment(f"joint_{k}", "rad", value, None, None) for k, value in enumerate((1.5, 1e300, -2e12)))
    shown = Moment("log", 0.0, 0.0, 1.0, "", "", "", joints, (), None, ())
    lines = [line for line in render_text(shown).splitlines() if line.startswith("joint_")]
    assert "1.5000 rad" in lines[0]
    assert "1e+300 rad" in lines[1] and "-2e+12 rad" in lines[2]
    assert max(map(len, lines)) < 80
