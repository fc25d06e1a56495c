"""Deadlines, and texts of an `until` that does not hold."""

from __future__ import annotations

from manipcli.plan.motion import Motion
from manipcli.run.live_conditions import Probe
from manipcli.simulate.executor import MotionEnd


def missing(end: MotionEnd, probe: Probe | None) -> str:
    """By how much `until` fails, if the motion ended for it; else ""."""
    missing = probe.missing if probe is not None and end.awaited else ""
    return f"; at the end {missing}" if missing else ""


def no_longer(motion: Motion, probe: Probe | None) -> str:
    """By how much the `until` of a guarded motion fails at rest, after a bounce; "" if it holds."""
    missing = probe.missing if motion.guarded and probe is not None and not probe.holds else ""
    return f"; at rest {missing}" if missing else ""


def sooner(a: float | None, b: float | None) -> float | None:
    """The earlier of two deadlines [s]; None: no deadline."""
    return min((one for one in (a, b) if one is not None), default=None)
