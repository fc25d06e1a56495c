"""The expectation that every task has unless it sets it otherwise: motors keep away from their effort limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from pydantic import Field

from manipcli.conditions.members.saturation import MOST, SaturationSpec, limited_joints
from manipcli.control.controllers import CONTROLLERS
from manipcli.model.robot import RobotModel
from manipcli.spec.condition import ExpectationSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.task import TaskSpec


class ImpliedSaturation(ExpectationSpec):
    """`saturation` of a task, as an expectation."""

    word: ClassVar[str] = "saturation"
    saturation: SaturationSpec = Field(description="The condition.")


def implied(
    task: TaskSpec, controllers: Callable[[], ControllersSpec], robot: RobotModel
) -> tuple[ExpectationSpec, ...]:
    """`saturation` of all commanded joints, without those of hands, which press by intent.

    Empty if the task sets `saturation: false`, if it does not state it (a log of an earlier version), or if no such
    joint has an effort limit. `controllers` is read only where it is needed.
    """
    if "saturation" not in task.model_fields_set or task.saturation is False:
        return ()
    specs = [spec for spec in controllers().controllers.values() if spec.interfaces]
    hands = {name for spec in specs if CONTROLLERS[spec.type].hand is not None for name in spec.joints}
    commanded = {name for spec in specs for name in spec.joints} - hands
    limited = limited_joints(robot)
    joints = tuple(name for name in robot.joint_names if name in commanded and name in limited)
    if not joints:
        return ()
    below = MOST if task.saturation is True else task.saturation
    return (ImpliedSaturation(saturation=SaturationSpec(joints=joints, below=below)),)
