"""What can be wrong with a description, in the order of tiers and codes.

A file a subject; what reading finds anyway stands in the `reading_` files.
"""

from typing import get_args

from manipcli.core.registry import Seam
from manipcli.description.lint.check import Check, Tier
from manipcli.description.lint.checks.collisions import COLLISION_CHECKS
from manipcli.description.lint.checks.control import CONTROL_CHECKS
from manipcli.description.lint.checks.control_numbers import CONTROL_NUMBER_CHECKS
from manipcli.description.lint.checks.elements import ELEMENT_CHECKS
from manipcli.description.lint.checks.joints import JOINT_CHECKS
from manipcli.description.lint.checks.masses import MASS_CHECKS
from manipcli.description.lint.checks.materials import MATERIAL_CHECKS
from manipcli.description.lint.checks.meshes import MESH_CHECKS
from manipcli.description.lint.checks.names import NAME_CHECKS
from manipcli.description.lint.checks.reading_meshes import READING_MESHES
from manipcli.description.lint.checks.reading_text import READING_TEXT
from manipcli.description.lint.checks.reading_tree import READING_TREE
from manipcli.description.lint.checks.too_many_joints import TOO_MANY_JOINTS
from manipcli.description.lint.checks.transmissions import TRANSMISSION_CHECKS

_MEMBERS: tuple[Check, ...] = (
    *READING_TEXT,
    *READING_TREE,
    *READING_MESHES,
    *ELEMENT_CHECKS,
    *NAME_CHECKS,
    *MATERIAL_CHECKS,
    *MASS_CHECKS,
    *JOINT_CHECKS,
    *MESH_CHECKS,
    *COLLISION_CHECKS,
    *TRANSMISSION_CHECKS,
    *CONTROL_CHECKS,
    *CONTROL_NUMBER_CHECKS,
    TOO_MANY_JOINTS,
)
_TIERS: tuple[Tier, ...] = get_args(Tier)

CHECKS: Seam[Check] = Seam(
    kind="check", members=tuple(sorted(_MEMBERS, key=lambda check: (_TIERS.index(check.tier), check.code)))
)
