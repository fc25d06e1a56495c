"""`manipcli view`: a robot, or a task's scene at its start, in the browser."""

from __future__ import annotations

from manipcli.core.geometry import Array
from manipcli.model.configuration import posture
from manipcli.model.robot import RobotModel
from manipcli.replay.drawing import draw
from manipcli.replay.ground import floors_of
from manipcli.replay.panel import JointPanel, LayerSwitches
from manipcli.replay.placing import Placing
from manipcli.replay.server import LocalServer
from manipcli.replay.stage import Stage
from manipcli.scene.scene import Scene


class View(LocalServer):
    """A page with a robot, its scene where there is one, and the panel that moves it. Stops with the `with` block.

    Args:
        robot: the robot.
        scene: what stands around it, at its start.
        q: (n,) where the joints are at first; None: `home`, or else zero.
        port: see `LocalServer`.

    Attributes:
        robot: as given.
        stage: what is shown.
        joints: the panel.
        missing: what could not be drawn, a line each.
    """

    def __init__(
        self, robot: RobotModel, scene: Scene | None = None, *, q: Array | None = None, port: int | None
    ) -> None:
        drawing, placing = draw(robot, scene), Placing(robot, scene)
        position = posture(robot) if q is None else q
        super().__init__(robot.name, port=port)
        self.robot = robot
        self.missing = drawing.missing
        try:
            self.stage = Stage(self.viser, drawing, placing.start(position), floors=floors_of(scene))
            LayerSwitches(self.viser, self.stage)
            self.joints = JointPanel(self.viser, robot, self.stage, placing, position)
        except BaseException:
            self.stop()
            raise
