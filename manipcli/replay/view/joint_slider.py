"""A slider of a joint in degrees or millimetres, from limit to limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from manipcli.description.elements import Joint

if TYPE_CHECKING:
    import viser

STEPS: Final = 400
"""Approximate number of positions of a slider."""
WIDE: Final = {"continuous": math.pi, "revolute": math.pi, "prismatic": 1.0}
"""Range of the slider of a joint without limits [rad or m]."""
UNITS: Final = {"rad": ("deg", 180.0 / math.pi), "m": ("mm", 1000.0)}
"""Unit of a slider, and how many of it are one of the SI unit."""
DIGITS: Final = 2
"""Decimals of a slider, in its unit."""


def slider_range(joint: Joint) -> tuple[float, float]:
    """Lower and upper end of the slider of a joint [rad or m]."""
    lower, upper, reach = joint.limits.lower, joint.limits.upper, WIDE[joint.type]
    if lower is None and upper is not None:
        return min(-reach, upper - reach), upper
    if lower is not None and upper is None:
        return lower, max(reach, lower + reach)
    return (-reach if lower is None else lower, reach if upper is None else upper)


def units_of(joints: Iterable[Joint]) -> str:
    """Units of the sliders of joints, as in the title of a folder."""
    return ", ".join(sorted({UNITS[joint.unit][0] for joint in joints}))


class JointSlider:
    """A slider of a joint.

    Args:
        gui: where it is added.
        joint: the joint.
        value: its position [rad or m]; the slider is at the nearest end if it is outside.

    Attributes:
        handle: the slider of viser, in degrees or mm.
    """

    def __init__(self, gui: viser.GuiApi, joint: Joint, value: float) -> None:
        self._joint = joint
        unit, self._scale = UNITS[joint.unit]
        low, high = (round(self._scale * end, DIGITS) for end in slider_range(joint))
        step = 10.0 ** math.floor(math.log10(max(high - low, 1e-6) / STEPS))
        kind = joint.type if joint.limits.lower is not None or joint.limits.upper is not None else "without limits"
        hint = f"{joint.name} [{unit}], {kind}: '{joint.parent}' to '{joint.child}'"
        self.handle: viser.GuiSliderHandle[float] = gui.add_slider(
            joint.name, low, high, step, self._fitting(value, low, high), disabled=high <= low, hint=hint
        )

    @property
    def value(self) -> float:
        """Position of the joint [rad or m], within its limits; set it to move the slider."""
        return self._joint.limits.nearest(self.handle.value / self._scale)

    @value.setter
    def value(self, position: float) -> None:
        there = self._fitting(position, self.handle.min, self.handle.max)
        self.handle.value = there  # type: ignore[misc]  # viser's setter hides from mypy

    def shows(self, position: float) -> bool:
        """Whether the slider is at this position [rad or m], to its decimals."""
        return self.handle.value == self._fitting(position, self.handle.min, self.handle.max)

    def follow(self, position: float) -> None:
        """Move the slider to a position [rad or m], on its steps, and only where it is visibly elsewhere."""
        handle = self.handle
        value = round(handle.step * round(self._scale * position / handle.step), 9)
        value = min(max(value, handle.min), handle.max)
        if abs(value - handle.value) > 0.5 * handle.step:
            handle.value = value  # type: ignore[misc]  # viser's setter hides from mypy

    def on_moved(self, moved: Callable[[float], None]) -> None:
        """Calls `moved` with the position [rad or m] whenever somebody or something moves the slider."""
        self.handle.on_update(lambda _: moved(self.value))

    def _fitting(self, position: float, low: float, high: float) -> float:
        return min(max(round(self._scale * position, DIGITS), low), high)
