"""`tracking`: the joints of a group followed their references."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.core.text import did_you_mean
from manipcli.judge.expectation import Evidence, Expectation, Measured, NotEvaluated, worst
from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.record.recording import Span
from manipcli.spec.base import Model
from manipcli.spec.quantity import JointValue


class TrackingSpec(Model):
    """No joint of the group was ever further than `within` from its controller's reference."""

    group: str = Field(description="A group of the robot; each of its joints must have a controller.")
    within: Annotated[JointValue, Field(gt=0)] = Field(description="Largest difference of a joint [rad or m].")


def evaluate(spec: TrackingSpec, evidence: Evidence, span: Span) -> Measured | NotEvaluated:
    """`within` minus the largest |reference - measured| [rad, or m where the worst joint slides] of joints and run.

    Only while a controller of a joint is active does the joint have a reference.
    """
    robot = evidence.world.robot
    found: Measured | None = None
    for name in robot.group(spec.group).joints:
        unit = "m" if robot.joint(name).type == "prismatic" else "rad"
        traces = [trace for trace in span.controllers if name in trace.joints]
        if not traces:
            reason = f"the recording holds no reference of joint '{name}'"
            left_out = [topic for topic in evidence.absent if topic.endswith("/controller_state")]
            return NotEvaluated(evidence.lacks(left_out[0]) or reason if left_out else reason, unit)
        for trace in traces:
            k = trace.joints.index(name)
            active = ~np.isnan(trace.reference_position[:, k])
            if not active.any():
                continue
            margins = spec.within - np.abs(trace.reference_position[active, k] - trace.position[active, k])
            joint = worst(margins, trace.times[active], unit, f"joint '{name}'")
            if isinstance(joint, NotEvaluated):
                return joint
            if found is None or joint.margin < found.margin:
                found = joint
    if found is None and robot.group(spec.group).joints:
        return Measured(spec.within, unit, float(span.states.time[0]), "no controller of it was active")
    return found or NotEvaluated(f"group '{spec.group}' has no joints")


def check(spec: TrackingSpec, robot: RobotModel, scene: Scene, steps: tuple[str, ...]) -> tuple[Problem, ...]:
    """The robot has the group."""
    groups = [group.name for group in robot.groups]
    if spec.group in groups:
        return ()
    message = f"'{spec.group}' is not a group of robot '{robot.name}'"
    return (Problem(("group",), message, did_you_mean(spec.group, groups)),)


TRACKING = Expectation(name="tracking", spec=TrackingSpec, scope="always", evaluate=evaluate, check=check)
