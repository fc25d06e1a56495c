"""Are the gains of a task stable at its control period? Looked at where the robot starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manipcli.control.stability import damping_findings
from manipcli.core.errors import Finding
from manipcli.flow.load import Task
from manipcli.flow.plan import start_position
from manipcli.model.kinematics import Kinematics
from manipcli.spec.controllers import GripperSpec, JointTrajectorySpec


def gain_findings(task: Task) -> tuple[Finding, ...]:
    """A warning for every joint whose damping gain rings or diverges at the control period.

    The inertia that a joint's own torque meets while all others are free is 1 / (M^-1)_jj, the smallest it can be in
    this posture.
    """
    robot, file = task.robot, task.controllers_file
    inertia = 1.0 / np.diag(np.linalg.inv(Kinematics(robot).mass_matrix(start_position(task))))
    findings: list[Finding] = []
    for name, spec in task.controllers.controllers.items():
        if "effort" not in spec.interfaces or not isinstance(spec, JointTrajectorySpec | GripperSpec):
            continue
        for joint, gains in spec.gains.items():
            place = file.place("controllers", name, "gains", joint)
            found = damping_findings(
                [joint],
                [gains.d],
                step=task.spec.simulation.control_period,
                inertia=inertia[robot.indices((joint,))],
            )
            findings += [replace(finding, place=place) for finding in found]
    return tuple(findings)
