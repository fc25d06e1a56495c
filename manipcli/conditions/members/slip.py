"""`slip`: motion of an object in the hand while two links press on it."""

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
    Monitor,
    Problem,
    World,
    unknown_body,
    unmoving,
    unpinched,
    untouchable,
)
from manipcli.conditions.robustness import Mask, Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, matrix_from_quat
from manipcli.core.prose import amount, named
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.grasp import GRIP_FORCE, pinch_force
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import LinkName, MovableName
from manipcli.spec.quantity import AngleTolerance, Force, Length

LET_GO = 0.1
"""[s] After a longer interruption of its contacts an object counts as newly grasped."""


class SlipSpec(Model):
    """Since its grasp the object moved in the hand by at most `within` and rotated by at most `rotation`."""

    renamed: ClassVar = {"turn": "rotation"}

    object: MovableName = Field(description="A movable body of the scene.")
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest motion of its centre [m].")
    rotation: AngleTolerance | None = Field(default=None, description="Largest rotation [rad], to pi. Default: any.")
    grip: Annotated[Force, Field(gt=0)] = Field(
        default=GRIP_FORCE, description="Held: two links press on it with at least this force each [N]. Default 0.1 N."
    )
    link: LinkName | None = Field(default=None, description="Link of the hand. Default: that of the tool.")


class _Hold:
    """The pose of the object in the hand L at its grasp."""

    def __init__(self, spec: SlipSpec, world: World) -> None:
        self._spec = spec
        self._world = world
        self._link = hand(spec, world.robot)
        self._k = world.scene.movable.index(world.scene.body(spec.object))
        self._taken: tuple[Array, Array] | None = None
        self._last = -np.inf

    def slipped(self, window: StateWindow, held: Mask) -> tuple[Array, Array]:
        """(T,) motion [m] and rotation [rad] since the grasp; zero where it is not held."""
        far, rotated = np.zeros(len(held)), np.zeros(len(held))
        ticks = np.flatnonzero(held)
        if not len(ticks):
            return far, rotated
        p, R = self._in_hand(window, ticks)
        times = window.times[ticks]
        grasped = np.flatnonzero(np.diff(times, prepend=self._last) > LET_GO)
        self._last = float(times[-1])
        for first, last in pairwise([*([] if len(grasped) and grasped[0] == 0 else [0]), *grasped, len(ticks)]):
            if self._taken is None or first in grasped:
                self._taken = p[first], R[first]
            part = ticks[first:last]
            far[part] = np.linalg.norm(p[first:last] - self._taken[0], axis=-1)
            rotated[part] = _angle(self._taken[1].T @ R[first:last])
        return far, rotated

    def _in_hand(self, window: StateWindow, ticks: npt.NDArray[np.intp]) -> tuple[Array, Array]:
        """p_LC (T, 3) of the object's centre C, and R_LO (T, 3, 3)."""
        states = window.states.map(lambda a: a[ticks])
        X = [self._world.kinematics.forward(q, self._link) for q in states.position]
        R_LW = np.stack([X_WL.R.T for X_WL in X])
        p_WC = centres(self._world.scene, states, self._spec.object) - np.stack([X_WL.p for X_WL in X])
        return (R_LW @ p_WC[..., None])[..., 0], R_LW @ matrix_from_quat(states.body_quat_xyzw[:, self._k])


def _angle(R: Array) -> Array:
    """(T,) angles [rad] of rotations (T, 3, 3), exact near 0: atan2(2 sin, 2 cos)."""
    skew = R - R.swapaxes(-1, -2)
    sine = np.sqrt(skew[..., 2, 1] ** 2 + skew[..., 0, 2] ** 2 + skew[..., 1, 0] ** 2)
    return np.asarray(np.arctan2(sine, np.trace(R, axis1=-2, axis2=-1) - 1.0))


def hand(spec: SlipSpec, robot: RobotModel) -> str:
    """The link in whose frame the motion is measured."""
    return spec.link or (robot.tool.link if robot.tool is not None else robot.root)


def monitor(spec: SlipSpec, world: World) -> Monitor:
    """`within` minus the motion of the object's centre in the hand [m]; `rotation` minus its rotation [rad]; the
    lesser.

    Slip counts from the first tick on which the object is held; ticks without a grasp are ignored. A closing hand moves
    the object: to exclude this, use `during:` with the steps after the grasp.
    """
    hold = _Hold(spec, world)

    def look(window: StateWindow) -> Robustness:
        held = window.of_contacts(lambda contacts: pinch_force(contacts, spec.object)) >= spec.grip
        far, rotated = hold.slipped(window, held)
        idle = f"'{spec.object}' was never held by two links with {readable(spec.grip, 'N')} each"

        def moved(k: int) -> str:
            return f"'{spec.object}' slipped by {readable(float(far[k]), 'm')}; within {readable(spec.within, 'm')}"

        readings = [
            robustness(
                spec.within - far, window.times, unit="m", scale=spec.within, describe=moved, applies=held, idle=idle
            )
        ]  # fmt: skip
        if spec.rotation is not None:
            limit = spec.rotation

            def twisted(k: int) -> str:
                angle = readable(float(rotated[k]), "rad")
                return f"'{spec.object}' rotated in the hand by {angle}; within {readable(limit, 'rad')}"

            readings.append(
                robustness(
                    limit - rotated, window.times, unit="rad", scale=limit, describe=twisted, applies=held, idle=idle
                )
            )
        return least(readings)

    return look


def check(spec: SlipSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown or fixed body, or an unknown link."""
    problems = unknown_body(context.scene, spec.object, ("object",), movable=True) + unpinched(context, "slip")
    links = [link.name for link in context.robot.links]
    if spec.link is not None and spec.link not in links:
        message = f"'{spec.link}' is not a link of robot '{context.robot.name}'"
        return (*problems, Problem(("link",), message, did_you_mean(spec.link, links)))
    if spec.link is None and context.robot.tool is None:
        message = f"robot '{context.robot.name}' has no tool"
        return (*problems, Problem((), message, "name the hand's `link` here, or add a `tool` to the robot file"))
    return problems


def clause(spec: SlipSpec, robot: RobotModel) -> str:
    turned = "" if spec.rotation is None else f" and rotated by at most {amount(spec.rotation, 'rad')}"
    return (
        f"since its grasp, {named(spec.object)} has slipped in the hand by at most {amount(spec.within, 'm')}{turned}"
    )


SLIP = Condition(
    name="slip",
    spec=SlipSpec,
    units=("m", "rad"),
    open=monitor,
    check=check,
    absent=lambda spec, world: untouchable(world) or unmoving(world, (spec.object,)),
    scope="always",
    clause=clause,
    example="slip: {object: cup, within: 5 mm, rotation: 5 deg}",
)
