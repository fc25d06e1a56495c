"""What can be wrong with a description, in the order of tiers and codes.

A file a subject; what reading finds anyway stands in the `reading_` files.
"""

from typing import get_args

from manipcli.core.registry import Seam
from manipcli.model.check import Check, Tier
from manipcli.model.checks.collisions import COLLISION_CHECKS
from manipcli.model.checks.control import CONTROL_CHECKS
from manipcli.model.checks.control_numbers import CONTROL_NUMBER_CHECKS
from manipcli.model.checks.elements import ELEMENT_CHECKS
from manipcli.model.checks.joints import JOINT_CHECKS
from manipcli.model.checks.masses import MASS_CHECKS
from manipcli.model.checks.materials import MATERIAL_CHECKS
from manipcli.model.checks.meshes import MESH_CHECKS
from manipcli.model.checks.names import NAME_CHECKS
from manipcli.model.checks.reading_meshes import READING_MESHES
from manipcli.model.checks.reading_text import READING_TEXT
from manipcli.model.checks.reading_tree import READING_TREE
from manipcli.model.checks.too_many_joints import TOO_MANY_JOINTS
from manipcli.model.checks.transmissions import TRANSMISSION_CHECKS

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
