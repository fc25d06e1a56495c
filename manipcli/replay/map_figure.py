"""Figure of maps seen from above, side by side: values and reasons on a grid, with the outlines of what is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from manipcli.core.geometry import Array
from manipcli.replay.figure import COLOURS, FAINT, INK, Kind, drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GOOD: Final = "#3a9a5b"
REASONS: Final = tuple(colour for colour in COLOURS if colour != GOOD)
OTHER: Final = "#d7dce2"
"""Of reasons beyond the colours."""


LEAST_SHARE: Final = 0.6
"""Least ratio of the sides of what is shown."""


@dataclass(frozen=True, slots=True)
class Layer:
    """A map of numbers (rows of y, columns of x); NaN where there is none. `top`: end of the colours; None: largest."""

    title: str
    values: Array
    top: float | None = None


@dataclass(frozen=True, slots=True)
class Outline:
    """A polygon (k, 2) [m] with a name; `moved`: the object that the map moves, where the file has it."""

    name: str
    points: Array
    moved: bool = False


@dataclass(frozen=True, slots=True)
class Map:
    """Maps over the same grid.

    Attributes:
        title: of the figure.
        axes: labels of x and y.
        x, y: (n,) and (m,) [m] evenly spaced.
        reasons: (m, n) index of the reason in `legend`; -1: good, -2: nothing known.
        good: label of what is good.
        legend: the reasons.
        layers: maps of numbers.
        outlines: of bodies.
        base: (2,) [m] of the robot.
    """

    title: str
    axes: tuple[str, str]
    x: Array
    y: Array
    reasons: NDArray[np.int64]
    good: str
    legend: tuple[str, ...]
    layers: tuple[Layer, ...]
    outlines: tuple[Outline, ...]
    base: Array


def map_figure(found: Map, kind: Kind) -> bytes:
    """The bytes of the figure file."""
    return drawn(lambda: _figure(found), kind)


def _figure(found: Map) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.patches import Patch

    low, high = _limits(found)
    width, height = high - low
    count = 1 + len(found.layers)
    panel = min(5.2, 4.2 * max(0.5, width / height))
    rows = 1 + len(found.legend)
    figure = Figure(
        figsize=(count * (panel + 0.9), panel * height / width + 1.0 + 0.19 * rows),
        layout=ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.08),
    )
    figure.suptitle(found.title, x=0.01, ha="left", fontsize=12.0, fontweight="bold")
    places: Sequence[Axes] = figure.subplots(1, count, sharex=True, sharey=True, squeeze=False)[0]
    _reasons(places[0], found)
    for place, layer in zip(places[1:], found.layers, strict=True):
        image = place.imshow(
            layer.values, origin="lower", extent=_extent(found), cmap="viridis", vmin=0.0, vmax=_top(layer)
        )
        place.set_title(layer.title, loc="left", fontsize=9.0)
        figure.colorbar(image, ax=place, shrink=0.8, pad=0.02)
    for place in places:
        _outlines(place, found)
        place.set_xlim(low[0], high[0])
        place.set_ylim(low[1], high[1])
        place.set_aspect("equal")
        place.set_xlabel(found.axes[0])
    places[0].set_ylabel(found.axes[1])
    patches = [Patch(facecolor=GOOD, label=found.good)] if found.good else []
    patches += [Patch(facecolor=_colour(k), label=text) for k, text in enumerate(found.legend)]
    figure.legend(handles=patches, loc="outside lower left", frameon=False, fontsize=8.5, ncols=1, labelspacing=0.25)
    return figure


def _reasons(place: Axes, found: Map) -> None:
    from matplotlib.colors import to_rgba

    colours = np.zeros((*found.reasons.shape, 4))
    for k in np.unique(found.reasons).tolist():
        colours[found.reasons == k] = (1.0, 1.0, 1.0, 0.0) if k == -2 else to_rgba(GOOD if k == -1 else _colour(k))
    place.imshow(colours, origin="lower", extent=_extent(found))
    place.set_title("can be planned, or why not", loc="left", fontsize=9.0)


def _outlines(place: Axes, found: Map) -> None:
    from matplotlib.patches import Polygon
    from matplotlib.patheffects import withStroke

    for outline in found.outlines:
        colour = "#c8403f" if outline.moved else INK
        place.add_patch(
            Polygon(outline.points, closed=True, fill=False, edgecolor=colour, linewidth=1.4 if outline.moved else 1.0)
        )
        left, top = outline.points[:, 0].min(), outline.points[:, 1].max()
        place.text(
            left, top, f" {outline.name}", fontsize=7.5, color=colour, va="bottom", clip_on=True
        ).set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    base = float(found.base[0]), float(found.base[1])
    place.plot(*base, marker="^", color=INK, markersize=9.0)
    place.annotate("robot", base, xytext=(0, -14), textcoords="offset points", ha="center", fontsize=7.5)
    for side in ("top", "right"):
        place.spines[side].set_visible(False)
    place.set_facecolor("#ffffff")
    place.tick_params(color=FAINT)


def _colour(k: int) -> str:
    return REASONS[k] if k < len(REASONS) else OTHER


def _top(layer: Layer) -> float:
    if layer.top is not None:
        return layer.top
    known = layer.values[np.isfinite(layer.values)]
    return float(known.max()) if len(known) and known.max() > 0.0 else 1.0


def _extent(found: Map) -> tuple[float, float, float, float]:
    """Outer edges of the cells."""
    edges = []
    for axis, other in ((found.x, found.y), (found.y, found.x)):
        spacing = next((float(each[1] - each[0]) for each in (axis, other) if len(each) > 1), 0.02)
        edges += [float(axis[0]) - spacing / 2.0, float(axis[-1]) + spacing / 2.0]
    return edges[0], edges[1], edges[2], edges[3]


def _limits(found: Map) -> tuple[Array, Array]:
    """Lower and upper corner of what is shown: the grid, the robot's base, and a margin; never a narrow strip."""
    x0, x1, y0, y1 = _extent(found)
    points = np.array([[x0, y0], [x1, y1], found.base])
    size = np.ptp(points, axis=0)
    half = np.maximum(size, LEAST_SHARE * size.max()) / 2.0 + 0.04 * size.max()
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return middle - half, middle + half
