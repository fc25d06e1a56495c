"""The joint that falls because its motor is too weak for its own arm's weight: the cause of whatever it hits."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from manipcli.control.saturation import EFFORT
from manipcli.core.geometry import Array
from manipcli.model.kinematics import Kinematics
from manipcli.model.motor_limits import motor_effort_limits
from manipcli.simulate.session import Session

FALLEN: Final = 0.02
"""Error of a joint [rad or m] above which it does not hold its reference."""


def effort_shortage(session: Session, gravity: Array) -> str:
    """The joint that gravity overcomes: its effort limit is below its gravity load, and it is away from its reference
    or at that limit in half of all ticks. Empty if there is none.

    Args:
        session: of the run.
        gravity: (3) [m/s^2].
    """
    robot, position = session.robot, session.engine.read().position
    load = np.abs(Kinematics(robot, gravity=gravity).gravity(position))
    limits = motor_effort_limits(robot)
    full = session.saturations_by_kind[EFFORT] >= 0.5 * max(1, session.ticks)
    short = np.flatnonzero((load > limits) & (full | (_errors(session, position) > FALLEN)))
    if not len(short):
        return ""
    j = int(short[np.argmax(load[short] / limits[short])])
    joint = robot.moving_joints[j]
    unit = "N" if joint.type == "prismatic" else "N m"
    return (
        f"joint '{joint.name}' falls for lack of effort: gravity needs {load[j]:.3g} {unit} here, "
        f"its limit is {limits[j]:.3g} {unit}"
    )


def _errors(session: Session, position: Array) -> Array:
    """(n) distance of each joint to its controller's reference, the shorter way round if continuous; 0 without one."""
    names, errors = session.robot.joint_names, np.zeros(len(position))
    for controller, output in zip(session.manager.controllers, session.manager.outputs, strict=False):
        if output is None or not controller.interfaces:
            continue
        for joint, reference in zip(controller.joints, output.position, strict=True):
            k = names.index(joint)
            error = float(reference) - float(position[k])
            if session.robot.joint(joint).type == "continuous":
                error = math.remainder(error, 2.0 * math.pi)
            errors[k] = max(errors[k], abs(error))
    return errors
