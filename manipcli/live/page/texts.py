"""Texts of the page as HTML: time, steps, controllers, messages. All names and messages are escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import Final

from manipcli.live.page.snapshot import ACTIVE, ENDED, RESETTING, Snapshot
from manipcli.live.play_state import PAUSED

READ_ONLY: Final = "Read only: open the address with <code>?token=</code> that <code>manipcli serve</code> printed."
STOPPED: Final = (
    '<br><b style="color:#e03131">emergency stop: the brakes hold</b><br>To go on, press "Release emergency stop".'
)
ENDS: Final = {
    RESETTING: "<b>resetting ...</b><br>The log is closed and judged, then the simulation starts.",
    ENDED: '<b style="color:#e03131">session ended</b><br>This page shows its last state.',
}
_SIGNS: Final = {"running": ("▸", "#228be6"), "done": ("✓", "#2f9e44"), "skipped": ("–", "inherit")}
_FAILED: Final = ("✗", "#e03131")
_COLORS: Final = {30: "#e8890c", 40: "#e03131", 50: "#e03131"}
"""Of the levels of rcl_interfaces/Log."""
_BOX: Final = "font-size:0.8em;line-height:1.45;padding:0 0.75em;overflow-wrap:anywhere"


def status(snapshot: Snapshot | None, factor: float | None, notes: Iterable[str] = ()) -> str:
    """Simulated time, real-time factor and state; then one line per note."""
    if snapshot is None:
        return _box("<b>starting</b>")
    if snapshot.phase:
        return _box(f"<b>t = {snapshot.time:.2f} s</b> · {ENDS[snapshot.phase]}")
    paused = snapshot.simulation == PAUSED
    speed = "" if factor is None or paused else f" · real-time factor {factor:.2f}"
    word = " · <b>paused</b><br>Motions wait for Play or Step." if paused else ""
    word += STOPPED if snapshot.stopped else ""
    lines = [f"<b>t = {snapshot.time:.2f} s</b>{speed}{word}", *(escape(note) for note in notes)]
    return _box("<br>".join(lines))


def steps(known: Mapping[str, tuple[str, str]]) -> str:
    """One line per step; `known`: verb or text, and state, by step."""
    rows = []
    for step, (text, state) in known.items():
        sign, color = _SIGNS.get(state, _FAILED)
        rest = f' <span style="opacity:0.7">{escape(text)}</span>' if text else ""
        rows.append(f'<span style="color:{color}">{sign}</span> {escape(step)}{rest}')
    return _box("<br>".join(rows))


def controllers(states: Mapping[str, str]) -> str:
    """One line per controller."""
    rows = (
        f'{escape(name)} <span style="opacity:{1 if state == ACTIVE else 0.6}">{escape(state)}</span>'
        for name, state in states.items()
    )
    return _box("<br>".join(rows))


def messages(lines: Iterable[tuple[float, int, str]]) -> str:
    """The newest first; each with its simulated time [s] and level."""
    rows = []
    for time, level, text in lines:
        color = _COLORS.get(level, "inherit")
        rows.append(f'<span style="opacity:0.6">{time:.2f}</span> <span style="color:{color}">{escape(text)}</span>')
    return _box("<br>".join(reversed(rows)), "max-height:11em;overflow-y:auto")


def fault(error: Exception) -> str:
    """An error of the page itself; the session goes on."""
    return _box(f'<span style="color:{_COLORS[40]}">{escape(f"error of the page: {error!r}")}</span>')


def read_only() -> str:
    """For visitors who cannot command."""
    return _box(READ_ONLY)


def _box(content: str, style: str = "") -> str:
    return f'<div style="{_BOX};{style}">{content}</div>'
