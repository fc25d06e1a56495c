"""When a pour with an amount tilts back, with a cup whose contents leave it one by one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from manipcli.plan.motion import Motion, StepPlan
from manipcli.plan.portion import Portion
from manipcli.run.dosing import ROUNDS, Dosing
from manipcli.simulate.executor import DONE, Lane, MotionEnd

NAMES = tuple(f"ball[{k}]" for k in range(6))
TILT, BACK = Motion("tilt", None, None, 1.0, pours=True), Motion("tilt back", None, None, 1.0)


class Cup:
    """The watch and the executor: per tick of the tilt one more body is about to leave; some of these fall back."""

    def __init__(self, falls_back: int) -> None:
        self.leaving: tuple[str, ...] = ()
        self.left: tuple[str, ...] = ()
        self.done: list[str] = []
        self._falls_back = falls_back

    def running(self, motion: Motion, *, until: object, deadline: object) -> Lane[MotionEnd]:
        self.done.append(motion.label)
        if not motion.pours:
            yield
            return DONE
        try:
            for _ in range(10):
                yield
                self.leaving = NAMES[: len(self.leaving) + 1]
        finally:
            self.leaving = NAMES[: max(len(self.left), len(self.leaving) - self._falls_back)]
            self.left, self._falls_back = self.leaving, self._falls_back - 1
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


def test_it_tilts_back_as_soon_as_as_much_is_leaving() -> None:
    cup = Cup(falls_back=0)
    poured(cup, 4)
    assert cup.left == NAMES[:4]
    assert cup.done == ["tilt", "tilt back"]


def test_where_some_fall_back_it_tilts_once_more() -> None:
    """Of four that were leaving two fall back, then one, then none."""
    cup = Cup(falls_back=2)
    poured(cup, 4)
    assert cup.left == NAMES[:4]
    assert cup.done == ["tilt", "tilt back"] * 3


def test_it_gives_up_after_some_rounds() -> None:
    cup = Cup(falls_back=100)
    poured(cup, 4)
    assert cup.left == ()
    assert cup.done == ["tilt", "tilt back"] * (1 + ROUNDS)
