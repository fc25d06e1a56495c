"""`tactile`: a grid of taxels on a surface, each of which measures the normal force on its cell.

The grid lies in the plane z = 0 of the sensor frame S, its middle at the origin; +z points out of the surface. The
force of a contact point within `depth` of the plane is shared by the four nearest cells, by distance; the sum of all
cells is that of the contact points on the grid.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.sensor import Quantity, SensorContext, SensorMember, Topic
from manipcli.simulate.touched import needs_a_part, touched_by
from manipcli.spec.base import Model
from manipcli.spec.mounted_sensor import MountedFilteredSpec
from manipcli.spec.quantity import Force, Length
from manipcli.spec.sensors import ForceNoise, SensorNoise

Side = Annotated[Length, Field(ge=1e-4, le=1.0)]
Cells = Annotated[int, Field(ge=1, le=64)]


class TactileNoise(SensorNoise):
    """Noise of each cell."""

    force: ForceNoise = Field(ForceNoise(), description="Noise of the force on a cell [N].")


class TactileLimits(Model):
    """Measuring range of each cell."""

    force: Annotated[Force, Field(gt=0)] | None = Field(None, description="[N], above 0. Default: unlimited.")


class TactileSpec(MountedFilteredSpec):
    """A grid of taxels: the normal force on each cell of a surface."""

    type: Literal["tactile"] = Field(description="`tactile`.")
    size: tuple[Side, Side] = Field(description="Lengths of the grid along x and y of its frame [m], 0.1 mm to 1 m.")
    columns: Cells = Field(description="Cells along x, 1 to 64.")
    rows: Cells = Field(description="Cells along y, 1 to 64.")
    depth: Annotated[Length, Field(gt=0, le=0.1)] = Field(
        0.005, description="Contact points up to this far from the plane count [m], up to 10 cm. Default 5 mm."
    )
    noise: TactileNoise = Field(TactileNoise(), description="Noise. Default: none.")
    limits: TactileLimits = Field(TactileLimits(), description="Measuring range. Default: unlimited.")


class Taxels:
    """Reads (rows * columns): the force on each cell, row by row."""

    def __init__(self, spec: TactileSpec, context: SensorContext) -> None:
        self._engine, self._mount = context.engine, context.place
        self._half = np.array(spec.size) / 2.0
        self._counts = np.array([spec.columns, spec.rows])
        self._depth = spec.depth
        self._read = np.zeros(spec.rows * spec.columns)

    def read(self, state: WorldState) -> Array:
        self._read[:] = 0.0
        X_WS = None
        for contact, sign in touched_by(self._engine, self._mount.part):
            if X_WS is None:
                X_WS = self._mount.pose(state)
            for position, normal, force, _ in contact.points:
                place = X_WS.R.T @ (np.array(position) - X_WS.p)
                pressing = -sign * force * float(X_WS.R[:, 2] @ np.array(normal))
                if pressing > 0.0 and abs(place[2]) <= self._depth and (abs(place[:2]) <= self._half).all():
                    self._share(place[:2], pressing)
        return self._read

    def _share(self, place: Array, force: float) -> None:
        """Add a force at `place` (2) to the cells whose middles are around it; at a border to fewer."""
        at = (place + self._half) / (2.0 * self._half) * self._counts - 0.5
        at = np.clip(at, 0.0, self._counts - 1.0)
        low = np.minimum(at.astype(int), np.maximum(self._counts - 2, 0))
        high = np.minimum(low + 1, self._counts - 1)
        part = at - low
        for column, along in ((low[0], 1.0 - part[0]), (high[0], part[0])):
            for row, across in ((low[1], 1.0 - part[1]), (high[1], part[1])):
                self._read[row * self._counts[0] + column] += force * along * across


def _quantities(spec: TactileSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    most = np.inf if spec.limits.force is None else spec.limits.force
    return (Quantity("force", spec.rows * spec.columns, spec.noise.force, 0.0, most),)


def _topics(spec: TactileSpec, robot: RobotModel) -> tuple[Topic, ...]:
    fixed: dict[str, object] = {
        "rows": spec.rows,
        "columns": spec.columns,
        "width": spec.size[0] / spec.columns,
        "height": spec.size[1] / spec.rows,
        "force": np.zeros(spec.rows * spec.columns),
    }
    return (Topic("manipcli_msgs/msg/Taxels", ("force",), constant=fixed),)


def _check(spec: TactileSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    yield from needs_a_part(spec, scene)


def _sensed(spec: TactileSpec, robot: RobotModel, scene: Scene) -> Sensed:
    cells = spec.rows * spec.columns
    return Sensed("tactile", fields=(("force", cells),), forces=cells)


MEMBER = SensorMember(
    name="tactile", spec=TactileSpec, quantities=_quantities, topics=_topics, open=Taxels, check=_check, sensed=_sensed
)
