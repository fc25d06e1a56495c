"""Figures of curves as SVG, PNG or PDF with matplotlib, without a display and with reproducible bytes."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from manipcli.core.errors import InvalidArgument
from manipcli.replay.curves import Chart, Interval, Panel, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Kind = Literal["svg", "png", "pdf"]
KINDS: tuple[Kind, ...] = get_args(Kind)

WIDTH = 10.0
"""Width of a figure [inch]."""
HEIGHT = 2.3
"""Height of a panel [inch]; a single one is twice as high."""
DPI = 120
COLUMNS = 2400
"""Pixel columns for thinning a curve, more than any screen has."""
INK, FAINT = "#1e242c", "#6b7684"
GRID = "#dfe4ea"
BANDS = ("#f1f4f8", "#e6ebf2")
FAILED = "#fbe3e0"
# Ten distinguishable colours, also for most colour-blind readers, then lighter versions of them.
COLOURS = (
    "#2f6fb0", "#e07b28", "#3a9a5b", "#c8403f", "#7d5ba6", "#8a5a44", "#d26aa8", "#5f6b7a", "#a89a1d", "#27a3b4",
    "#8fb8e0", "#f4bd8d", "#97d0aa", "#ea9f9e", "#bfabd8", "#c4a596", "#eab6d5", "#b3bcc7", "#d8ce73", "#8fd3dc",
)  # fmt: skip
DASHES: tuple[Literal["-", "--", ":", "-."], ...] = ("-", "--", ":", "-.")
MOST_NAMED = 24
"""Most curves in a legend, so that it is not higher than its panel."""


def kind_of(path: Path) -> Kind:
    """Format of a figure by its file name.

    Raises:
        InvalidArgument: unknown file ending.
    """
    for kind in KINDS:
        if path.suffix.lower() == f".{kind}":
            return kind
    raise InvalidArgument("USE061", f"'{path}' is not a figure: use {', '.join(f'.{kind}' for kind in KINDS)}")


def render(chart: Chart, kind: Kind) -> bytes:
    """The bytes of the figure file of a chart."""
    return drawn(lambda: _figure(chart), kind)


def drawn(figure: Callable[[], Figure], kind: Kind) -> bytes:
    """The bytes of the file of a figure that is made in the common style."""
    import matplotlib

    stream = BytesIO()
    # No date: equal charts give equal bytes.
    metadata: dict[Kind, dict[str, str | None]] = {
        "svg": {"Date": None, "Creator": "manipcli"},
        "pdf": {"CreationDate": None, "Creator": "manipcli", "Producer": None},
        "png": {"Software": "manipcli"},
    }
    style = matplotlib.rc_context(
        {
            "font.family": "DejaVu Sans",
            "font.size": 9.0,
            "axes.edgecolor": FAINT,
            "axes.labelcolor": INK,
            "axes.linewidth": 0.8,
            "text.color": INK,
            "text.parse_math": False,
            "xtick.color": FAINT,
            "ytick.color": FAINT,
            "xtick.labelcolor": INK,
            "ytick.labelcolor": INK,
            "axes.formatter.useoffset": False,
            "svg.fonttype": "path",
            "svg.hashsalt": "manipcli",
            "pdf.fonttype": 42,
        }
    )
    with style:
        figure().savefig(stream, format=kind, dpi=DPI, metadata=metadata[kind])
    return stream.getvalue()


def _figure(chart: Chart) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    count = len(chart.panels)
    height = HEIGHT * count if count > 1 else 2.0 * HEIGHT
    figure = Figure(figsize=(WIDTH, height + 0.9), layout=ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.08))
    figure.suptitle(chart.title, x=0.01, ha="left", fontsize=12.0, fontweight="bold")
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    colours = _colours(chart)
    before: object = None
    for place, panel, of in zip(axes, chart.panels, colours, strict=True):
        _panel(place, chart, panel, of)
        named = (panel.labels if len(panel.labels) > 1 else (), panel.logs)
        if named != before and len(panel.curves) > 1:
            _legend(place, panel, of)
        before = named
    figure.align_ylabels(list(axes))
    _step_names(axes[0], chart)
    axes[-1].set_xlim(chart.start, chart.end)
    axes[-1].set_xlabel("time [s]")
    return figure


def _colours(chart: Chart) -> list[dict[tuple[str, str], str]]:
    """Colour of (label, log) for each panel: by label, the same in all panels; by log if there is only one label."""
    of: dict[str, str] = {}
    found = []
    for panel in chart.panels:
        if len(panel.labels) == 1:
            keys = {(panel.labels[0], log): COLOURS[k % len(COLOURS)] for k, log in enumerate(panel.logs)}
            found.append(keys)
            continue
        fresh = [label for label in panel.labels if label not in of]
        # Another kind of labels starts at the first colour.
        first = 0 if len(fresh) == len(panel.labels) else len(of)
        of.update((label, COLOURS[(first + k) % len(COLOURS)]) for k, label in enumerate(fresh))
        found.append({(curve.label, curve.log): of[curve.label] for curve in panel.curves})
    return found


def _panel(place: Axes, chart: Chart, panel: Panel, colours: dict[tuple[str, str], str]) -> None:
    for k, step in enumerate(chart.steps):
        shade = BANDS[k % 2] if step.done else FAILED
        place.axvspan(step.start, step.end, facecolor=shade, edgecolor="none", zorder=0.5)
    place.grid(visible=True, color=GRID, linewidth=0.6)
    place.set_axisbelow(True)
    for side in ("top", "right"):
        place.spines[side].set_visible(False)
    logs = panel.logs
    for curve in panel.curves:
        times, values = thinned(curve, chart.start, chart.end, COLUMNS)
        place.plot(
            times,
            values,
            color=colours[curve.label, curve.log],
            linestyle=DASHES[logs.index(curve.log) % len(DASHES)],
            linewidth=1.2,
            drawstyle="steps-post" if curve.held else "default",
            marker="." if len(times) < 3 else None,
        )
    place.set_ylabel(panel.axis)
    place.set_title(panel.title_with_label, loc="left", fontsize=8.5, color=FAINT, pad=3.0)
    place.margins(y=0.08)


def _legend(place: Axes, panel: Panel, colours: dict[tuple[str, str], str]) -> None:
    from matplotlib.lines import Line2D

    logs, labels = panel.logs, panel.labels
    handles = []
    if len(labels) > 1:
        for label in labels[:MOST_NAMED]:
            colour = next(colours[curve.label, curve.log] for curve in panel.curves if curve.label == label)
            handles.append(Line2D([], [], color=colour, linewidth=1.6, label=label))
        if len(labels) > MOST_NAMED:
            handles.append(Line2D([], [], linestyle="none", label=f"and {len(labels) - MOST_NAMED} more"))
    if len(logs) > 1:
        for k, log in enumerate(logs):
            colour = FAINT if len(labels) > 1 else colours[labels[0], log]
            dash = DASHES[k % len(DASHES)]
            handles.append(Line2D([], [], color=colour, linestyle=dash, linewidth=1.6, label=log))
    place.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.005, 1.02),
        borderaxespad=0.0,
        frameon=False,
        fontsize=7.5,
        ncols=1 + (len(handles) > 12),
        handlelength=1.4,
        columnspacing=1.0,
        labelspacing=0.25,
    )


def _step_names(place: Axes, chart: Chart) -> None:
    """Step names above the first panel, rotated if a step is too short for its name."""
    width = max(chart.end - chart.start, 1e-9)
    for step in chart.steps:
        start, end = max(step.start, chart.start), min(step.end, chart.end)
        if end <= start:
            continue
        # Characters that fit; the whole width holds about 150.
        fits = len(step.name) <= (end - start) / width * 130.0
        place.annotate(
            _shown(step),
            xy=((start + end) / 2.0, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0.0, 14.0),
            textcoords="offset points",
            ha="center" if fits else "left",
            va="bottom",
            rotation=0.0 if fits else 45.0,
            rotation_mode="anchor",
            fontsize=8.0,
            color=INK if step.done else "#b3261e",
            annotation_clip=False,
        )


def _shown(step: Interval) -> str:
    return step.name if step.done else f"✗ {step.name}"
