"""Settings that an engine chose itself are shown with their reasons."""

from __future__ import annotations

from manipcli.report.logs.engine_choice import engine_choices


def test_a_value_is_shown_with_its_reason() -> None:
    chosen = {"solver_iterations": "100", "solver_iterations_reason": "'cup' has a mass of 150 g", "threads": "1"}
    assert engine_choices({"engine": chosen}) == (
        ("solver iterations", "100 ('cup' has a mass of 150 g)"),
        ("threads", "1"),
    )


def test_a_log_without_choices_shows_none() -> None:
    assert engine_choices({"run": {"engine": "kinematic"}}) == ()
