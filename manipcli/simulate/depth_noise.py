"""Noise of a depth camera: its spec, and what it does to a depth picture.

The standard deviation of depth depends on the distance z and the angle of incidence a as

    white + quadratic (z - offset)^2 + grazing / sqrt(z) (a / (pi/2 - a))^2,

the form that Nguyen, Izadi and Lovell fitted to a Kinect (Modeling Kinect Sensor Noise for Improved 3D Reconstruction
and Tracking, 3DIMPVT 2012). `lateral` moves the place in the picture at which depth is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.spec.base import Model
from manipcli.spec.quantity import Angle, Length, Share
from manipcli.spec.sensors import LengthLimits, LengthNoise, SensorNoise

Depth = npt.NDArray[np.float32]


class DepthNoise(LengthNoise):
    """Noise of depth, which grows with distance and angle of incidence."""

    quadratic: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="Growth of the standard deviation with the square of the distance [1/m]; of a stereo camera, the "
        "resolution of its disparity [pixel] / (focal length [pixel] x baseline [m]). Default 0.",
    )
    offset: Annotated[Length, Field(ge=0, le=10)] = Field(
        0.0, description="Distance from which `quadratic` counts [m]. Default 0."
    )
    grazing: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0, description="Growth of the standard deviation with the angle of incidence [m^1.5]. Default 0."
    )
    lateral: Annotated[float, Field(ge=0, le=20)] = Field(
        0.0, description="Standard deviation of the place in the picture where depth is measured [pixel]. Default 0."
    )


class CameraNoise(SensorNoise):
    """Noise of a camera; its colours have none."""

    depth: DepthNoise = Field(DepthNoise(), description="Noise of depth. Default: none.")
    dropout: Annotated[Share, Field(ge=0, le=1)] = Field(
        0.0, description="Share of pixels without a depth, 0 to 1. Default 0."
    )


class CameraLimits(Model):
    """What a camera can measure; other pixels have no depth."""

    depth: LengthLimits = Field(LengthLimits(), description="Depths that it measures. Default: up to 100 m.")
    incidence: Annotated[Angle, Field(gt=0, le=1.5708)] = Field(
        1.5707963267948966,
        description="Largest angle between a ray and the normal of the surface. Default 90 deg: no limit.",
    )


@dataclass(frozen=True, slots=True)
class Draw:
    """Random numbers of one picture; None where its noise needs none.

    Attributes:
        offset: of all depths [m].
        axial: (h, w) standard normal.
        rows, columns: (h, w) where depth is measured instead.
        lost: (h, w) whether the pixel has no depth.
    """

    offset: float
    axial: Depth | None
    rows: npt.NDArray[np.intp] | None
    columns: npt.NDArray[np.intp] | None
    lost: npt.NDArray[np.bool_] | None


class DepthMeasurement:
    """True depth to measured depth.

    Args:
        noise, limits: of the camera.
        shape: height and width [pixel].
        interval: between two pictures [s].
    """

    def __init__(self, noise: CameraNoise, limits: CameraLimits, shape: tuple[int, int], interval: float) -> None:
        self._noise = noise.depth
        self._dropout = noise.dropout
        self._limits = limits
        self._shape = shape
        self._step = noise.depth.walk * float(np.sqrt(interval))
        self._offset: float | None = None

    def draw(self, rng: np.random.Generator) -> Draw:
        """The random numbers of the next picture."""
        noise, (height, width) = self._noise, self._shape
        if self._offset is None:
            self._offset = noise.bias * float(rng.standard_normal())
        elif self._step:
            self._offset += self._step * float(rng.standard_normal())
        rows = columns = lost = axial = None
        if noise.white or noise.quadratic or noise.grazing:
            axial = rng.standard_normal(self._shape, dtype=np.float32)
        if noise.lateral:
            shift = np.rint(noise.lateral * rng.standard_normal((2, *self._shape), dtype=np.float32)).astype(np.intp)
            rows = np.clip(np.arange(height)[:, None] + shift[0], 0, height - 1)
            columns = np.clip(np.arange(width) + shift[1], 0, width - 1)
        if self._dropout:
            lost = rng.random(self._shape, dtype=np.float32) < self._dropout
        return Draw(self._offset, axial, rows, columns, lost)

    def measure(self, depth: Array, cosine: Array, draw: Draw) -> Depth:
        """(h, w) measured depth [m], NaN where nothing is measured.

        Args:
            depth: (h, w) true depth [m], infinite where nothing is.
            cosine: (h, w) of the angle of incidence.
            draw: of this picture.
        """
        noise, limits = self._noise, self._limits
        if draw.rows is not None:
            depth, cosine = depth[draw.rows, draw.columns], cosine[draw.rows, draw.columns]
        z = depth.astype(np.float32)
        seen = np.isfinite(z)
        seen &= cosine >= np.float32(np.cos(limits.incidence)) - 1e-6
        found = np.where(seen, z, np.float32(np.nan))
        if draw.axial is not None:
            sigma = np.float32(noise.white) + np.float32(noise.quadratic) * np.square(found - np.float32(noise.offset))
            if noise.grazing:
                a = np.arccos(np.minimum(cosine, 1.0).astype(np.float32))
                with np.errstate(divide="ignore"):
                    ratio = a / np.maximum(np.float32(np.pi / 2.0) - a, np.float32(1e-6))
                sigma += np.float32(noise.grazing) / np.sqrt(found) * np.square(ratio)
            found += sigma * draw.axial
        if draw.offset:
            found += np.float32(draw.offset)
        if noise.quantisation:
            found = np.rint(found / np.float32(noise.quantisation)) * np.float32(noise.quantisation)
        if draw.lost is not None:
            found[draw.lost] = np.nan
        with np.errstate(invalid="ignore"):
            found[~((found >= limits.depth.least) & (found <= limits.depth.most))] = np.nan
        return found
