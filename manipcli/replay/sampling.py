"""A recording at the rate of a screen, in one pass over its spans, and its curves at full rate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, frozen
from manipcli.judge.measures.reference import references
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.record.recording import ContactSnapshot, Recording, Span, joined
from manipcli.replay.playback import PlotTable, force_table, joint_tables


@dataclass(frozen=True, slots=True)
class Samples:
    """Some ticks of a recording; the arrays are those of `Playback`. `end`: the last tick of the recording [s]."""

    times: Array
    position: Array
    velocity: Array
    effort: Array
    reference: Array
    body_position: Array
    body_quat_xyzw: Array
    contacts: tuple[tuple[Contact, ...], ...]


def sampled(recording: Recording, *, rate: float) -> Samples:
    """The ticks nearest to multiples of 1 / rate, and the last one; one span in memory at a time.

    Args:
        recording: any.
        rate: [Hz]; beyond that of the recording every tick is taken.
    """
    chosen: list[Span] = []
    gathered = _Contacts()
    before = -1.0
    for span in recording.spans:
        times = span.states.time
        if not len(times):
            continue
        # Number of the last multiple that a tick is the nearest to, or past: a tick is taken where it grows.
        number = np.floor((times + recording.period / 2.0) * rate + 1e-9)
        ticks = np.flatnonzero(np.diff(number, prepend=before))
        before = float(number[-1])
        chosen.append(_picked(span, ticks))
        gathered.add(span.contacts, times[ticks])
        last = _picked(span, np.array([len(times) - 1]))
    if not chosen:
        nothing = frozen(np.zeros((0, len(recording.joint_names))))
        bodies = np.zeros((0, len(recording.body_names), 7))
        return Samples(
            frozen([]), nothing, nothing, nothing, nothing, frozen(bodies[..., :3]), frozen(bodies[..., 3:]), ()
        )
    if last.states.time[0] not in chosen[-1].states.time:
        chosen.append(last)
        gathered.add((), last.states.time)
    whole = joined(chosen)
    return Samples(
        times=whole.states.time,
        position=whole.states.position,
        velocity=whole.states.velocity,
        effort=whole.states.effort,
        reference=references(whole.controllers, recording.joint_names, len(whole.states.time)),
        body_position=whole.states.body_position,
        body_quat_xyzw=whole.states.body_quat_xyzw,
        contacts=gathered.finish(),
    )


def _picked(span: Span, ticks: npt.NDArray[np.intp]) -> Span:
    return Span(
        states=span.states.map(lambda a: a[ticks].copy()),
        controllers=tuple(trace.map(lambda a: a[ticks].copy()) for trace in span.controllers),
        contacts=(),
    )


class _Contacts:
    """What touched since the time before, for each of a growing number of times."""

    def __init__(self) -> None:
        self._now: tuple[Contact, ...] = ()
        self._waiting: list[ContactSnapshot] = []
        self._found: list[tuple[Contact, ...]] = []

    def add(self, snapshots: Iterable[ContactSnapshot], times: Array) -> None:
        self._waiting += snapshots
        for time in times.tolist():
            strongest = {(one.a, one.b): one for one in self._now}
            taken = 0
            for snapshot in self._waiting:
                if snapshot.time > time:
                    break
                taken += 1
                self._now = snapshot.contacts
                for one in snapshot.contacts:
                    known = strongest.get((one.a, one.b))
                    if known is None or one.force >= known.force:
                        strongest[one.a, one.b] = one
            del self._waiting[:taken]
            self._found.append(tuple(strongest[pair] for pair in sorted(strongest)))

    def finish(self) -> tuple[tuple[Contact, ...], ...]:
        return tuple(self._found)


def plot_tables(recording: Recording, robot: RobotModel | None) -> tuple[PlotTable, ...]:
    """The curves of a recording, every tick of it.

    Args:
        recording: any.
        robot: says the units of joints and where the tool is; None: neither.
    """
    whole = joined(recording.spans)
    states, names = whole.states, recording.joint_names
    reference = references(whole.controllers, names, len(states.time))
    forces = force_table(states.time, _held(whole.contacts, states.time))
    return (
        *joint_tables(names, robot, states.time, states.position, states.velocity, states.effort, reference),
        *((forces,) if forces.columns else ()),
    )


def _held(snapshots: Sequence[ContactSnapshot], times: Array) -> list[tuple[Contact, ...]]:
    """What touches at each of `times` (T,) [s]."""
    last = np.searchsorted([one.time for one in snapshots], times, side="right") - 1
    return [snapshots[k].contacts if k >= 0 else () for k in last.tolist()]
