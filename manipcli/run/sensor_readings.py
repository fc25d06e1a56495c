"""Readings of sensors during a run, as the log has them: those that live conditions ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from manipcli.conditions.sensed import Readings, Sensed, pixels_of_parts
from manipcli.core.geometry import Array
from manipcli.simulate.sensor import Picture
from manipcli.simulate.sensor_bank import SensorBank


@dataclass(slots=True)
class _Followed:
    """A sensor that a condition asks for: when its readings arrived [s], and what they were."""

    sensed: Sensed
    times: list[float] = field(default_factory=list)
    values: list[Array] = field(default_factory=list)

    def add(self, time: float, values: Array) -> None:
        self.times.append(time)
        self.values.append(values)


class SensorReadings:
    """Follows the sensors that are asked for, from the first time on; without any it costs nothing.

    Args:
        bank: of the session.
        sensed: its sensors.
        further: what is read like a sensor and is not in the bank: whether it arrived at this tick, and the numbers.
    """

    def __init__(self, bank: SensorBank, sensed: Mapping[str, Sensed], further: Mapping[str, Array] = {}) -> None:
        self._bank = bank
        self._further = further
        self._sensed = sensed
        self._followed: dict[str, _Followed] = {}
        self._numbers: list[tuple[Array, _Followed]] = []
        self._pictures: dict[str, Picture] = {}
        self.follows = False
        """Whether `tick` has to be called."""

    def follow(self, name: str, now: float | None) -> None:
        """Keep the readings of a sensor, from the last one before the next tick; `now` [s]: the last tick, if any."""
        if name in self._followed:
            return
        sensed = self._sensed[name]
        followed = self._followed[name] = _Followed(sensed)
        if sensed.parts:
            if now is not None and name in self._pictures:
                followed.add(now, _pixels(self._pictures[name], sensed))
            return
        self.follows = True
        own = self._further.get(name)
        row = self._bank.arriving(name) if own is None else own
        self._numbers.append((row, followed))
        if now is not None and (own is not None or self._bank.heard(name)):
            followed.add(now, row[1:].copy())

    def tick(self, time: float) -> None:
        """Keep what arrives at this tick."""
        for row, followed in self._numbers:
            if row[0]:
                followed.add(time, row[1:].copy())

    def picture(self, time: float, name: str, picture: Picture) -> None:
        """Keep a message of a camera that arrives at this tick."""
        sensed = self._sensed.get(name)
        if sensed is None or not sensed.parts or picture.suffix != sensed.picture:
            return
        self._pictures[name] = picture
        if name in self._followed:
            self._followed[name].add(time, _pixels(picture, sensed))

    def readings(self) -> dict[str, Readings]:
        """All that is kept, by name."""
        return {
            name: Readings(np.array(each.times), np.array(each.values).reshape(len(each.times), each.sensed.width))
            for name, each in self._followed.items()
        }

    def forget(self) -> None:
        """Keep only the last reading of each."""
        for each in self._followed.values():
            del each.times[:-1], each.values[:-1]


def _pixels(picture: Picture, sensed: Sensed) -> Array:
    data, encoding = picture.fields["data"], picture.fields["encoding"]
    assert isinstance(data, bytes)
    assert isinstance(encoding, str)
    return pixels_of_parts(data, encoding, len(sensed.parts))
