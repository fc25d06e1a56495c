"""What one visitor of the page commands: sliders and poses, as motions of the robot at a limited rate."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.live.command import Answer, Command
from manipcli.live.offer import Offer
from manipcli.live.page.drive import Drive
from manipcli.live.page.snapshot import Snapshot
from manipcli.model.robot import RobotModel

PERIOD: Final = 0.1
"""[s] of wall time between two commands of the same drive."""
SETTLING: Final = 0.3
"""[s] Simulated time after a motion, and wall time after a drag, in which sliders keep their values."""
_GOALS = count(1)


@dataclass(slots=True)
class _Motion:
    """Of one drive: values of sliders that wait, and the last target, sent at `began` and reached before `until` [s] of
    simulated time; wall times of the last change of a slider and of the last command [s]."""

    waiting: dict[str, float] = field(default_factory=dict)
    dragged: bool = False
    target: Array | None = None
    began: float = 0.0
    until: float = 0.0
    touched: float = -np.inf
    sent: float = -np.inf

    def is_over(self, time: float) -> bool:
        """Whether the target counts no more; also before `began`, after a reset."""
        return self.target is None or not self.began <= time < self.until


class Controls:
    """Motions of one visitor.

    Args:
        robot: has the named poses.
        drives: that can be moved.
        offer: of the session.
        put: hands a command to the control loop; False if too many wait.
        answered: called with the name of what was commanded and its answer, in the thread of the control loop.

    Callbacks of the browser ask for motions; the thread of the page sends them.
    """

    def __init__(
        self,
        robot: RobotModel,
        drives: Sequence[Drive],
        offer: Offer,
        put: Callable[[Command], bool],
        answered: Callable[[str, Answer], None],
    ) -> None:
        self._robot, self._offer = robot, offer
        self._put, self._answered = put, answered
        self._lock = threading.Lock()
        self._pose: str | None = None
        self._motions = {drive.controller: _Motion() for drive in drives}
        self.drives = tuple(drives)

    @property
    def poses(self) -> dict[str, list[str]]:
        """Named poses of the robot that move a drive: under "hand" those that move hands alone, the others "robot"."""
        found: dict[str, list[str]] = {}
        for pose in self._robot.poses:
            moved = [drive for drive in self.drives if set(drive.joints) & set(pose.joints)]
            if moved:
                found.setdefault("hand" if all(drive.hand for drive in moved) else "robot", []).append(pose.name)
        return found

    def slide(self, drive: Drive, joint: str, value: float, now: float) -> None:
        """Move a joint to `value` [rad or m] at the next `send`; `now`: wall time [s]."""
        motion = self._motions[drive.controller]
        with self._lock:
            if np.isfinite(value):
                motion.waiting[joint] = value
                motion.touched, motion.dragged = now, True

    def go(self, pose: str) -> None:
        """Move to a named pose at the next `send`, with the drives that have its joints: with all of them or none."""
        with self._lock:
            self._pose = pose

    def send(self, snapshot: Snapshot, now: float) -> None:
        """Send what waits, at most every `PERIOD` of wall time; what cannot be moved now is dropped, and reported."""
        self._take_pose(snapshot)
        for drive in self.drives:
            motion = self._motions[drive.controller]
            if not motion.waiting or now - motion.sent < PERIOD:
                continue
            with self._lock:
                waiting, motion.waiting = motion.waiting, {}
            if obstacle := snapshot.obstacle(drive.controller):
                self._not_moved(drive.controller, obstacle)
                continue
            here, velocity = snapshot.reference(drive)
            rest = here if motion.target is None or motion.is_over(snapshot.time) else motion.target
            target = drive.target(rest, waiting)
            seconds = drive.duration(here, velocity, target)
            motion.sent, motion.target = now, target
            motion.began, motion.until = snapshot.time, snapshot.time + seconds + SETTLING
            self.put(drive.controller, drive.command(target, seconds, self._offer, id_=f"page.{next(_GOALS)}"))

    def _take_pose(self, snapshot: Snapshot) -> None:
        with self._lock:
            pose, self._pose = self._pose, None
        if pose is None:
            return
        named = self._robot.pose(pose)
        values = dict(zip(named.joints, named.positions, strict=True))
        moved = [drive for drive in self.drives if values.keys() & set(drive.joints)]
        if obstacle := next(filter(None, (snapshot.obstacle(drive.controller) for drive in moved)), ""):
            self._not_moved(pose, obstacle)
            return
        with self._lock:
            for drive in moved:
                motion = self._motions[drive.controller]
                motion.waiting = {joint: values[joint] for joint in drive.joints if joint in values}
                motion.dragged = False

    def _not_moved(self, name: str, obstacle: str) -> None:
        self.refused(name)
        self._answered(name, Answer(False, {}, text=f"{obstacle}: not moved"))

    def put(self, name: str, command: Command | None) -> None:
        """Hand over a command, whose failure is reported under a name."""
        if command is None:
            return
        given = replace(command, answer=lambda answer: self._answered(name, answer))
        if not self._put(given):
            self._answered(name, Answer(False, {}, text="too many commands wait for the next tick"))

    def refused(self, controller: str) -> None:
        """A motion was refused: its sliders follow the robot again."""
        if controller in self._motions:
            self._motions[controller].target = None

    def follows(self, drive: Drive, snapshot: Snapshot, now: float) -> bool:
        """Whether the sliders of a drive show the robot: nobody moves them, and the motion that they sent is over."""
        motion = self._motions[drive.controller]
        touched = bool(motion.waiting) or now - motion.touched < SETTLING
        return not touched and (not motion.dragged or motion.is_over(snapshot.time))
