"""Contact forces of a page: arrows that the parts carry along, as JSON and arrays in its pack."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.render.placing import Poses
from manipcli.replay.forces import LONGEST, Forces, Push
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback

POINT = 1e-3
"""Largest distance of a drawn contact point from the sampled one, relative to the position of its part [m]."""
FORCE = 0.005
"""Largest difference of a drawn force from the sampled one, as a share of it."""
MOST = 40_000
"""Most arrows of a page."""


def pushes_json(playback: Playback, poses: Poses, index: Mapping[str, int], pack: Pack) -> Json | None:
    """Rows of point, normal force and friction, the pair of each row, and the first row of each time of a change.

    A point is relative to the position of its part, which carries it along; forces are in world axes.

    Args:
        playback: the run.
        poses: of its frames at its times.
        index: number of each frame.
        pack: gets the arrays.
    """
    forces = Forces(playback, poses)
    if not forces.scale:
        return None
    pushes_at = [forces.at(k) for k in range(len(playback.times))]
    pairs = {pair: k for k, pair in enumerate(dict.fromkeys((p.on, p.other) for each in pushes_at for p in each))}
    frames = [_frame(on, index) for on, _ in pairs]
    rows_at = [
        _rows(pushes, [frames[pairs[p.on, p.other]] for p in pushes], poses.position[k])
        for k, pushes in enumerate(pushes_at)
    ]
    pair_at = [[pairs[push.on, push.other] for push in pushes] for pushes in pushes_at]
    kept = _changes(rows_at, pair_at)
    kept = _fewer(kept, [float(np.abs(rows[:, 3:6]).sum()) for rows in rows_at], pair_at)
    # Rounded to 1e-6 without -0: further digits differ between processes.
    rows = np.round(np.concatenate([rows_at[k] for k in kept]), 6) + 0.0
    return {
        "times": pack.add(playback.times[kept], "f"),
        "first": pack.add(np.cumsum([0, *(len(rows_at[k]) for k in kept)]), "I"),
        "rows": pack.add(rows, "f"),
        "pair": pack.add([pair for k in kept for pair in pair_at[k]], "H"),
        "pairs": [[name.removeprefix("robot/") for name in pair] for pair in pairs],
        "frames": frames,
        "scale": forces.scale,
        "longest": LONGEST,
    }


def _frame(name: str, index: Mapping[str, int]) -> int:
    """The frame of a part; the world for a part that is not drawn."""
    return index.get(name, 0)


def _rows(pushes: Sequence[Push], frames: Sequence[int], positions: Array) -> Array:
    """(p, 9) point relative to the position of its part, normal force and friction of each push, in world axes."""
    rows = [
        [*(push.point - positions[frame]), *push.normal, *push.friction]
        for push, frame in zip(pushes, frames, strict=True)
    ]
    return np.array(rows).reshape(-1, 9)


def _changes(rows_at: Sequence[Array], pair_at: Sequence[list[int]]) -> list[int]:
    """Times at which the pushes differ from those of the last such time."""
    kept = [0]
    for k in range(1, len(rows_at)):
        if pair_at[k] != pair_at[kept[-1]]:
            kept.append(k)
            continue
        apart = np.abs(rows_at[k] - rows_at[kept[-1]])
        strength = np.linalg.norm(rows_at[k][:, 3:], axis=1, keepdims=True)
        if (apart[:, :3] > POINT).any() or (apart[:, 3:] > FORCE * strength).any():
            kept.append(k)
    return kept


def _fewer(kept: list[int], strength: Sequence[float], pair_at: Sequence[list[int]]) -> list[int]:
    """Of neighbouring times with the same pairs the one with the largest forces, until there are at most `MOST`
    arrows."""
    while sum(len(pair_at[k]) for k in kept) > MOST and len(kept) > 2:
        fewer: list[int] = []
        k = 0
        while k < len(kept):
            two = kept[k : k + 2]
            if len(two) == 2 and set(pair_at[two[0]]) == set(pair_at[two[1]]):
                fewer.append(max(two, key=lambda time: strength[time]))
            else:
                fewer += two
            k += 2
        if len(fewer) == len(kept):
            break
        kept = fewer
    return kept
