"""`locate` in a running world: the next depth picture, the pose of the object in it, and the corrected belief."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.core.prose import share
from manipcli.core.units import readable
from manipcli.perception.localise import DepthView, Localisation, NotSeen, Prior, localise
from manipcli.plan.motion import Look, PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.plan.prediction import put
from manipcli.record.write.recorder import Recorder
from manipcli.run.belief import Belief
from manipcli.run.replan import between, deg, mm
from manipcli.simulate.camera_messages import DEPTH, metres
from manipcli.simulate.executor import Lane
from manipcli.simulate.sensor import Picture
from manipcli.simulate.session import Session
from manipcli.task.camera_sights import CameraSight

LATE: Final = 0.1
"""[s] A picture that arrives this much later than its camera can deliver one is lost."""

UNSURE: Final = math.radians(5.0)
"""[rad] A rotation with a larger standard deviation is not found."""
UNMOVED: Final = 1e-9
"""[m], and of a rotation matrix: a belief that differs by less from that at the start is still that."""


@dataclass(frozen=True, slots=True)
class Found:
    """What a look found: why it failed, "" if it did not; and a text for the report."""

    failure: str
    text: str = ""


class Looking:
    """Locates bodies for a running task.

    Args:
        session: the world; its camera takes the pictures.
        planner: has the cameras and the believed scene.
        belief: is corrected.
        recorder: receives the corrected poses.
    """

    def __init__(self, session: Session, planner: Planner, belief: Belief, recorder: Recorder) -> None:
        self._session = session
        self._recorder = recorder
        self._planner = planner
        self._belief = belief
        planner.starts.clear()  # of another run with this plan

    def look(self, looks: Look, situation: Callable[[], PlanningState], deadline: float | None) -> Lane[Found]:
        """Hold still until the next picture has arrived, and correct the belief.

        Args:
            looks: at what, with which camera.
            situation: the planning state as believed now.
            deadline: simulated time [s] at which the step times out.
        """
        sight = self._planner.sights[looks.sensor]
        assert isinstance(sight, CameraSight)
        session = self._session
        began = session.time
        latest = min(began + sight.latency + LATE, np.inf if deadline is None else deadline)
        joints: dict[int, Array] = {}
        with self._pictures(looks.sensor) as taken:
            while not taken:
                if session.time > latest:
                    return Found(f"no picture of '{looks.sensor}' arrived within {readable(latest - began, 's')}")
                state = yield
                if session.manager.faults:
                    return Found(session.manager.faults[-1].message)
                # What the robot knows of its joints when the picture is taken, which arrives later.
                joints[session.ticks - 1] = session.sensors.positions(state).copy()
        (tick, depth), *_ = taken
        now = replace(situation(), position=frozen(joints[tick]))
        return self._correct(looks, sight, now, depth)

    def corrected(self, plan: StepPlan) -> PlanningState:
        """The state after a plan, with what it located at its new pose."""
        located = {motion.looks.object for motion in plan.motions if motion.looks is not None}
        return put(self._planner, plan.end, {name: self._belief.pose(name) for name in located})

    def _correct(self, looks: Look, sight: CameraSight, now: PlanningState, depth: Array) -> Found:
        planner, name = self._planner, looks.object
        body = planner.scene.body(name)
        assert body.known is not None  # checked before the run
        known, before = body.known, planner.body_pose(now, name)
        region = known.half if known.radius is None else np.array([known.radius, known.radius, 0.0])
        view = DepthView(sight.lens, sight.pose(now), depth, sight.noise(depth))
        expected = sight.background(now, [name, *planner.contents(now, name)])
        try:
            found = localise(view, Prior(body, before, region, known.rotation), expected)
        except NotSeen as missing:
            return Found(f"'{looks.sensor}' does not show '{name}': {missing.reason}")
        start = planner.starts.get(name, body.X_WO)
        if np.allclose(before.p, start.p, atol=UNMOVED) and np.allclose(before.R, start.R, atol=UNMOVED):
            planner.starts[name] = found.X_WO
        self._belief.update(name, found.X_WO, found.covariance)
        self._recorder.believed(self._session.ticks, name, found.X_WO, found.covariance)
        away, turned = between(before, found.X_WO, round_as="" if found.free is None else body.kind)
        return Found("", f"'{name}' is {mm(away)} and {deg(turned)} from where it was believed ({_quality(found)})")

    @contextmanager
    def _pictures(self, camera: str) -> Iterator[list[tuple[int, Array]]]:
        """Inside, collects the depth pictures (h, w) [m] of a camera that are taken from now on, with their ticks."""
        sensors, began = self._session.sensors, self._session.ticks
        before, found = sensors.deliver, list[tuple[int, Array]]()

        def deliver(tick: int, taken: int, name: str, picture: Picture) -> None:
            before(tick, taken, name, picture)
            if name == camera and picture.suffix == DEPTH and taken >= began:
                found.append((taken, metres(picture)))

        sensors.deliver = deliver
        try:
            yield found
        finally:
            sensors.deliver = before


def _quality(found: Localisation) -> str:
    sigma = math.sqrt(float(found.covariance[5, 5]))
    unsure = (
        f"; the picture does not show its rotation, +-{deg(sigma)}" if found.free is None and sigma > UNSURE else ""
    )
    residual = readable(found.residual, "m")
    return f"residual {residual}, inliers {share(round(found.inliers, 2))} of {found.pixels} pixels{unsure}"
