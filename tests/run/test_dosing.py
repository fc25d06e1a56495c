"""When a pour with an amount tilts back, with a cup whose contents leave it one by one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from manipcli.plan.motion import Motion, StepPlan
from manipcli.plan.portion import Portion
from manipcli.run.dosing import AHEAD, Dosing
from manipcli.simulate.executor import DONE, Lane, MotionEnd

NAMES = tuple(f"ball[{k}]" for k in range(6))
TILT, BACK = Motion("tilt", None, None, 1.0, pours=True), Motion("tilt back", None, None, 1.0)


class Cup:
    """The watch and the executor: in each tilt the bodies that are in it would leave one every 0.1 s.

    Args:
        jams: what has not left when the tilt stops stays; else what was counted on leaves all the same.
        stuck: that many never leave.
    """

    def __init__(self, *, jams: bool, stuck: int = 0) -> None:
        self.left: tuple[str, ...] = ()
        self.done: list[str] = []
        self._jams, self._stuck = jams, stuck
        self._time, self._within = 0.0, 0.0

    def leaving(self, within: float) -> tuple[str, ...]:
        self._within = within
        return self._out(self._time + within)

    def _out(self, time: float) -> tuple[str, ...]:
        return NAMES[: min(len(self.left) + int(time / 0.1 + 1e-6), len(NAMES) - self._stuck)]

    def running(self, motion: Motion, *, until: object, deadline: object) -> Lane[MotionEnd]:
        self.done.append(motion.label)
        if not motion.pours:
            yield
            return DONE
        self._time = 0.0
        try:
            for self._time in np.arange(0.0, 1.0, 0.01):
                yield
        finally:
            self.left = self._out(self._time + (0.0 if self._jams else self._within))
        return DONE

    def come_to_rest(self) -> Lane[None]:
        yield


def poured(cup: Cup, amount: int) -> None:
    """Both motions of the plan, run to their ends."""
    plan = StepPlan((TILT, BACK), cast(Any, None), poured=NAMES, into="tray", portion=Portion(amount, "bodies"))
    bodies = {name: SimpleNamespace(name=name, mass=0.01) for name in NAMES}
    planner = cast(Any, SimpleNamespace(scene=SimpleNamespace(body=bodies.__getitem__)))
    dosing = Dosing(planner, plan, cast(Any, cup), cast(Any, None))
    for motion in plan.motions:
        lane = dosing.running(motion, cast(Any, cup), None)
        next(lane)
        with pytest.raises(StopIteration):
            while True:
                lane.send(cast(Any, None))


@pytest.mark.parametrize("amount", range(1, 7))
def test_what_is_about_to_leave_counts(amount: int) -> None:
    """Where it does leave, one tilt is enough; up to three leave while it is reversed."""
    cup = Cup(jams=False)
    poured(cup, amount)
    assert len(cup.left) == max(amount, 3)
    assert cup.done == ["tilt", "tilt back"]


@pytest.mark.parametrize("amount", range(1, 7))
def test_what_jams_is_poured_after_all(amount: int) -> None:
    """Nothing that was counted on leaves, and nothing more than the amount."""
    cup = Cup(jams=True)
    poured(cup, amount)
    assert len(cup.left) == amount
    assert 1 < len(cup.done) // 2 <= len(AHEAD)


def test_a_whole_tilt_is_not_repeated() -> None:
    """Of six bodies three leave at most: after the whole tilt no other one gets more."""
    cup = Cup(jams=True, stuck=3)
    poured(cup, 4)
    assert len(cup.left) == 3
    assert cup.done == ["tilt", "tilt back"]
