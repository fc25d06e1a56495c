"""`slip`: how far an object moved in the hand while two links pinch it; not whether it is carried, see `grasp`."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from manipcli.conditions.body_poses import centres
from manipcli.conditions.condition import (
    CheckContext,
    Condition,
    Gauge,
    Problem,
    World,
    unknown_body,
    unmoving,
    untouchable,
)
from manipcli.conditions.robustness import Mask, Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, matrix_from_quat
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.grasp import GRIP_FORCE, pinch_force
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.quantity import AngleTolerance, Force, Length

LET_GO = 0.1
"""[s] An object that was not held for as long is grasped anew."""


class SlipSpec(Model):
    """Since it was grasped the object moved in the hand by at most `within`, and rotated by at most `rotation`."""

    renamed: ClassVar = {"turn": "rotation"}

    object: str = Field(description="A body of the scene that can move.")
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest motion of its centre [m].")
    rotation: AngleTolerance | None = Field(default=None, description="Largest rotation [rad], to pi. Default: any.")
    grip: Annotated[Force, Field(gt=0)] = Field(
        default=GRIP_FORCE, description="It is held while two links press on it with at least this [N]. Default 0.1 N."
    )
    link: str | None = Field(default=None, description="The link that moves with the hand. Default: that of the tool.")


class _Hold:
    """Where the object was in the hand L when the hand took it."""

    def __init__(self, spec: SlipSpec, world: World) -> None:
        self._spec = spec
        self._world = world
        self._link = hand(spec, world.robot)
        self._k = world.scene.movable.index(world.scene.body(spec.object))
        self._taken: tuple[Array, Array] | None = None
        self._last = -np.inf

    def slipped(self, window: StateWindow, held: Mask) -> tuple[Array, Array]:
        """(T,) motion [m] and rotation [rad] since it was taken; zero where it is not held."""
        far, rotated = np.zeros(len(held)), np.zeros(len(held))
        ticks = np.flatnonzero(held)
        if not len(ticks):
            return far, rotated
        p, R = self._in_hand(window, ticks)
        times = window.times[ticks]
        anew = np.flatnonzero(np.diff(times, prepend=self._last) > LET_GO)
        self._last = float(times[-1])
        for first, last in pairwise([*([] if len(anew) and anew[0] == 0 else [0]), *anew, len(ticks)]):
            if self._taken is None or first in anew:
                self._taken = p[first], R[first]
            one = ticks[first:last]
            far[one] = np.linalg.norm(p[first:last] - self._taken[0], axis=-1)
            rotated[one] = _angle(self._taken[1].T @ R[first:last])
        return far, rotated

    def _in_hand(self, window: StateWindow, ticks: npt.NDArray[np.intp]) -> tuple[Array, Array]:
        """p_LC (T, 3) of the object's centre C, and R_LO (T, 3, 3)."""
        states = window.states.map(lambda a: a[ticks])
        X = [self._world.kinematics.forward(q, self._link) for q in states.position]
        R_LW = np.stack([one.R.T for one in X])
        p_WC = centres(self._world.scene, states, self._spec.object) - np.stack([one.p for one in X])
        return (R_LW @ p_WC[..., None])[..., 0], R_LW @ matrix_from_quat(states.body_quat_xyzw[:, self._k])


def _angle(R: Array) -> Array:
    """(T,) angles [rad] of rotations (T, 3, 3), exact near 0: atan2(2 sin, 2 cos)."""
    skew = R - R.swapaxes(-1, -2)
    sine = np.sqrt(skew[..., 2, 1] ** 2 + skew[..., 0, 2] ** 2 + skew[..., 1, 0] ** 2)
    return np.asarray(np.arctan2(sine, np.trace(R, axis1=-2, axis2=-1) - 1.0))


def hand(spec: SlipSpec, robot: RobotModel) -> str:
    """The link that the motion is measured in."""
    return spec.link or (robot.tool.link if robot.tool is not None else robot.root)


def monitor(spec: SlipSpec, world: World) -> Gauge:
    """`within` minus the motion of the object's centre in the hand [m]; `rotation` minus its rotation there [rad]; the
    lesser.

    It counts from the first tick that is looked at on which the object is held, and says nothing while it is not. A
    hand that still closes moves the object: for what slips from then on, say `during:` with the steps after the grasp.
    """
    hold = _Hold(spec, world)

    def look(window: StateWindow) -> Robustness:
        held = window.of_contacts(lambda contacts: pinch_force(contacts, spec.object)) >= spec.grip
        far, rotated = hold.slipped(window, held)
        idle = f"the robot never held '{spec.object}' between two links with {readable(spec.grip, 'N')}"

        def moved(k: int) -> str:
            return f"'{spec.object}' slipped by {readable(float(far[k]), 'm')}; within {readable(spec.within, 'm')}"

        readings = [
            robustness(
                spec.within - far, window.times, unit="m", scale=spec.within, say=moved, applies=held, idle=idle
            )
        ]  # fmt: skip
        if spec.rotation is not None:
            limit = spec.rotation

            def twisted(k: int) -> str:
                angle = readable(float(rotated[k]), "rad")
                return f"'{spec.object}' rotated in the hand by {angle}; within {readable(limit, 'rad')}"

            readings.append(
                robustness(limit - rotated, window.times, unit="rad", scale=limit, say=twisted, applies=held, idle=idle)
            )
        return least(readings)

    return look


def check(spec: SlipSpec, context: CheckContext) -> tuple[Problem, ...]:
    """The body exists and can move; the hand is known."""
    problems = unknown_body(context.scene, spec.object, ("object",), movable=True)
    links = [link.name for link in context.robot.links]
    if spec.link is not None and spec.link not in links:
        message = f"'{spec.link}' is not a link of robot '{context.robot.name}'"
        return (*problems, Problem(("link",), message, did_you_mean(spec.link, links)))
    if spec.link is None and context.robot.tool is None:
        message = f"robot '{context.robot.name}' has no tool to measure in"
        return (*problems, Problem((), message, "name the hand's `link` here, or a `tool` in the robot file"))
    return problems


SLIP = Condition(
    name="slip",
    spec=SlipSpec,
    units=("m", "rad"),
    open=monitor,
    check=check,
    absent=lambda spec, world: untouchable(world) or unmoving(world, (spec.object,)),
    scope="always",
    example="slip: {object: cup, within: 5 mm, rotation: 5 deg}",
)
