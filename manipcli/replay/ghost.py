"""Ghosts of a replay: other runs of the same robot and scene, or its plan, drawn translucent over the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.playback import Playback


@dataclass(frozen=True, slots=True)
class Ghost:
    """Another run, or the plan, at the T times of a playback.

    Attributes:
        name: shown at its switch.
        position: (T, n) joint positions.
        body: (T, m, 7) positions [m] and quaternions (x, y, z, w) of the movable bodies.
        kind: what it is; the plan has its own colour.
        visible: starts and ends [s] between which it is drawn; None: always.
    """

    name: str
    position: Array
    body: Array
    kind: Literal["run", "planned"] = "run"
    visible: tuple[tuple[float, float], ...] | None = None


def ghost_of(name: str, run: Playback, shown: Playback) -> Ghost:
    """The ghost of `run` in the replay of `shown`: its nearest states; before its start and after its end, it rests.

    Both are runs of one task: the same joints and bodies, in the same order.
    """
    rows = np.array([run.index(time) for time in shown.times.tolist()], dtype=np.intp)
    body = np.concatenate([run.body_position, run.body_quat_xyzw], axis=2)
    return Ghost(name, run.stance[rows], body[rows])
