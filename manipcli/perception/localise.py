"""The pose of a body of known shape from one depth picture.

A pure function of what the camera measured and what the robot believes. It knows nothing of the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.core.geometry import Array, Transform
from manipcli.render.lens import Lens
from manipcli.scene.scene import Body


@dataclass(frozen=True, slots=True)
class DepthView:
    """What a depth camera measured, as the robot knows it.

    Attributes:
        lens: of the camera.
        X_WC: optical frame C (z forward, x right, y down) in the world, from the joints of the robot.
        depth: (h, w) along z [m]; 0 or NaN: not measured.
        noise: standard deviation of depth [m], for each pixel (h, w) or for all.
    """

    lens: Lens
    X_WC: Transform
    depth: Array
    noise: Array | float


@dataclass(frozen=True, slots=True)
class Prior:
    """What the robot believes of the body before it looks.

    Attributes:
        body: with its geometries in O.
        X_WO: believed pose.
        region: (3,) half lengths [m] of the box, along the axes of the world about `X_WO`, that contains its origin; an
            axis with 0 is known.
        rotation: largest rotation about the world's z axis from `X_WO` [rad]; pi: any, 0: known. Its tilt is known.
    """

    body: Body
    X_WO: Transform
    region: Array
    rotation: float


@dataclass(frozen=True, slots=True)
class Localisation:
    """Where the body is.

    Attributes:
        X_WO: its pose.
        covariance: (6, 6) of translation [m2], then rotation [rad2], in the axes of the world.
        residual: root mean square of the depth errors of explained pixels [m].
        inliers: share of the pixels that should show the body and do, 0 to 1.
        pixels: number of pixels that show it.
        free: (3,) axis in the world about which the shape looks the same, so that its rotation stays as believed, or
            None.
    """

    X_WO: Transform
    covariance: Array
    residual: float
    inliers: float
    pixels: int
    free: Array | None


class NotSeen(Exception):
    """The picture does not show the body where it can be.

    Attributes:
        reason: what is missing, with the numbers, as the end of a sentence.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


def localise(view: DepthView, prior: Prior, expected: Array) -> Localisation:
    """The pose of a body from a depth picture.

    Args:
        view: what was measured.
        prior: what is believed.
        expected: (h, w) depth [m] of everything believed without the body; infinite where nothing is.

    Raises:
        NotSeen: too few pixels, no pose that explains them, or a pose outside the region.
    """
    raise NotImplementedError
