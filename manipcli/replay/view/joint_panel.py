"""Sliders of the joints by group, and buttons of the named poses."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.description.elements import Joint
from manipcli.model.configuration import configuration, with_mimics, zero_configuration
from manipcli.model.robot import RobotModel
from manipcli.replay.view.joint_slider import JointSlider, units_of

if TYPE_CHECKING:
    import viser

ZERO, START = "zero", "start"
ROW = 22
"""Characters in a row of buttons."""
FINEST = 1e-5
"""[rad or m] Last digit of positions as text."""


class JointPanel:
    """Sliders of the independent joints and buttons of the named poses.

    Args:
        gui: where they are added.
        robot: the robot.
        q: (n,) initial joint positions.
        moved: called with (n,) joint positions after each movement, never by two threads at once.

    Attributes:
        sliders: sliders by the index of the joint in joint vectors.

    The page calls back in threads of the server; a lock serialises the movements.
    """

    def __init__(self, gui: viser.GuiApi, robot: RobotModel, q: Array, moved: Callable[[Array], None]) -> None:
        self._robot, self._start, self._moved = robot, q, moved
        self._lock = threading.Lock()
        self.sliders: dict[int, JointSlider] = {}
        self._q = q
        names = dict.fromkeys((START, *(pose.name for pose in robot.poses), ZERO))
        for k, row in enumerate(rows(tuple(names), ROW)):
            group = gui.add_button_group(" " if k else "pose", row)
            group.on_click(lambda event: self.go(self.named(event.target.value)))
        for title, joints in _grouped(robot):
            with gui.add_folder(title):
                for joint in joints:
                    self._add(gui, joint)

    def _add(self, gui: viser.GuiApi, joint: Joint) -> None:
        k = self._robot.joint_names.index(joint.name)
        slider = self.sliders[k] = JointSlider(gui, joint, float(self._q[k]))
        slider.on_moved(lambda position: self._slid(k, position))

    @property
    def position(self) -> Array:
        """(n,) shown joint positions."""
        return self._q

    def named(self, name: str) -> Array:
        """(n,) joint positions of a named pose; joints that it does not name keep their position."""
        if any(pose.name == name for pose in self._robot.poses):
            return configuration(self._robot, name, rest=self._q)
        return self._start if name == START else zero_configuration(self._robot)

    def go(self, q: Array) -> None:
        """Show a configuration and set the sliders to it."""
        with self._lock:
            self._place(q)
        # Each assignment calls `_slid`, which finds the joint at this value already.
        for k, slider in self.sliders.items():
            slider.value = float(q[k])

    def _slid(self, k: int, value: float) -> None:
        """Move one joint to its slider; the other sliders are not read, since they can still be moving."""
        with self._lock:
            q = np.array(self._q)
            if not math.isfinite(value) or self.sliders[k].shows(float(q[k])):
                return
            q[k] = value
            self._place(with_mimics(self._robot, q))

    def _place(self, q: Array) -> None:
        self._q = q
        self._moved(q)


def _grouped(robot: RobotModel) -> Iterator[tuple[str, tuple[Joint, ...]]]:
    """Independent joints by group, each once, and then the others."""
    left = {joint.name: joint for joint in robot.moving_joints if joint.independent}
    for group in robot.groups:
        own = tuple(left.pop(name) for name in group.joints if name in left)
        if own:
            yield f"{group.name} [{units_of(own)}]", own
    if left:
        others = tuple(left.values())
        yield f"{'other joints' if robot.groups else 'joints'} [{units_of(others)}]", others


def configuration_text(robot: RobotModel, q: Array) -> str:
    """A configuration as YAML for `poses:` of a robot file: a list per group, or by joint name without groups."""
    joints = robot.moving_joints
    value = {joint.name: _number(joint, float(number)) for joint, number in zip(joints, q, strict=True)}
    if robot.groups:
        parts = [f"{group.name}: [{', '.join(value[name] for name in group.joints)}]" for group in robot.groups]
    else:
        parts = [f"{joint.name}: {value[joint.name]}" for joint in joints if joint.independent]
    return "\n".join(parts)


def _number(joint: Joint, position: float) -> str:
    """To `FINEST`, and within the limits also after rounding."""
    rounded = round(position / FINEST)
    lower, upper = joint.limits.lower, joint.limits.upper
    if upper is not None and rounded * FINEST > upper >= position:
        rounded -= 1
    if lower is not None and rounded * FINEST < lower <= position:
        rounded += 1
    return f"{rounded * FINEST:.10g}"


def rows(names: Sequence[str], most: int) -> list[list[str]]:
    """Names in rows of at most `most` characters, at least one in each."""
    found: list[list[str]] = []
    for name in names:
        if found and sum(map(len, found[-1])) + len(name) <= most and len(found[-1]) < 4:
            found[-1].append(name)
        else:
            found.append([name])
    return found
