"""Interactive page of `manipcli view`: a robot or the start scene of a task, joints, layers, camera, tool."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.configuration import configuration, with_mimics
from manipcli.model.hand.tool_hand import ToolHand, tool_hand
from manipcli.model.hand.words import opening_text, pose_text
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel, Tool
from manipcli.render.drawing import draw, floors_of
from manipcli.render.placing import Placing
from manipcli.replay.view.camera_panel import CameraPanel
from manipcli.replay.view.collisions import Collisions, list_html, status_html
from manipcli.replay.view.joint_panel import JointPanel, configuration_text
from manipcli.replay.view.layer_panel import add_layers
from manipcli.replay.view.masses import Masses
from manipcli.replay.view.tool_marks import ToolMarks, tool_pose_text
from manipcli.replay.view.viser_scene import ViserScene
from manipcli.replay.view.viser_server import LocalServer
from manipcli.scene.scene import Scene

if TYPE_CHECKING:
    import viser


class View(LocalServer):
    """A served page with a robot and its scene. A context manager that stops the server.

    Args:
        robot: the robot.
        scene: the scene at its start.
        q: (n,) initial joint positions; None: `home`, or zero without a `home`.
        port: see `LocalServer`.

    Attributes:
        robot: the shown robot.
        joints: the joint panel.
        camera: the panel of the camera.
        collisions: what collides.
        hand: the hand at the tool; None without fingers.
        missing: parts that cannot be drawn, one line each.
    """

    def __init__(
        self, robot: RobotModel, scene: Scene | None = None, *, q: Array | None = None, port: int | None
    ) -> None:
        super().__init__(robot.name, port=port)
        self._dark = False
        try:
            self._build(robot, scene, configuration(robot) if q is None else q)
            self.viser.on_client_connect(self._came)
        except BaseException:
            self.stop()
            raise

    def replace(self, robot: RobotModel, scene: Scene | None = None, *, q: Array | None = None) -> None:
        """Show another state of the files; joints of the same names keep their positions, the camera stays.

        Args:
            robot, scene, q: as for the constructor.
        """
        before = dict(zip(self.robot.joint_names, self.joints.position, strict=True))
        start = configuration(robot) if q is None else q
        kept = [
            joint.limits.nearest(before.get(joint.name, value))
            for joint, value in zip(robot.moving_joints, start, strict=True)
        ]
        with self.viser.atomic():
            self.viser.scene.reset()
            self.viser.gui.reset()
            self.viser.gui.main_panel.dock_right()
            self._build(robot, scene, start)
        self.joints.go(with_mimics(robot, np.array(kept)))

    def notify(self, title: str, text: str) -> None:
        """Show a message in all browsers."""
        for client in self.viser.get_clients().values():
            client.add_notification(title, text, color="red", auto_close_seconds=20.0)

    def _build(self, robot: RobotModel, scene: Scene | None, q: Array) -> None:
        drawing, self._placing, floors = draw(robot, scene), Placing(robot, scene), floors_of(scene)
        self.robot, self.missing = robot, drawing.missing
        self._kinematics = Kinematics(robot)
        self._poses = self._placing.start(q)
        self._scene = ViserScene(self.viser, drawing, self._poses, floors=floors)
        self.hand = tool_hand(robot)
        self._tool = robot.tool if robot.tool is not None else (None if self.hand is None else self.hand.tool)
        self.collisions = Collisions(robot, scene)
        self._masses = Masses(self.viser, self._scene, robot, scene)
        self._marks = None if self._tool is None else ToolMarks(self.viser, self._scene, self._tool, self.hand)
        gui = self.viser.gui
        self._status = gui.add_html("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Joints"):
            self.joints = JointPanel(gui, robot, q, self._moved)
        with tabs.add_tab("Show"):
            self._add_layers(gui)
        with tabs.add_tab("Camera"):
            tool = self._tool_place if self._tool is not None else None
            self.camera = CameraPanel(self.viser, drawing, floors, lambda: self._poses, tool)
        with tabs.add_tab("Poses"):
            self._add_readout(gui)
        self._list = gui.add_html("")
        self._scene.darken(self._dark)
        self._moved(q)

    def _came(self, client: viser.ClientHandle) -> None:
        """Frame the scene for a narrow screen; the first view is for a wide one."""
        if client.camera.aspect < 1.0:
            self.camera.view(client, "iso")

    def _add_layers(self, gui: viser.GuiApi) -> None:
        marks, masses = self._marks, self._masses
        if marks is not None:
            hint = "Axes of the tool frame, finger tips (orange), the gap between the fingers (violet)."
            tool = gui.add_checkbox("tool, finger tips", True, hint=hint)
            tool.on_update(lambda _: marks.show(tool.value))
        add_layers(gui, self._scene)
        centres = gui.add_checkbox("centres of mass", False, hint="Best with `transparent`; red: of the whole robot.")
        centres.on_update(lambda _: masses.show(centres.value))
        dark = gui.add_checkbox("dark", self._dark)
        dark.on_update(lambda _: self._darken(dark.value))

    def _darken(self, dark: bool) -> None:
        self._dark = dark
        self.darken(dark)
        self._scene.darken(dark)

    def _add_readout(self, gui: viser.GuiApi) -> None:
        hint = "For `poses:` of the robot file, in rad and m."
        self._joint_text = gui.add_text("joints as YAML", "", multiline=True, hint=hint)
        if self._tool is not None:
            hint = "In the world, in m and rad, for `pose:` of a step `move`."
            self._tool_text = gui.add_text("tool pose as YAML", "", multiline=True, hint=hint)
            gui.add_html(tool_html(self._tool, self.hand, stated=self.robot.tool is not None))

    def _tool_place(self) -> Array:
        """(3,) [m] the tool in the world."""
        assert self._tool is not None
        frame = list(self._scene.paths).index(f"robot/{self._tool.link}")
        return self._poses.X_WF(frame).apply(self._tool.X_LT.p)

    def _moved(self, q: Array) -> None:
        """Show a configuration: poses, collisions, the gap of the hand, and both as text."""
        self._poses = self._placing.start(q)
        hits = self.collisions.at(q)
        gap = self.hand.gap_at(q) if self.hand is not None and self.hand.measured else None
        with self.viser.atomic():
            self._scene.place(self._poses)
            self._scene.mark(frozenset(name for hit in hits for name in (hit.a, hit.b)))
            self._masses.place(self._poses)
            if self._marks is not None:
                self._marks.place(q)
            self._status.content = status_html(hits, gap)
            self._list.content = list_html(hits)
            self._joint_text.value = configuration_text(self.robot, q)  # type: ignore[misc]  # viser's setter hides from mypy
            if self._tool is not None:
                X_WT = self._kinematics.forward(q, self._tool.link) @ self._tool.X_LT
                self._tool_text.value = tool_pose_text(X_WT)  # type: ignore[misc]


def tool_html(tool: Tool, hand: ToolHand | None, *, stated: bool) -> str:
    """The tool frame and the opening of the hand, for the panel."""
    lines = [
        f"<b>tool</b> in link '{escape(tool.link)}': {pose_text(tool.X_LT)}",
        "+z is the approach direction" + ("" if stated else "; measured on the hand, the robot file states none"),
    ]
    if hand is not None:
        lines += [f"<b>tips</b> {escape(', '.join(tip.link for tip in hand.tips))}"]
        lines += [f"<b>opening</b> {escape(opening_text(hand))}"]
    return f'<div style="padding: 0 0.8em; font-size: 0.85em">{"<br>".join(lines)}</div>'
