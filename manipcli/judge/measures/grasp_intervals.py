"""Grasp intervals of a recording: when a body was held, contact forces, and its slip in the hand.

A body is held while links of the robot touch it. It is carried while it is held and has no support: no contact with a
fixed body, directly or through other bodies. Both come from the recorded contacts alone, not from the steps. A body
that was touched and never carried counts as held only if the hand closed meanwhile; else it was pushed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from manipcli.conditions.state_window import ROUNDING
from manipcli.core.geometry import Array, quat_product, rotate, rotate_inverse
from manipcli.model.batch_kinematics import tool_poses
from manipcli.model.grasp import BRIDGED, LINK, pressing
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.plan.motion import CLOSING
from manipcli.record.recording import ContactSnapshot, Recording, Span, TaskEvent
from manipcli.scene.scene import Scene

SHORTEST = 0.1
"""[s] Least duration of a hold, and of a time without support."""

Ending = Literal["set down", "lost", "let go", "held to the end"]


@dataclass(frozen=True, slots=True)
class Hold:
    """A body in contact with the robot.

    Attributes:
        body: its name.
        grasped: [s] end of the motion that closed the hand; slip counts from here.
        lifted: [s] when it lost its support; None if it never did.
        until: [s] when it was supported again, or no longer touched.
        ended: `set down`: supported while held; `lost`: without support when the last contact ended; `let go`: never
            lifted.
    """

    body: str
    grasped: float
    lifted: float | None
    until: float
    ended: Ending


@dataclass(frozen=True, slots=True)
class Spread:
    """Least, time-weighted mean and greatest value of a number."""

    least: float
    mean: float
    most: float


@dataclass(frozen=True, slots=True)
class Slip:
    """Displacement [m or rad]: the largest, its time [s], and the last."""

    most: float
    at: float
    last: float


@dataclass(frozen=True, slots=True)
class GraspFacts:
    """A hold, measured from `grasped` to `until`.

    Attributes:
        hold: the body and its times.
        force: sum of the normal forces [N] of the robot's links on the body.
        touching: number of links in contact with it.
        links: their names, the largest force first.
        slip: of the body's centre in the tool frame since `grasped` [m]; None if unknown.
        rotation: of the body in the tool frame since `grasped` [rad]; None if unknown.
    """

    hold: Hold
    force: Spread
    touching: Spread
    links: tuple[str, ...]
    slip: Slip | None
    rotation: Slip | None


def find_grasps(recording: Recording, scene: Scene) -> tuple[tuple[Hold, ...], float]:
    """All holds of a recording in order of time, in one pass, and the time [s] of its last tick."""
    movable = [body.name for body in scene.movable]
    fixed = {body.name for body in scene.bodies if body.fixed}
    touched = {name: _Intervals() for name in movable}
    free = {name: _Intervals() for name in movable}
    start, end = 0.0, 0.0
    first = True
    for span in recording.spans:
        if len(span.states.time):
            start = float(span.states.time[0]) if first else start
            first, end = False, float(span.states.time[-1])
        for snapshot in span.contacts:
            on_robot = {name for pair in _pressing(snapshot.contacts, robot=True) for name in pair}
            supported = _supported(snapshot.contacts, fixed)
            for name in movable:
                touched[name].add(snapshot.time, name in on_robot)
                free[name].add(snapshot.time, name not in supported)
    found = []
    for name in movable:
        for begin, stop in touched[name].finish(end):
            if stop - begin >= SHORTEST:
                hold = _hold(name, begin, stop, free[name].finish(end), recording.events, end)
                if hold.lifted is not None or _closed_within(begin, stop, recording.events):
                    found.append(hold)
    return tuple(sorted(found, key=lambda hold: hold.grasped)), end


def _hold(
    name: str, begin: float, stop: float, free: Sequence[tuple[float, float]], events: Sequence[TaskEvent], end: float
) -> Hold:
    carried = [(max(a, begin), min(b, stop)) for a, b in free if min(b, stop) - max(a, begin) >= SHORTEST]
    boundaries = [event.time for event in events if begin - ROUNDING <= event.time <= stop]
    if not carried:
        grasped = min(boundaries, default=begin)
        return Hold(name, grasped, None, stop, "held to the end" if stop >= end else "let go")
    lifted, until = carried[0][0], carried[-1][1]
    ended: Ending = "set down" if until < stop else "held to the end" if stop >= end else "lost"
    return Hold(name, max((at for at in boundaries if at <= lifted), default=lifted), lifted, until, ended)


def _closed_within(begin: float, stop: float, events: Sequence[TaskEvent]) -> bool:
    """Whether the hand closed between these times; True for a recording without phases, where this is unknown."""
    phases = [event for event in events if event.kind in ("phase_started", "step_ended")]
    closing = [(phase.time, after.time) for phase, after in pairwise([*phases, *phases[-1:]]) if phase.text == CLOSING]
    return not phases or any(since <= stop and until >= begin for since, until in closing)


def _pressing(contacts: Iterable[Contact], *, robot: bool) -> list[tuple[str, str]]:
    """Pairs in contact, either with a link of the robot (`robot`) or without."""
    return [(c.a, c.b) for c in contacts if c.force > 0.0 and (c.a.startswith(LINK) or c.b.startswith(LINK)) == robot]


def _supported(contacts: Iterable[Contact], fixed: set[str]) -> set[str]:
    """Every body supported by a fixed body or by the floor, directly or through others."""
    pairs = _pressing(contacts, robot=False)
    carried = {name for pair in pairs for name in pair if name in fixed or name == "floor"}
    while more := {name for pair in pairs if carried & set(pair) for name in pair} - carried:
        carried |= more
    return carried


class _Intervals:
    """Time intervals in which a value is true; gaps up to `BRIDGED` are closed."""

    def __init__(self) -> None:
        self._done: list[tuple[float, float]] = []
        self._since: float | None = None

    def add(self, time: float, value: bool) -> None:
        if value and self._since is None:
            self._since = time
            if self._done and time - self._done[-1][1] <= BRIDGED:
                self._since = self._done.pop()[0]
        elif not value and self._since is not None:
            self._done.append((self._since, time))
            self._since = None

    def finish(self, end: float) -> list[tuple[float, float]]:
        last = [] if self._since is None else [(self._since, end)]
        return self._done + last


class GraspMeter:
    """Measures a hold over successive spans of the recording.

    Args:
        hold: the hold to measure.
        robot, scene: of the log.
        joints: indices of the robot's joints in the recorded arrays.
    """

    def __init__(self, hold: Hold, robot: RobotModel, scene: Scene, joints: Sequence[int]) -> None:
        self._hold = hold
        self._robot = robot
        self._joints = list(joints)
        self._body = [body.name for body in scene.movable].index(hold.body)
        self._centre = scene.body(hold.body).centre
        self._force = _Weighted()
        self._touching = _Weighted()
        self._links: dict[str, float] = {}
        self._now: tuple[float, dict[str, float]] | None = None
        self._slip, self._rotation = _Farthest(), _Farthest()
        self._origin: tuple[Array, Array] | None = None

    def add(self, span: Span, bodies: Mapping[str, int]) -> None:
        """Add the next span; `bodies`: indices of bodies in the recorded arrays."""
        for snapshot in span.contacts:
            self._contacts(snapshot)
        times = span.states.time
        mine = np.flatnonzero((times >= self._hold.grasped - ROUNDING) & (times <= self._hold.until + ROUNDING))
        if not len(mine) or self._robot.tool is None:
            return
        p_WT, q_WT = tool_poses(self._robot, span.states.position[mine][:, self._joints])
        column = bodies[self._hold.body]
        q_WO = span.states.body_quat_xyzw[mine, column]
        p_WC = span.states.body_position[mine, column] + rotate(q_WO, self._centre)
        if not np.isfinite(p_WC).all():
            return
        p_TC = rotate_inverse(q_WT, p_WC - p_WT)
        q_TO = quat_product(q_WT * (-1.0, -1.0, -1.0, 1.0), q_WO)
        if self._origin is None:
            self._origin = (p_TC[0].copy(), q_TO[0].copy())
        p0, q0 = self._origin
        self._slip.add(times[mine], np.linalg.norm(p_TC - p0, axis=1))
        between = quat_product(q0 * (-1.0, -1.0, -1.0, 1.0), q_TO)
        angle = 2.0 * np.arctan2(np.linalg.norm(between[:, :3], axis=1), np.abs(between[:, 3]))
        self._rotation.add(times[mine], angle)

    def _contacts(self, snapshot: ContactSnapshot) -> None:
        self._pass(snapshot.time)
        found = pressing(snapshot.contacts, self._hold.body)
        self._now = (snapshot.time, {link.removeprefix(LINK): force for force, link in found})

    def _pass(self, time: float) -> None:
        """Weight the current contacts by their duration up to `time`."""
        if self._now is None:
            return
        since, forces = self._now
        seconds = min(time, self._hold.until) - max(since, self._hold.grasped)
        if seconds > 0.0:
            self._force.add(sum(forces.values()), seconds)
            self._touching.add(len(forces), seconds)
            for link, force in forces.items():
                self._links[link] = max(force, self._links.get(link, 0.0))

    def finish(self) -> GraspFacts:
        """The measurements of the hold."""
        self._pass(self._hold.until)
        return GraspFacts(
            self._hold,
            force=self._force.spread(),
            touching=self._touching.spread(),
            links=tuple(sorted(self._links, key=lambda link: -self._links[link])),
            slip=self._slip.found(),
            rotation=self._rotation.found(),
        )


class _Weighted:
    def __init__(self) -> None:
        self._least, self._most = np.inf, -np.inf
        self._sum = self._time = 0.0

    def add(self, value: float, seconds: float) -> None:
        self._least, self._most = min(self._least, value), max(self._most, value)
        self._sum += value * seconds
        self._time += seconds

    def spread(self) -> Spread:
        return Spread(self._least, self._sum / self._time, self._most) if self._time else Spread(0.0, 0.0, 0.0)


class _Farthest:
    def __init__(self) -> None:
        self._slip: Slip | None = None

    def add(self, times: Array, values: Array) -> None:
        k = int(np.argmax(values))
        last = float(values[-1])
        if self._slip is None or values[k] > self._slip.most:
            self._slip = Slip(float(values[k]), float(times[k]), last)
        else:
            self._slip = Slip(self._slip.most, self._slip.at, last)

    def found(self) -> Slip | None:
        return self._slip
