"""`pour` with an amount: the tilt stops as soon as it has left the cup, and goes back the way it came."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.constrained_motion import smooth_motion
from manipcli.plan.motion import Motion, PlanningState, StepPlan
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import joint_path
from manipcli.plan.planner import Planner
from manipcli.run.pour_watch import PourWatch
from manipcli.simulate.executor import DONE, Executor, Lane, MotionEnd

Situation = Callable[[PlanningState], PlanningState]
"""Measures the state, from the one that is believed."""
AHEAD: Final = (0.3, 0.15, 0.05, 0.0)
"""[s] What will leave within this counts as well, per tilt. A tilt is reversed in 0.3 s; what rolls leaves meanwhile,
what slides may jam and stay. So each tilt counts on less, and the last only on what has left."""
FAST: Final = 0.9
"""Share of the velocity limits of the way back."""
CORNERS: Final = 24
"""Points of the way back, between which it is smooth."""


class Dosing:
    """Ends the tilt of a pour early, and later in each further tilt where less has left than it seemed.

    Args:
        planner: of the task.
        plan: of the pour, with a `portion`.
        watch: sees what leaves the cup.
        situation: measures the state.
    """

    def __init__(self, planner: Planner, plan: StepPlan, watch: PourWatch, situation: Situation) -> None:
        self._planner, self._plan, self._watch, self._situation = planner, plan, watch, situation
        self._contents = [planner.scene.body(name) for name in plan.poured]
        self._pouring = [motion for motion in plan.motions if motion.pours]
        self._stopped, self._ahead = False, AHEAD[0]

    @classmethod
    def of(cls, planner: Planner, plan: StepPlan, watch: PourWatch | None, situation: Situation) -> Dosing | None:
        """None for a plan without a portion."""
        return None if plan.portion is None or watch is None else cls(planner, plan, watch, situation)

    def _reached(self, names: Sequence[str]) -> bool:
        portion = self._plan.portion
        assert portion is not None  # see `Args`
        return portion.reached(self._contents, [body for body in self._contents if body.name in names])

    def running(self, motion: Motion, executor: Executor, deadline: float | None) -> Lane[MotionEnd]:
        """A motion of the plan: a pouring one up to the amount, the one after these from where they stopped."""
        if motion.pours:
            return (yield from self._pour(motion, executor, deadline))
        end = yield from self._back(motion, executor, deadline)
        for self._ahead in AHEAD[1:]:
            if not self._stopped or end.outcome != "done" or self._reached(self._watch.left):
                break
            self._stopped = False
            for pouring in self._pouring:
                end = yield from self._pour(pouring, executor, deadline)
                if end.outcome != "done":
                    return end
            end = yield from self._back(motion, executor, deadline)
        return end

    def _pour(self, motion: Motion, executor: Executor, deadline: float | None) -> Lane[MotionEnd]:
        """The motion, until as much has left the cup or is about to; then nothing."""
        if self._stopped:
            return DONE
        lane = executor.running(motion, until=None, deadline=deadline)
        try:
            next(lane)
            while True:
                state = yield
                self._stopped = self._reached(self._watch.leaving(self._ahead))
                if self._stopped:
                    lane.close()
                    yield from executor.come_to_rest()
                    return DONE
                lane.send(state)
        except StopIteration as ended:
            end: MotionEnd = ended.value
            return end

    def _back(self, motion: Motion, executor: Executor, deadline: float | None) -> Lane[MotionEnd]:
        """The planned motion; or, where the tilt was stopped, back on its path as fast as the limits allow."""
        tilts = [each.trajectory for each in self._pouring if each.trajectory is not None]
        if self._stopped and tilts:
            names, planned = tilts[0].names, np.concatenate([each.positions for each in tilts])
            now = self._situation(self._plan.end)
            here = now.position[self._planner.robot.indices(names)]
            nearest = int(np.argmin(np.linalg.norm(planned - here, axis=1)))
            path: Array = planned[np.linspace(nearest, 0, CORNERS).astype(int)]
            limits = MotionLimits.of(self._planner.robot, names, velocity_scale=FAST)
            try:
                back = smooth_motion(self._planner, now, motion.label, limits, joint_path([here, *path[1:]]))
            except NotPlannable as refusal:
                return MotionEnd("failed", f"{motion.label}: {refusal.cause}")
            motion = replace(motion, trajectory=back, duration=back.duration, begins=now)
        return (yield from executor.running(motion, until=None, deadline=deadline))
