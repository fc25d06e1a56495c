"""The reference position of each joint, from the traces of all controllers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.record.recording import ControllerTrace


def references(traces: Sequence[ControllerTrace], joints: Sequence[str], count: int) -> Array:
    """(T, n) the reference position [rad or m] of each joint from its active controller; NaN without one."""
    found = np.full((count, len(joints)), np.nan)
    index = {name: k for k, name in enumerate(joints)}
    for trace in traces:
        columns = [index[name] for name in trace.joints if name in index]
        mine = [k for k, name in enumerate(trace.joints) if name in index]
        position = trace.reference_position[:, mine]  # NaN while the controller is inactive
        found[:, columns] = np.where(np.isnan(position), found[:, columns], position)
    found.flags.writeable = False
    return found
