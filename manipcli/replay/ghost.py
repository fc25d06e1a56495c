"""Ghosts of a replay: other runs of the same robot and scene, drawn translucent over the first run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.playback import Playback


@dataclass(frozen=True, slots=True)
class Ghost:
    """Another run at the T times of a playback.

    Attributes:
        name: shown at its switch.
        position: (T, n) joint positions.
        body: (T, m, 7) positions [m] and quaternions (x, y, z, w) of the movable bodies.
    """

    name: str
    position: Array
    body: Array


def ghost_of(name: str, run: Playback, shown: Playback) -> Ghost:
    """The ghost of `run` in the replay of `shown`: its nearest states; before its start and after its end, it rests.

    Both are runs of one task: the same joints and bodies, in the same order.
    """
    rows = np.array([run.index(time) for time in shown.times.tolist()], dtype=np.intp)
    body = np.concatenate([run.body_position, run.body_quat_xyzw], axis=2)
    return Ghost(name, run.stance[rows], body[rows])
