"""Outcome and sign of the margin agree in everything that is told of an expectation, however near to its limit."""

from __future__ import annotations

import json
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from manipcli.conditions.robustness import EDGE, Measured, Robustness, never, opposite, robustness
from manipcli.judge.expectation import outcome
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.replay.cause import Written
from manipcli.report.html.page_parts import signed
from manipcli.report.json import render_verdict
from manipcli.report.junit import render_junit
from manipcli.report.logs.log_diff import _met
from manipcli.report.text import _margin
from manipcli.run.run_log import verdict_metadata

NEAR_TO_0 = (0.0, -0.0, 5e-324, -5e-324, 4e-10, -4e-10, EDGE, -EDGE, 1.4e-9, -1.4e-9, -0.01)


def of(margin: float) -> Robustness:
    return robustness(np.full(1, margin), np.zeros(1), unit="N", scale=1.0, describe=lambda k: "free")


def told(one: ExpectationOutcome) -> dict[str, float]:
    """The margin in everything that tells its number."""
    step = StepOutcome("wait_1", "wait", "done", 0.0, 1.0, 1.0)
    verdict = Verdict("t", one.outcome, 0, "pybullet", 1.0, (step,), (one,))  # type: ignore[arg-type]
    xml = fromstring(render_junit(verdict, (Written("", "t.yaml", 1),), (Written("", "t.yaml", 2),)))
    said = next(text for text in xml.itertext() if "margin" in text).split("margin ")[1]
    return {
        "json": json.loads(render_verdict(verdict))["expectations"][0]["margin"],
        "junit": float(said.split()[0]),
        "metadata": float(verdict_metadata(verdict)["verdict"][f"expect.{one.name}"].split()[1]),
        "page": float(signed(one.margin or 0.0, one.unit).split()[0].replace("−", "-")),
    }


@pytest.mark.parametrize("margin", NEAR_TO_0)
@pytest.mark.parametrize("word", ["", "not", "never"])
def test_outcome_and_sign_agree_wherever_they_are_told(margin: float, word: str) -> None:
    asked = {"": lambda one: one, "not": opposite, "never": never}[word](of(margin))
    one = outcome("one", asked.found(0))
    met = (margin >= 0.0) is (word == "")
    assert one.outcome == ("passed" if met else "failed")
    assert bool(asked.order[0] >= 0.0) is met, "until and watches ask this"
    assert {where: value >= 0.0 for where, value in told(one).items()} == dict.fromkeys(told(one), met)


def test_what_is_missed_by_nothing_is_not_told_as_a_size() -> None:
    one = outcome("not", opposite(of(0.0)).found(0))
    assert (one.outcome, one.margin, one.distance) == ("failed", -EDGE, 0.0)
    assert (_margin(one), _met(one)) == ("fails (worst at 0.00 s): not free", "failed")
    assert Measured(-EDGE, "N", None).lacking == ""
    assert Measured(-0.02, "N", None).lacking == " by 0.02 N"
    assert Measured(-1.0, "", None).lacking == "", "there is no half a step"


def test_what_has_no_unit_has_no_size() -> None:
    assert _margin(outcome("step_done", Measured(1.0, "", 2.0, "done"))) == "passes (tightest at 2.00 s): done"
