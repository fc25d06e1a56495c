"""The registry of checks of descriptions, in the order of tiers and codes.

One file per subject; the `reading_` files hold the checks whose findings the reader reports.
"""

from typing import get_args

from manipcli.core.registry import Seam
from manipcli.description.lint.check import Check, Tier
from manipcli.description.lint.checks import (
    collisions,
    control,
    control_numbers,
    joints,
    masses,
    materials,
    meshes,
    names,
    transmissions,
)
from manipcli.description.lint.checks import unknown_elements as elements
from manipcli.description.lint.checks.reading_meshes import READING_MESHES
from manipcli.description.lint.checks.reading_text import READING_TEXT
from manipcli.description.lint.checks.reading_tree import READING_TREE

_SUBJECTS = (
    *(collisions, control, control_numbers, elements, joints),
    *(masses, materials, meshes, names, transmissions),
)
_MEMBERS = [
    *(member for subject in _SUBJECTS for member in vars(subject).values() if isinstance(member, Check)),
    *(*READING_TEXT, *READING_TREE, *READING_MESHES),
]
_TIERS: tuple[Tier, ...] = get_args(Tier)

CHECKS: Seam[Check] = Seam(
    kind="check", members=tuple(sorted(_MEMBERS, key=lambda check: (_TIERS.index(check.tier), check.code)))
)
