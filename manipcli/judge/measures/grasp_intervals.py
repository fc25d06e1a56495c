"""How well things were held: from when to when the robot touched a body, how hard, and how it moved in the hand.

A body is held while links of the robot touch it, and carried while, besides, it stands on nothing: neither on a body
that is fixed nor, through others, on one that stands on it. Both come from the recorded contacts alone, whatever the
step was called. What was touched and never carried was held only if the hand closed meanwhile: else it was pushed.
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
"""[s] of a hold, and of a time without support."""

Ending = Literal["set down", "lost", "let go", "held to the end"]


@dataclass(frozen=True, slots=True)
class Hold:
    """A body in contact with the robot.

    Attributes:
        body: its name.
        grasped: [s] when the motion that closed the hand was over: from here on slip counts.
        lifted: [s] when it stood on nothing any more; None where it always did.
        until: [s] when it stood again, or was not touched any more.
        ended: `set down`: while held; `lost`: it was in the air when the last contact ended; `let go`: it was never
            lifted.
    """

    body: str
    grasped: float
    lifted: float | None
    until: float
    ended: Ending


@dataclass(frozen=True, slots=True)
class Spread:
    """Least, greatest and, weighted by time, mean of a number."""

    least: float
    mean: float
    most: float


@dataclass(frozen=True, slots=True)
class Slip:
    """How far something moved: the most, when [s], and at the end; m or rad."""

    most: float
    at: float
    last: float


@dataclass(frozen=True, slots=True)
class GraspFacts:
    """A hold, measured from `grasped` to `until`.

    Attributes:
        hold: what, and when.
        force: sum of the normal forces [N] of the robot's links on the body.
        touching: number of links that touch it.
        links: their names, the one with the largest force first.
        slip: of the middle of the body in the tool frame since `grasped` [m]; None where that is not known.
        rotation: of the body in the tool frame since then [rad].
    """

    hold: Hold
    force: Spread
    touching: Spread
    links: tuple[str, ...]
    slip: Slip | None
    rotation: Slip | None


def find_grasps(recording: Recording, scene: Scene) -> tuple[tuple[Hold, ...], float]:
    """Every hold of a recording, in the order of time, in one pass; and the time [s] of its last tick."""
    movable = [body.name for body in scene.movable]
    standing = {body.name for body in scene.bodies if body.fixed}
    touched = {name: _Stretches() for name in movable}
    free = {name: _Stretches() for name in movable}
    start, end = 0.0, 0.0
    first = True
    for span in recording.spans:
        if len(span.states.time):
            start = float(span.states.time[0]) if first else start
            first, end = False, float(span.states.time[-1])
        for snapshot in span.contacts:
            on_robot = {name for pair in _pressing(snapshot.contacts, robot=True) for name in pair}
            stands = _supported(snapshot.contacts, standing)
            for name in movable:
                touched[name].tell(snapshot.time, name in on_robot)
                free[name].tell(snapshot.time, name not in stands)
    found = []
    for name in movable:
        for begin, stop in touched[name].finish(end):
            if stop - begin >= SHORTEST:
                one = _hold(name, begin, stop, free[name].finish(end), recording.events, end)
                if one.lifted is not None or _closed_within(begin, stop, recording.events):
                    found.append(one)
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
    """Whether the hand closed at any time between these, as far as is known: a recording without steps does not say."""
    phases = [event for event in events if event.kind in ("phase_started", "step_ended")]
    closing = [(phase.time, after.time) for phase, after in pairwise([*phases, *phases[-1:]]) if phase.text == CLOSING]
    return not phases or any(since <= stop and until >= begin for since, until in closing)


def _pressing(contacts: Iterable[Contact], *, robot: bool) -> list[tuple[str, str]]:
    """Pairs that press on each other, with a link of the robot among them or without."""
    return [
        (one.a, one.b)
        for one in contacts
        if one.force > 0.0 and (one.a.startswith(LINK) or one.b.startswith(LINK)) == robot
    ]


def _supported(contacts: Iterable[Contact], standing: set[str]) -> set[str]:
    """Everything that a fixed body carries, also through others; what is no body of the scene (the floor) is fixed."""
    pairs = _pressing(contacts, robot=False)
    carried = {name for pair in pairs for name in pair if name in standing or name == "floor"}
    while more := {name for pair in pairs if carried & set(pair) for name in pair} - carried:
        carried |= more
    return carried


class _Stretches:
    """From when to when something was so; gaps of `BRIDGED` are closed while it is told."""

    def __init__(self) -> None:
        self._done: list[tuple[float, float]] = []
        self._since: float | None = None

    def tell(self, time: float, so: bool) -> None:
        if so and self._since is None:
            self._since = time
            if self._done and time - self._done[-1][1] <= BRIDGED:
                self._since = self._done.pop()[0]
        elif not so and self._since is not None:
            self._done.append((self._since, time))
            self._since = None

    def finish(self, end: float) -> list[tuple[float, float]]:
        last = [] if self._since is None else [(self._since, end)]
        return self._done + last


class GraspMeter:
    """Measures one hold while the spans of the recording go by.

    Args:
        hold: which.
        robot, scene: of the log.
        joints: where the robot's joints stand in the recorded arrays.
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
        """The next span; `bodies`: where each body stands in the recorded arrays."""
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
        """What held until now, for as long as it held."""
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
        """What was measured."""
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
