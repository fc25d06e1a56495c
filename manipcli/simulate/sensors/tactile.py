"""`tactile`: a grid of taxels on a surface, each of which measures the normal force on its cell, or the whole force.

The grid lies in the plane z = 0 of the sensor frame S, its middle at the origin; +z points out of the surface. The
force of a contact point within `depth` of the plane is shared by the four nearest cells, by distance; the sum of all
cells is that of the contact points on the grid. With `shear` a cell also measures the components along x and y of S of
the contact force (normal force and friction) on it, as taxels of three axes do (XELA uSkin).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem
from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.sensor import Quantity, SensorContext, SensorMember, Topic, limited
from manipcli.simulate.touched import needs_a_part, touched_by
from manipcli.spec.base import Model, problem
from manipcli.spec.mounted_sensor import MountedFilteredSpec
from manipcli.spec.quantity import Force, Length
from manipcli.spec.sensors import ForceNoise, SensorNoise

Side = Annotated[Length, Field(ge=1e-4, le=1.0)]
Cells = Annotated[int, Field(ge=1, le=64)]


class TactileNoise(SensorNoise):
    """Noise of each cell."""

    force: ForceNoise = Field(ForceNoise(), description="Noise of the force on a cell [N].")
    shear: ForceNoise | None = Field(
        None, description="Noise of each component along the surface [N]; only with `shear`. Default: none."
    )


class TactileLimits(Model):
    """Measuring range of each cell."""

    force: Annotated[Force, Field(gt=0)] | None = Field(None, description="[N], above 0. Default: unlimited.")
    shear: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="Of each component along the surface, in both directions; with `shear` [N], above 0. "
        "Default: unlimited.",
    )  # fmt: skip


class TactileSpec(MountedFilteredSpec):
    """A grid of taxels: the normal force on each cell of a surface, with `shear` all three components."""

    type: Literal["tactile"] = Field(description="`tactile`.")
    size: tuple[Side, Side] = Field(description="Lengths of the grid along x and y of its frame [m], 0.1 mm to 1 m.")
    columns: Cells = Field(description="Cells along x, 1 to 64.")
    rows: Cells = Field(description="Cells along y, 1 to 64.")
    depth: Annotated[Length, Field(gt=0, le=0.1)] = Field(
        0.005, description="Contact points up to this far from the plane count [m], up to 10 cm. Default 5 mm."
    )
    shear: bool | None = Field(
        None, description="Also measure the force on each cell along x and y of its frame. Default: false."
    )
    noise: TactileNoise = Field(TactileNoise(), description="Noise. Default: none.")
    limits: TactileLimits = Field(TactileLimits(), description="Measuring range. Default: unlimited.")

    @model_validator(mode="after")
    def _shear_is_measured(self) -> TactileSpec:
        for block, given in (("noise", self.noise.shear), ("limits", self.limits.shear)):
            if given is not None and not self.shear:
                message = f"'{block}: {{shear: ...}}' has no effect: these taxels measure the normal force alone"
                raise problem("conflict", message, at=(block, "shear"), hint="add `shear: true` to the sensor")
        return self


class Taxels:
    """Reads (n) or (3 n): the force on each of n = rows * columns cells, row by row, then those along x, along y."""

    def __init__(self, spec: TactileSpec, context: SensorContext) -> None:
        self._engine, self._mount = context.engine, context.place
        self._half = np.array(spec.size) / 2.0
        self._counts = np.array([spec.columns, spec.rows])
        self._depth = spec.depth
        self._cells = spec.rows * spec.columns
        self._read = np.zeros(self._cells * (3 if spec.shear else 1))
        self._shear = bool(spec.shear)

    def read(self, state: WorldState) -> Array:
        self._read[:] = 0.0
        X_WS = None
        for contact, sign in touched_by(self._engine, self._mount.part):
            if X_WS is None:
                X_WS = self._mount.pose(state)
            for position, normal, force, friction in contact.points:
                place = X_WS.R.T @ (np.array(position) - X_WS.p)
                pressing = -sign * force * float(X_WS.R[:, 2] @ np.array(normal))
                if pressing > 0.0 and abs(place[2]) <= self._depth and (abs(place[:2]) <= self._half).all():
                    forces = [pressing]
                    if self._shear:
                        on_it = sign * (force * np.array(normal) + np.array(friction))
                        forces += (X_WS.R.T @ on_it)[:2].tolist()
                    self._share(place[:2], forces)
        return self._read

    def _share(self, place: Array, forces: Sequence[float]) -> None:
        """Add the components of a force at `place` (2) to the cells whose middles are around it; at a border fewer."""
        at = (place + self._half) / (2.0 * self._half) * self._counts - 0.5
        at = np.clip(at, 0.0, self._counts - 1.0)
        low = np.minimum(at.astype(int), np.maximum(self._counts - 2, 0))
        high = np.minimum(low + 1, self._counts - 1)
        part = at - low
        for column, along in ((low[0], 1.0 - part[0]), (high[0], part[0])):
            for row, across in ((low[1], 1.0 - part[1]), (high[1], part[1])):
                for k, force in enumerate(forces):
                    self._read[k * self._cells + row * self._counts[0] + column] += force * along * across


def _quantities(spec: TactileSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    cells = spec.rows * spec.columns
    most = np.inf if spec.limits.force is None else spec.limits.force
    force = Quantity("force", cells, spec.noise.force, 0.0, most)
    if not spec.shear:
        return (force,)
    return force, limited("shear", 2 * cells, spec.noise.shear or ForceNoise(), spec.limits.shear)


def _topics(spec: TactileSpec, robot: RobotModel) -> tuple[Topic, ...]:
    cells = spec.rows * spec.columns
    grid: dict[str, object] = {
        "rows": spec.rows,
        "columns": spec.columns,
        "width": spec.size[0] / spec.columns,
        "height": spec.size[1] / spec.rows,
    }
    none = np.zeros(cells)
    normal = Topic("manipcli_msgs/msg/Taxels", ("force",), constant={**grid, "force": none})
    if not spec.shear:
        return (normal,)
    along = {**grid, "x": none, "y": none}
    return (
        replace(normal, derive=partial(_columns, 0, cells)),
        Topic("manipcli_msgs/msg/TaxelShear", ("x", "y"), along, "/shear", derive=partial(_columns, cells, 3 * cells)),
    )


def _columns(first: int, end: int, reading: Array) -> Array:
    return reading[:, first:end]


def _check(spec: TactileSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    yield from needs_a_part(spec, scene)


def _sensed(spec: TactileSpec, robot: RobotModel, scene: Scene) -> Sensed:
    cells = spec.rows * spec.columns
    fields = (("", "force", cells), ("/shear", "x", cells), ("/shear", "y", cells))
    most = {quantity.name: quantity.most for quantity in _quantities(spec, robot)}
    shown = fields if spec.shear else fields[:1]
    return Sensed("tactile", fields=shown, forces=cells, shear=bool(spec.shear), most=most)


MEMBER = SensorMember(
    name="tactile", spec=TactileSpec, quantities=_quantities, topics=_topics, open=Taxels, check=_check, sensed=_sensed
)
