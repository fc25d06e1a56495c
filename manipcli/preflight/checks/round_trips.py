"""Transmissions whose numbers do not lead from joints to actuators and back: reductions too large or too small."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.model.drivetrain import Drivetrain
from manipcli.preflight.preflight import Check, Subject

EXACT: Final = 1e-9
"""Largest error of a round trip, relative to the joint's motion or effort."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Blocks in which motion or effort, from joints to actuators and back, is not the identity."""
    drivetrain = Drivetrain.of(subject.task.robot)
    names, actuators = subject.task.robot.joint_names, list(drivetrain.names)
    joints = [names[k] for k in drivetrain.joints]
    for block in drivetrain.transmission.blocks:
        its_joints, joints = joints[: block.size], joints[block.size :]
        its_actuators, actuators = actuators[: block.size], actuators[block.size :]
        with np.errstate(all="ignore"):
            trips = (
                block.maps.joint_motion @ block.maps.actuator_motion,
                block.maps.joint_effort @ block.maps.actuator_effort,
            )
        if all(bool((np.abs(trip - np.eye(block.size)) <= EXACT).all()) for trip in trips):
            continue
        message = (
            f"the transmission of {' and '.join(its_joints)} ({' and '.join(its_actuators)}) does not round-trip: "
        )
        message += "its reductions are too large, too small or too unequal for the arithmetic"
        place = subject.task.file.place("robot")
        yield Diagnostic("TASK332", message, place, "check the reductions of the transmission in the description")


CHECK = Check(name="round_trips", codes=("TASK332",), findings=findings, ends=True)
