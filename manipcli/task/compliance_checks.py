"""Checks of the arm of a task with compliant steps: what it takes, and how it feels a force."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.conditions.sensed import FELT
from manipcli.control.compliant_build import compliant_joints
from manipcli.core.errors import Diagnostic
from manipcli.core.text import listed
from manipcli.model.robot import RobotModel
from manipcli.plan.steps import STEPS
from manipcli.simulate.engines import ENGINES
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.felt import wrist_sensor
from manipcli.task.task import all_sensors

NO_ARM, NOT_FELT, RIGID, TAKEN = 340, 341, 342, 343
"""Numbers of the codes of the findings."""
STIFF_DRIVES = "pybullet"
"""The engine in which a position drive reaches its position with any force that its effort limit allows."""


def compliance_findings(
    task: Located[TaskSpec],
    robot_file: Located[RobotSpec],
    controllers: Located[ControllersSpec],
    robot: RobotModel,
) -> Iterator[Diagnostic]:
    """Errors for an arm that cannot comply, or does not feel; a warning for one that cannot regulate a force."""
    spec = task.spec
    at = next((k for k, step in enumerate(spec.steps) if STEPS[step.verb].compliant(step.body)), None)
    if at is None or robot.tool is None or ENGINES[spec.simulation.engine].physics != "full":
        return
    verb = spec.steps[at].verb
    loc = ("steps", at, verb)
    for what, names in (("controller", controllers.spec.controllers), ("sensor", all_sensors(robot_file.spec, spec))):
        if FELT in names:
            message = f"the {what} '{FELT}' has the name of the force that the arm feels in `{verb}`"
            yield task.source.finding(TAKEN, loc, message, hint=f"rename the {what}")
    arm = compliant_joints(controllers.spec, robot)
    if arm is None:
        message = f"`{verb}` needs a controller that follows trajectories of all joints from the base to the tool"
        hint = "give them to one controller of type `joint_trajectory` in the controllers file"
        yield task.source.finding(NO_ARM, loc, message, hint=hint)
        return
    if arm.efforts:
        return
    if arm.spec.interfaces[0] != "position":
        message = f"`{verb}` needs an arm that takes efforts or positions; controller '{arm.follower}' commands "
        hint = f"set `command_interface: effort` for '{arm.follower}'"
        yield task.source.finding(NO_ARM, loc, message + listed(arm.spec.interfaces), hint=hint)
    elif wrist_sensor(robot, controllers.spec, all_sensors(robot_file.spec, spec)) is None:
        message = f"`{verb}` feels no force: the arm takes positions, and no `force_torque` sensor is at its wrist"
        link = robot.joint(arm.joints[-1]).child
        hint = f"add `sensors: {{wrist: {{type: force_torque, link: {link}}}}}` to the task, or command efforts"
        yield task.source.finding(NOT_FELT, loc, message, hint=hint)
    elif spec.simulation.engine == STIFF_DRIVES:
        message = (
            f"`{verb}` regulates no force on rigid bodies: in `{STIFF_DRIVES}` contacts and position drives are rigid"
        )
        hint = "use `engine: mujoco`, whose contacts yield, or command efforts"
        yield task.source.finding(RIGID, loc, message, hint=hint, severity="warning")
