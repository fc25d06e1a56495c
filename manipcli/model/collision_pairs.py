"""Parts of a collision query, and as matrices which pairs of them are checked and with which margin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

if TYPE_CHECKING:
    import pinocchio as pin

    from manipcli.shapes.proximity import CollisionGeometry


@dataclass(frozen=True, slots=True)
class Part:
    """A shape of a link or of a body; `placement` is in the frame of `joint` (0: the world)."""

    name: str
    role: Literal["link", "carried", "scene"]
    joint: int
    placement: pin.SE3
    shape: CollisionGeometry


def checked_pairs(
    parts: Sequence[Part],
    model: pin.Model,
    near: frozenset[tuple[int, int]],
    allowed: set[frozenset[str]],
    only: str | None,
) -> npt.NDArray[np.bool_]:
    """(parts, parts) the checked pairs: parts that can move relative to each other through more than one joint."""
    joint = np.array([part.joint for part in parts], dtype=np.intp)
    link = np.array([part.role == "link" for part in parts], dtype=bool)
    role = np.array([part.role for part in parts])
    adjacent = np.zeros((model.njoints, model.njoints), dtype=bool)
    for a, b in near:
        adjacent[a, b] = True
    apart = joint[:, None] != joint
    links = link[:, None] & link & apart & ~adjacent[joint[:, None], joint]
    checked = links | ((role[:, None] != role) & (apart | ~(link[:, None] | link)))
    number: dict[str, int] = {}
    name = np.array([number.setdefault(part.name, len(number)) for part in parts], dtype=np.intp)
    free = np.ones((len(number), len(number)), dtype=bool)
    for pair in allowed:
        a, b = (number.get(each, -1) for each in (*pair, *pair)[:2])
        if a >= 0 and b >= 0:
            free[a, b] = free[b, a] = False
    checked &= free[name[:, None], name]
    if only is not None:
        alone = np.array([part.name == only for part in parts], dtype=bool)
        checked &= alone[:, None] | alone
    return np.triu(checked, 1)


def margins_of(names: Sequence[str], margin: float, margins: Mapping[frozenset[str], float]) -> Array:
    """(parts, parts) [m]: `margin`, or the pair's own one."""
    found = np.full((len(names), len(names)), margin)
    if margins:
        for (i, a), (j, b) in combinations(enumerate(names), 2):
            found[i, j] = margins.get(frozenset((a, b)), margin)
    return found
