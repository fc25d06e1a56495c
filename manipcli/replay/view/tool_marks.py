"""The tool frame in the browser: its axes with their meaning, the finger tips, and the gap between the fingers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.hand.tool_hand import ToolHand
from manipcli.model.hand.words import gap_text
from manipcli.model.robot import Tool
from manipcli.render.drawing import link_frame
from manipcli.replay.view.viser_scene import ViserScene

if TYPE_CHECKING:
    import viser

AXIS: Final = 0.06
"""[m] Length of the axes of the tool frame."""
TIP: Final = 0.004
"""[m] Radius of the ball at a finger tip."""
TIP_COLOUR: Final = (240, 140, 0)
GAP_COLOUR: Final = (156, 54, 181)


class _Node(Protocol):
    visible: bool


class ToolMarks:
    """What is drawn at the tool frame.

    Args:
        server: the viser server.
        scene: the shown scene, whose links carry the marks.
        tool: the tool frame.
        hand: the hand at the tool; None without fingers.
    """

    def __init__(self, server: viser.ViserServer, scene: ViserScene, tool: Tool, hand: ToolHand | None) -> None:
        self._hand, self._nodes = hand, list[_Node]()
        add, root = server.scene, f"{scene.paths[link_frame(tool.link)]}/tool"
        X, meant = tool.X_LT, {"x": "x", "y": "y", "z": "z: approach"}
        if hand is not None and hand.along_y:
            meant["y"] = "y: closing"
        self._nodes.append(
            add.add_frame(
                root,
                axes_length=AXIS,
                axes_radius=AXIS / 24.0,
                origin_radius=AXIS / 12.0,
                position=X.p,
                wxyz=np.roll(X.quat_xyzw, 1),
            )
        )
        for k, (axis, text) in enumerate(meant.items()):
            self._label(server, f"{root}/{axis}", text, 1.1 * AXIS * np.eye(3)[k])
        self._gap: viser.LineSegmentsHandle | None = None
        if hand is None:
            return
        for k, tip in enumerate(hand.tips):
            path = f"{scene.paths[link_frame(tip.link)]}/tip_{k}"
            self._nodes.append(add.add_icosphere(path, radius=TIP, color=TIP_COLOUR, position=tip.p_L))
        if hand.measured:
            self._gap = add.add_line_segments(
                f"{root}/gap", np.zeros((1, 2, 3)), GAP_COLOUR, thickness=4.0, thickness_units="screen"
            )
            self._width = self._label(server, f"{root}/width", "", np.zeros(3))
            self._nodes.append(self._gap)

    def _label(self, server: viser.ViserServer, path: str, text: str, place: Array) -> viser.LabelHandle:
        label = server.scene.add_label(path, text, position=place, font_screen_scale=0.75, anchor="bottom-left")
        self._nodes.append(label)
        return label

    def place(self, q: Array) -> None:
        """Show the gap of the hand at joint positions `q` (n)."""
        if self._gap is None or self._hand is None:
            return
        ends, gap = gap_line(self._hand, q), self._hand.gap_at(q)
        self._gap.points = ends[None].astype(np.float32)
        self._width.text = f"{gap_text(gap)} mm"
        self._width.position = ends[0]

    def show(self, shown: bool) -> None:
        """Show or hide the marks."""
        for node in self._nodes:
            node.visible = shown


def gap_line(hand: ToolHand, q: Array) -> Array:
    """(2, 3) [m] in the tool frame: the gap as a line along the opening axis, at the height of the finger tips."""
    tips = hand.tips_at(q)
    middle = (tips.max(axis=0) + tips.min(axis=0)) / 2.0
    half = max(hand.gap_at(q), 0.0) / 2.0 * hand.axis
    return np.array([middle - half, middle + half])


def tool_pose_text(X: Transform) -> str:
    """A pose as YAML below the key `pose` of a step `move`, in m and rad."""
    numbers = [", ".join(f"{round(float(value), 5) + 0.0:g}" for value in values) for values in (X.p, X.rpy)]
    return f"xyz: [{numbers[0]}]\nrpy: [{numbers[1]}]"
