"""The felt force of tasks with compliant steps, as conditions see it."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.conditions.sensed import FELT, FELT_FORCE, NO_SENSORS, Sensed
from manipcli.control.compliant_build import WristSensor, compliant_joints
from manipcli.model.robot import RobotModel
from manipcli.plan.steps import STEPS
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.sensors import SensorSpec
from manipcli.spec.task import TaskSpec


def wrist_sensor(
    robot: RobotModel, controllers: ControllersSpec, sensors: Mapping[str, SensorSpec]
) -> WristSensor | None:
    """The first `force_torque` sensor between the last joint of the compliant arm and the tool; None without one."""
    arm = compliant_joints(controllers, robot)
    if arm is None or robot.tool is None:
        return None
    beyond = robot.descendants(robot.joint(arm.joints[-1]).child)
    for name, spec in sensors.items():
        if spec.type != "force_torque" or not isinstance(spec, MountedSpec) or spec.link is None:
            continue
        if spec.link in beyond and robot.tool.link in robot.descendants(spec.link):
            return WristSensor(name, spec.link, spec.at.transform)
    return None


def complies(task: TaskSpec) -> bool:
    """Whether a step of the task is compliant, so that the arm has a compliant controller."""
    return any(STEPS[step.verb].compliant(step.body) for step in task.steps)


def felt(task: TaskSpec) -> Mapping[str, Sensed]:
    """The felt force by its name; empty for a task without compliant steps."""
    return {FELT: FELT_FORCE} if complies(task) else NO_SENSORS
