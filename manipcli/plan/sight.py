"""What the planner asks of a depth camera: where it is, and whether its picture would show a body.

Pictures are rendered by a layer above this one, which gives the planner its cameras.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

from manipcli.core.geometry import Transform
from manipcli.core.prose import amount, share
from manipcli.plan.motion import PlanningState

SHOWN: Final = 0.4
"""Least share of a body's pixels that nothing hides."""
INSIDE: Final = 0.75
"""Least share of the corners of its bounding box that are in the picture, at depths that the camera measures."""
PIXELS: Final = 150
"""Least number of pixels that show it."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """How a picture shows a body, where it is worst among the places at which the body can be.

    Attributes:
        inside: share of the corners of its bounding box in the picture.
        misses: why the other corners are not measured: "is outside its picture", "is nearer than 10 cm"; "" if all are.
        shown: share of its pixels that nothing hides.
        hider: the part that hides most of the others; "" if nothing does.
        pixels: number of pixels that show it.
    """

    inside: float
    misses: str
    shown: float
    hider: str
    pixels: int

    @property
    def sufficient(self) -> bool:
        """Whether the body can be located in the picture."""
        return self.inside >= INSIDE and self.shown >= SHOWN and self.pixels >= PIXELS

    def why(self, body: str, camera: str) -> str:
        """Why it cannot be located, for a message."""
        if self.inside < INSIDE:
            return (
                f"{share(1.0 - self.inside)} of '{body}' {self.misses}"
                if self.inside > 0.0
                else (f"'{body}' {self.misses}")
            )
        if self.shown < SHOWN:
            return f"'{self.hider}' hides {share(round(1.0 - self.shown, 2))} of '{body}' from '{camera}'"
        return f"'{camera}' shows '{body}' with {self.pixels} pixels, expected at least {PIXELS}"


class Sight(Protocol):
    """A depth camera, as the robot knows it."""

    @property
    def link(self) -> str:
        """The link that carries it; "" for a camera that is fixed in the scene."""

    @property
    def X_LC(self) -> Transform:
        """Its optical frame C (z forward, x right, y down) in that link, or in what it is fixed in."""

    @property
    def depths(self) -> tuple[float, float]:
        """[m] The least and the largest depth that it measures."""

    @property
    def cone(self) -> float:
        """[rad] Half the opening angle of the largest cone about its optical axis that is in the picture."""

    @property
    def latency(self) -> float:
        """[s] Longest time until a picture arrives that it takes from now on."""

    def pose(self, state: PlanningState) -> Transform:
        """X_WC."""

    def sighting(self, state: PlanningState, body: str) -> Sighting:
        """How its picture of this state shows a movable body, wherever that can be."""


def depth_text(least: float, most: float, depth: float) -> str:
    """What is wrong with a depth [m] that the camera does not measure."""
    return f"is nearer than {amount(least, 'm')}" if depth < least else f"is farther than {amount(most, 'm')}"
