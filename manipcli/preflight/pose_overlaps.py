"""Named poses of a robot in which links overlap."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.model.collision import CollisionChecker
from manipcli.model.configuration import configuration
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec


def pose_findings(file: Located[RobotSpec], robot: RobotModel) -> Iterator[Diagnostic]:
    """A warning for every pair of links that overlap in a named pose; other joints are as in `home`, if it exists.

    Ignored: adjacent links, pairs that overlap with all joints at zero, and pairs of `collision_ignore`.
    """
    nothing = Scene(bodies=(), frames=(), gravity=np.zeros(3))
    query = CollisionChecker(Kinematics(robot), nothing, ignore=robot.collision_ignore).at()
    rest = configuration(robot)
    for pose in robot.poses:
        for hit in query.every(configuration(robot, pose.name, rest=rest)):
            a, b = (name.removeprefix("robot/") for name in (hit.a, hit.b))
            yield Diagnostic(
                code="ROBOT347",
                message=f"pose '{pose.name}': links '{a}' and '{b}' overlap by {hit.amount}",
                place=file.place("poses", pose.name),
                hint="change the pose, or list the pair under `collision_ignore` if the links may touch",
                severity="warning",
            )
