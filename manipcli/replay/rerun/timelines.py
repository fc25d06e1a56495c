"""The timelines of a recording: `time` [s] from the start of the log, and `tick`, the number of the control tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

if TYPE_CHECKING:
    import rerun as rr

TIME, TICK = "time", "tick"


@dataclass(frozen=True, slots=True)
class Timelines:
    """`period` of the control tick [s]; None for a log of another program, which has no ticks."""

    period: float | None

    def columns(self, times: npt.ArrayLike) -> list[rr.TimeColumn]:
        """The columns of (T,) times [s], for `RecordingStream.send_columns`."""
        import rerun as rr

        # Whole nanoseconds, as in the log: a conversion from float seconds would truncate.
        seconds = np.asarray(times, dtype=np.float64)
        nanoseconds = np.rint(seconds * 1e9).astype(np.int64).astype("timedelta64[ns]")
        found = [rr.TimeColumn(TIME, duration=nanoseconds)]
        if self.period is not None:
            found.append(rr.TimeColumn(TICK, sequence=np.rint(seconds / self.period).astype(np.int64)))
        return found

    def set(self, to: rr.RecordingStream, time: float) -> None:
        """The time [s] of what is logged next."""
        to.set_time(TIME, duration=np.timedelta64(round(time * 1e9), "ns"))
        if self.period is not None:
            to.set_time(TICK, sequence=round(time / self.period))


def changes(values: Array, grain: float) -> npt.NDArray[np.intp]:
    """Indices of the rows of (T, ...) that differ from the row before, the first included, in multiples of `grain`.

    Every row is within `grain` of the last of these rows: what holds its value needs no others.
    """
    rows = np.rint(values.reshape(len(values), -1) / grain)
    return np.flatnonzero(np.concatenate([[True], (rows[1:] != rows[:-1]).any(axis=1)]))
