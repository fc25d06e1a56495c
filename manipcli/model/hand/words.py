"""A tool frame and its hand in words: poses in mm and degrees, the axis and the range of the opening."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.hand.tool_hand import ToolHand

LETTERS: Final = "xyz"


def opening_text(hand: ToolHand) -> str:
    """Axis and range of the opening, and the gap in each pose of the hand."""
    if not hand.measured:
        return f"along {axis_text(hand)}; how far is not known, because the fingers have no shapes"
    ends = f"{gap_text(hand.narrowest)} to {gap_text(hand.widest)} mm"
    text = f"along {axis_text(hand)}, {ends} between the fingers by its joint limits"
    poses = ", ".join(f"'{name}' {gap_text(gap)}" for name, gap in hand.gaps_of_poses().items())
    text += f" (in poses: {poses} mm)" if poses else ""
    if not hand.out_along_z:
        text += "; the fingers do not point along +z of the tool frame"
    return text


def axis_text(hand: ToolHand) -> str:
    """The axis along which the hand opens, in the tool frame: "y of the tool frame"."""
    k = int(np.argmax(np.abs(hand.axis)))
    if abs(hand.axis[k]) > 1.0 - 1e-6:
        name = LETTERS[k]
        return f"{name} of the tool frame" + ("" if hand.along_y else " (not y, along which `pick` closes)")
    numbers = ", ".join(f"{round(float(value), 3) + 0.0:g}" for value in hand.axis)
    return f"[{numbers}] in the tool frame" + ("" if hand.along_y else " (not y, along which `pick` closes)")


def gap_text(gap: float) -> str:
    """A gap in mm; 0 where the fingers meet or pass each other."""
    return f"{1000.0 * max(gap, 0.0):.1f}"


def pose_text(X: Transform) -> str:
    """A pose in mm and degrees: "xyz [0, 0, 45] mm, rpy [0, 0, 90] deg"."""
    return f"xyz {millimetres(X.p)} mm, rpy {_list(np.degrees(X.rpy), 2)} deg"


def millimetres(values: Array) -> str:
    """Lengths [m] in mm: "[0, 47.2, 5.7]"."""
    return _list(1000.0 * values, 1)


def _list(values: Array, digits: int) -> str:
    return "[" + ", ".join(f"{round(float(value), digits) + 0.0:g}" for value in values) + "]"
