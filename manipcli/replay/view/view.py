"""The page of `manipcli view`: a robot, or a task's scene at its start, joint sliders, named poses and layers."""

from __future__ import annotations

import math
import threading
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.description.elements import Joint
from manipcli.model.configuration import configuration, with_mimics, zero_configuration
from manipcli.model.robot import RobotModel
from manipcli.replay.drawing import draw, floors_of
from manipcli.replay.placing import Placing
from manipcli.replay.view.viser_scene import Shown, ViserScene
from manipcli.replay.view.viser_server import LocalServer
from manipcli.scene.scene import Scene

if TYPE_CHECKING:
    import viser

STEPS = 400
"""A slider has about so many positions."""
ZERO = "zero"
WIDE = {"continuous": math.pi, "revolute": math.pi, "prismatic": 1.0}
"""Range of a slider [rad or m] where a joint states no limit."""


class View(LocalServer):
    """A page with a robot and its scene, and the panel that moves it. Stops with the `with` block.

    Args:
        robot: the robot.
        scene: what is around it, at its start.
        q: (n,) initial joint positions; None: `home`, or else zero.
        port: see `LocalServer`.

    Attributes:
        joints: the panel.
        missing: what could not be drawn, one line each.
    """

    def __init__(
        self, robot: RobotModel, scene: Scene | None = None, *, q: Array | None = None, port: int | None
    ) -> None:
        drawing, placing = draw(robot, scene), Placing(robot, scene)
        position = configuration(robot) if q is None else q
        super().__init__(robot.name, port=port)
        self.robot = robot
        self.missing = drawing.missing
        try:
            shown = ViserScene(self.viser, drawing, placing.start(position), floors=floors_of(scene))
            _add_layers(self.viser, shown)
            self.joints = JointPanel(self.viser, robot, shown, placing, position)
        except BaseException:
            self.stop()
            raise


def slider_range(joint: Joint) -> tuple[float, float]:
    """From where to where the slider of a joint goes [rad or m]."""
    lower, upper, reach = joint.limits.lower, joint.limits.upper, WIDE[joint.type]
    if lower is None and upper is not None:
        return min(-reach, upper - reach), upper
    if lower is not None and upper is None:
        return lower, max(reach, lower + reach)
    return (-reach if lower is None else lower, reach if upper is None else upper)


def pose_text(robot: RobotModel, q: Array) -> str:
    """A posture as `poses:` of a robot file has it: a list for each group; by joint name where there are no groups."""
    value = {name: f"{number:.4g}" for name, number in zip(robot.joint_names, q, strict=True)}
    if robot.groups:
        parts = [f"{group.name}: [{', '.join(value[name] for name in group.joints)}]" for group in robot.groups]
    else:
        parts = [f"{joint.name}: {value[joint.name]}" for joint in robot.moving_joints if joint.independent]
    return "\n".join(parts)


def _add_layers(server: viser.ViserServer, scene: ViserScene) -> None:
    """A checkbox for each thing that can be shown."""

    def add(label: str, layer: Shown, hint: str | None = None) -> None:
        box = server.gui.add_checkbox(label, layer == "visual", hint=hint)
        box.on_update(lambda _: scene.show(layer, box.value))

    with server.gui.add_folder("Show"):
        add("visual meshes", "visual")
        clear = server.gui.add_checkbox("see-through", False, hint="Frames and centres of mass are inside.")
        clear.on_update(lambda _: scene.see_through(clear.value))
        add("collision shapes", "collision", "A mesh as its convex hull, as in planner and physics.")
        add("inertia boxes", "inertia", "For each link, the uniform box that has its mass and inertia.")
        add("frames", "frames", "x red, y green, z blue.")
        add("names", "names")


class JointPanel:
    """Sliders for the independent joints, buttons for the named poses; the scene follows.

    Args:
        server: where.
        robot: whose joints.
        scene: shows it.
        placing: joints to frames.
        q: (n,) where it is at first.

    Attributes:
        sliders: by the index of the joint in joint vectors.

    The page calls back in threads of the server; one lock makes one movement out of each.
    """

    def __init__(
        self, server: viser.ViserServer, robot: RobotModel, scene: ViserScene, placing: Placing, q: Array
    ) -> None:
        self._robot, self._scene, self._placing = robot, scene, placing
        self._lock = threading.Lock()
        self.sliders: dict[int, viser.GuiSliderHandle[float]] = {}
        self._q = q
        with server.gui.add_folder("Poses"):
            for name in dict.fromkeys((*(pose.name for pose in robot.poses), ZERO)):
                server.gui.add_button(name).on_click(partial(self._clicked, name))
        with server.gui.add_folder("Joints [rad, m]"):
            for k, joint in enumerate(robot.moving_joints):
                if joint.independent:
                    self.sliders[k] = self._slider(server, joint, k)
        self._text = server.gui.add_text(
            "as YAML", pose_text(robot, q), multiline=True, hint="For `poses:` of the robot file, or a step `move`."
        )

    def _slider(self, server: viser.ViserServer, joint: Joint, k: int) -> viser.GuiSliderHandle[float]:
        low, high = slider_range(joint)
        step = 10.0 ** math.floor(math.log10(max(high - low, 1e-6) / STEPS))
        value = min(max(float(self._q[k]), low), high)
        slider = server.gui.add_slider(joint.name, low, high, step, value, disabled=high <= low)
        slider.on_update(lambda _: self._slid(k, slider.value))
        return slider

    @property
    def position(self) -> Array:
        """(n,) where the joints are shown."""
        return self._q

    def _clicked(self, name: str, _: object) -> None:
        self.go(self.named(name))

    def named(self, name: str) -> Array:
        """(n,) the posture behind a button: joints that the pose does not speak of stay where they are."""
        known = any(pose.name == name for pose in self._robot.poses)
        return configuration(self._robot, name, rest=self._q) if known else zero_configuration(self._robot)

    def go(self, q: Array) -> None:
        """Show a posture, and put the sliders there."""
        with self._lock:
            self._place(q)
        # Each assignment calls `_slid`, which finds the joint there already.
        for k, slider in self.sliders.items():
            slider.value = float(q[k])  # type: ignore[misc]  # viser's setter hides from mypy

    def _slid(self, k: int, value: float) -> None:
        """One slider was moved; the others' values are not asked for: they may be on their way elsewhere."""
        with self._lock:
            q = np.array(self._q)
            if not math.isfinite(value) or value == q[k]:
                return
            q[k] = self._robot.moving_joints[k].limits.nearest(value)
            self._place(with_mimics(self._robot, q))

    def _place(self, q: Array) -> None:
        self._q = q
        self._scene.place(self._placing.start(q))
        self._text.value = pose_text(self._robot, q)  # type: ignore[misc]  # viser's setter hides from mypy
