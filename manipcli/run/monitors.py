"""Monitors of a task's `watch:` during a run: the first tick at which a `never` holds or an `always` fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.conditions.robustness import Robustness, never
from manipcli.conditions.state_window import ROUNDING, StateWindow
from manipcli.judge.expectation import labels
from manipcli.judge.verdict import broken_at
from manipcli.run.live_conditions import Live, Probe
from manipcli.spec.condition import ExpectationSpec, WatchSpec


@dataclass(frozen=True, slots=True)
class Broken:
    """A broken watch; `index`: in the task; `text`: its name, the time, the amount and the measurement."""

    index: int
    text: str


class Monitors:
    """The watches of a run, each active from the start of its first step to the end of its last step.

    Args:
        watches: of the task.
        expect: its expectations, which share their names with the watches.
        live: evaluates them; a watch that it cannot evaluate is skipped, and judged as not evaluated.
    """

    def __init__(self, watches: Sequence[WatchSpec], expect: Sequence[ExpectationSpec], live: Live) -> None:
        self._live = live
        names = tuple(labels([*expect, *watches]))[len(expect) :]
        self._watches = [
            (k, watch, name)
            for k, (watch, name) in enumerate(zip(watches, names, strict=True))
            if live.absent(watch.condition) is None
        ]
        self._probes: dict[int, Probe] = {}
        self._ended: set[str] = set()
        self.broken: Broken | None = None
        """The first broken watch."""
        for k, watch, name in self._watches:
            if not watch.steps:
                self._open(k, watch, name)

    def step_started(self, step: str) -> None:
        """The next tick is the first of a step."""
        for k, watch, name in self._watches:
            if step in watch.steps and k not in self._probes:
                self._open(k, watch, name)

    def step_ended(self, step: str) -> None:
        """The last tick was the last of a step."""
        self._ended.add(step)
        for k, watch, _ in self._watches:
            if watch.steps and self._ended.issuperset(watch.steps) and k in self._probes:
                self._live.close(self._probes.pop(k))

    def close(self) -> None:
        """Evaluate no watch any more."""
        for probe in self._probes.values():
            self._live.close(probe)
        self._probes.clear()

    def _open(self, k: int, watch: WatchSpec, name: str) -> None:
        def callback(window: StateWindow, robustness: Robustness) -> None:
            if self.broken is None:
                self.broken = _broken(k, watch, name, window, robustness)

        self._probes[k] = self._live.open(watch.condition, callback=callback)


def _broken(k: int, watch: WatchSpec, name: str, window: StateWindow, robustness: Robustness) -> Broken | None:
    """The first tick of the window that breaks a watch; None without one."""
    answer = never(robustness) if watch.quantifier == "never" else robustness
    bad = answer.applies & ~(answer.order >= 0.0)
    if watch.steps:
        bad &= _during(watch.steps, window)
    if not bad.any():
        return None
    tick = int(np.argmax(bad))
    found, time = answer.found(tick), float(window.times[tick])
    return Broken(k, f"{broken_at(name)}t = {time:.3f} s{found.lacking}: {found.text}")


def _during(steps: Sequence[str], window: StateWindow) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(T,) True for ticks in one of the steps."""
    inside = np.zeros(len(window.times), dtype=np.bool_)
    for step in window.steps:
        if step.id in steps and step.started is not None:
            end = np.inf if step.ended is None else step.ended - ROUNDING
            inside |= (window.times >= step.started - ROUNDING) & (window.times < end)
    return inside
