"""Interactive page of `manipcli view`: a robot or the start scene of a task, joint sliders, named poses, layers."""

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
from manipcli.render.drawing import draw, floors_of
from manipcli.render.placing import Placing
from manipcli.replay.view.viser_scene import Shown, ViserScene
from manipcli.replay.view.viser_server import LocalServer
from manipcli.scene.scene import Scene

if TYPE_CHECKING:
    import viser

STEPS = 400
"""Approximate number of positions of a slider."""
ZERO = "zero"
WIDE = {"continuous": math.pi, "revolute": math.pi, "prismatic": 1.0}
"""Range of the slider of a joint without limits [rad or m]."""


class View(LocalServer):
    """A served page with a robot, its scene and a joint panel. A context manager that stops the server.

    Args:
        robot: the robot.
        scene: the scene at its start.
        q: (n,) initial joint positions; None: `home`, or zero without a `home`.
        port: see `LocalServer`.

    Attributes:
        joints: the joint panel.
        missing: parts that cannot be drawn, one line each.
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
            with self.viser.gui.add_folder("Show"):
                add_layers(self.viser.gui, shown)
            self.joints = JointPanel(self.viser, robot, shown, placing, position)
        except BaseException:
            self.stop()
            raise


def slider_range(joint: Joint) -> tuple[float, float]:
    """Lower and upper end of the slider of a joint [rad or m]."""
    lower, upper, reach = joint.limits.lower, joint.limits.upper, WIDE[joint.type]
    if lower is None and upper is not None:
        return min(-reach, upper - reach), upper
    if lower is not None and upper is None:
        return lower, max(reach, lower + reach)
    return (-reach if lower is None else lower, reach if upper is None else upper)


def pose_text(robot: RobotModel, q: Array) -> str:
    """A configuration as YAML for `poses:` of a robot file: a list per group, or by joint name without groups."""
    value = {name: f"{number:.4g}" for name, number in zip(robot.joint_names, q, strict=True)}
    if robot.groups:
        parts = [f"{group.name}: [{', '.join(value[name] for name in group.joints)}]" for group in robot.groups]
    else:
        parts = [f"{joint.name}: {value[joint.name]}" for joint in robot.moving_joints if joint.independent]
    return "\n".join(parts)


def add_layers(gui: viser.GuiApi, scene: ViserScene) -> None:
    """Add a checkbox for each layer."""

    def add(label: str, layer: Shown, hint: str | None = None) -> None:
        box = gui.add_checkbox(label, layer == "visual", hint=hint)
        box.on_update(lambda _: scene.show(layer, box.value))

    add("visual meshes", "visual")
    clear = gui.add_checkbox("transparent", False, hint="Show frames and centres of mass inside the links.")
    clear.on_update(lambda _: scene.see_through(clear.value))
    add("collision shapes", "collision", "Convex hulls of the meshes, as in planner and physics.")
    add("inertia boxes", "inertia", "Uniform box with the mass and inertia of each link.")
    add("frames", "frames", "x red, y green, z blue.")
    add("names", "names")


def joint_slider(gui: viser.GuiApi, joint: Joint, value: float) -> viser.GuiSliderHandle[float]:
    """Add a slider of a joint over its range, at `value` or the nearest end [rad or m]."""
    low, high = slider_range(joint)
    step = 10.0 ** math.floor(math.log10(max(high - low, 1e-6) / STEPS))
    return gui.add_slider(joint.name, low, high, step, min(max(value, low), high), disabled=high <= low)


class JointPanel:
    """Sliders of the independent joints and buttons of the named poses, which move the scene.

    Args:
        server: the viser server.
        robot: the robot.
        scene: the shown scene.
        placing: computes the frames.
        q: (n,) initial joint positions.

    Attributes:
        sliders: sliders by the index of the joint in joint vectors.

    The page calls back in threads of the server; a lock serialises the movements.
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
            "as YAML",
            pose_text(robot, q),
            multiline=True,
            hint="For `poses:` of the robot file or a `move` step.",
        )

    def _slider(self, server: viser.ViserServer, joint: Joint, k: int) -> viser.GuiSliderHandle[float]:
        slider = joint_slider(server.gui, joint, float(self._q[k]))
        slider.on_update(lambda _: self._slid(k, slider.value))
        return slider

    @property
    def position(self) -> Array:
        """(n,) shown joint positions."""
        return self._q

    def _clicked(self, name: str, _: object) -> None:
        self.go(self.named(name))

    def named(self, name: str) -> Array:
        """(n,) joint positions of a named pose; joints that it does not name keep their position."""
        known = any(pose.name == name for pose in self._robot.poses)
        return configuration(self._robot, name, rest=self._q) if known else zero_configuration(self._robot)

    def go(self, q: Array) -> None:
        """Show a configuration and set the sliders to it."""
        with self._lock:
            self._place(q)
        # Each assignment calls `_slid`, which finds the joint at this value already.
        for k, slider in self.sliders.items():
            slider.value = float(q[k])  # type: ignore[misc]  # viser's setter hides from mypy

    def _slid(self, k: int, value: float) -> None:
        """Move one joint to its slider; the other sliders are not read, since they can still be moving."""
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
