"""What was cut is told in one line, the worst first, and goes through the metadata of a log unchanged."""

from __future__ import annotations

from manipcli.judge.saturations import Saturations
from manipcli.judge.verdict import Verdict
from manipcli.report.json import saturated_object
from manipcli.report.text import render_verdict

CUTS = Saturations({"a": 5, "b": 0, "c": 70}, {"m1": 6, "m2": 300}, 2000)


def test_the_worst_three_are_named_and_what_was_never_cut_is_not() -> None:
    assert str(CUTS) == (
        "saturated: actuator 'm2' in 300, joint 'c' in 70, actuator 'm1' in 6 of 2000 ticks; 1 more in fewer ticks"
    )
    assert str(Saturations(actuators={"m1": 463}, ticks=2000)) == "saturated: actuator 'm1' in 463 of 2000 ticks"
    assert str(Saturations({"a": 0}, {}, 2000)) == ""


def test_which_limit_it_was_is_told_where_it_is_known() -> None:
    kinds = {"velocity": {"b": 4}, "effort": {"a": 5, "b": 0, "d": 0}, "acceleration": {"b": 6}, "position": {"d": 0}}
    cuts = Saturations({"a": 5, "b": 6, "c": 7, "d": 0}, {}, 2000, kinds)
    told = "joint 'c' in 7, joint 'b' (acceleration in 6, velocity in 4) in 6, joint 'a' (effort) in 5 of 2000 ticks"
    assert str(cuts) == f"saturated: {told}"
    assert cuts.to_metadata()["saturated limits"] == {"velocity, b": "4", "effort, a": "5", "acceleration, b": "6"}
    assert str(Saturations.from_metadata(cuts.to_metadata(), end=1.999, period=1e-3)) == str(cuts)
    assert saturated_object(cuts)["limits"] == {"velocity": {"b": 4}, "effort": {"a": 5}, "acceleration": {"b": 6}}
    later = Saturations({"a": 9}, {}, 2100, {"effort": {"a": 6}})
    assert str(later.since(cuts)) == "saturated: joint 'a' (effort in 1) in 4 of 100 ticks"


def test_metadata_give_back_what_went_into_them() -> None:
    assert CUTS.to_metadata() == {
        "saturated joints": {"a": "5", "c": "70"},
        "saturated actuators": {"m1": "6", "m2": "300"},
    }
    assert str(Saturations.from_metadata(CUTS.to_metadata(), end=1.999, period=1e-3)) == str(CUTS)
    assert Saturations().to_metadata() == {}
    damaged = {"saturated joints": {"a": "-1", "b": "many", "c": "4"}}
    assert str(Saturations.from_metadata(damaged, end=1.0, period=0.0)) == "saturated: joint 'c' in 4 ticks"


def test_since_an_earlier_moment_only_what_was_added_counts() -> None:
    before = Saturations({"a": 5, "c": 60}, {"m2": 300}, 1900)
    assert str(CUTS.since(before)) == "saturated: joint 'c' in 10, actuator 'm1' in 6 of 100 ticks"


def test_a_verdict_tells_it_in_text_and_json() -> None:
    verdict = Verdict("t", "passed", 0, "pybullet", 1.0, (), (), saturations=CUTS)
    assert f"\n{CUTS}\n" in render_verdict(verdict, "x.mcap")
    assert "saturated" not in render_verdict(Verdict("t", "passed", 0, "pybullet", 1.0, (), ()), "x.mcap")
    assert saturated_object(CUTS) == {"joints": {"a": 5, "c": 70}, "actuators": {"m1": 6, "m2": 300}, "limits": {}}
