"""The signal chain of a sensor of numbers: from the truth at a control tick to the reading that has arrived.

    truth -> low pass -> at every n-th tick: + offset + white noise -> quantisation -> limits -> dropout -> delay

The low pass of first order is discretised exactly for an input that is constant over a tick: its gain at f is
1 / sqrt(1 + (f / cut-off)^2) well below the control rate. The offset is drawn once and then walks; its variance grows
with the time, whether measurements arrive or not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Final

import numpy as np

from manipcli.control.compiled import bind
from manipcli.core.geometry import Array
from manipcli.simulate.sensor import Quantity

BLOCK: Final = 256
"""Measurements whose noise is drawn at once."""
_FIELDS: Final = ("noise.white", "noise.bias", "noise.walk", "noise.quantisation", "least", "most")
"""Of a quantity, one number for each of its numbers."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """When a sensor measures, in control ticks.

    Attributes:
        period: [s] of a tick.
        every: ticks from a measurement to the next; the first is at tick 0.
        delay: ticks from a measurement to its arrival.
        cutoff: [Hz] of the low pass; None: none.
        dropout: share of measurements that do not arrive.
    """

    period: float
    every: int = 1
    delay: int = 0
    cutoff: float | None = None
    dropout: float = 0.0


def generators(seed: int, name: str, count: int) -> list[np.random.Generator]:
    """Independent generators of a sensor, from the seed of the simulation and its name alone."""
    root = np.random.SeedSequence((seed, *name.encode()))
    return [np.random.default_rng(child) for child in root.spawn(count)]


class SignalChain:
    """The chain of one sensor.

    Args:
        quantities: its numbers.
        sampling: when it measures.
        seed, name: of the simulation and of the sensor; its noise depends on nothing else.
        truth: (width) where the probe writes; read at every `step`.
        reading: (width) the last measurement that arrived, the truth before the first; written by `step`. Default: an
            array of its own.

    Attributes:
        reading: as above.
    """

    def __init__(
        self,
        quantities: Sequence[Quantity],
        sampling: Sampling,
        *,
        seed: int,
        name: str,
        truth: Array,
        reading: Array | None = None,
    ) -> None:
        n = len(truth)
        self.reading = np.zeros(n) if reading is None else reading
        self._seed, self._name = seed, name
        self._sampling = sampling
        self._truth = truth
        self._white, self._bias, self._walk, self._quantum, self._least, self._most = (
            np.repeat([pick(q) for q in quantities], [q.width for q in quantities]).astype(np.float64)
            for pick in map(attrgetter, _FIELDS)
        )
        self._walk *= math.sqrt(sampling.every * sampling.period)
        cutoff = sampling.cutoff
        blend = 1.0 if cutoff is None else -math.expm1(-math.tau * cutoff * sampling.period)
        self._blend = np.array([blend])
        self._low = np.zeros(n)
        self._noise = np.zeros((BLOCK, n))
        self._lost = np.zeros(BLOCK, dtype=np.bool_)
        slots = sampling.delay // sampling.every + 1
        self._ring = np.zeros((slots, n))
        self._ring_lost = np.zeros(slots, dtype=np.bool_)
        self._times = np.array([sampling.every, sampling.delay], dtype=np.int64)
        self._steps = bind(
            "sensor", n, truth, self._low, self._noise.reshape(-1), self._lost, self._quantum, self._least, self._most,
            self._ring.reshape(-1), self._ring_lost, self.reading, self._blend, self._times,
        ) or self._law  # fmt: skip
        self._read = False
        self.reset()

    def reset(self) -> None:
        """Begin at tick 0 with the noise of tick 0; nothing is on its way. The reading is kept if there was one."""
        white, walk, bias, dropout = generators(self._seed, self._name, 4)
        self._generators = white, walk, dropout
        self._offset = self._bias * bias.standard_normal(len(self._bias))
        self._begins = True

    def step(self, tick: int) -> bool:
        """One control tick, counted from `reset`, after the probe has written the truth.

        Returns:
            whether a measurement arrives, which is then in `reading`.
        """
        if self._begins:
            self._begins = False
            self._low[:] = self._truth
            if not self._read:  # until the first measurement arrives
                self.reading[:] = self._truth
                self._read = True
        if tick % (BLOCK * self._sampling.every) == 0:
            self._draw()
        arrived: bool = self._steps(tick)
        return arrived

    def _draw(self) -> None:
        """The noise of the next `BLOCK` measurements."""
        white, walk, dropout = self._generators
        shape = self._noise.shape
        if self._walk.any():
            steps = self._walk * walk.standard_normal(shape)
            steps[0] += self._offset
            np.cumsum(steps, axis=0, out=self._noise)
            self._offset = self._noise[-1].copy()
        else:
            self._noise[:] = self._offset
        if self._white.any():
            self._noise += self._white * white.standard_normal(shape)
        if self._sampling.dropout:
            self._lost[:] = dropout.random(len(self._lost)) < self._sampling.dropout

    def _law(self, tick: int) -> bool:
        """The definition of the kernel `sensor`, operation by operation."""
        every, delay = self._sampling.every, self._sampling.delay
        low = self._low
        if self._sampling.cutoff is None:
            low[:] = self._truth
        else:
            low += self._blend * (self._truth - low)
        slots = len(self._ring)
        if tick % every == 0:
            k = tick // every
            values = low + self._noise[k % BLOCK]
            quantised = self._quantum > 0.0
            steps = np.rint(np.divide(values, self._quantum, where=quantised, out=values.copy()))
            values[quantised] = (steps * self._quantum)[quantised]
            self._ring[k % slots] = np.minimum(np.maximum(values, self._least), self._most)
            self._ring_lost[k % slots] = self._lost[k % BLOCK]
        due = tick - delay
        if due < 0 or due % every:
            return False
        k = due // every % slots
        if self._ring_lost[k]:
            return False
        self.reading[:] = self._ring[k]
        return True
