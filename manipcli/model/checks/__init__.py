"""What can be wrong with a description, in the order of tiers and codes.

A check that looks for itself has a file of its own; what reading finds anyway stands in the `reading_` files.
"""

from typing import get_args

from manipcli.core.registry import Seam
from manipcli.model.check import Check, Tier
from manipcli.model.checks.absolute_mesh import CHECK as ABSOLUTE_MESH
from manipcli.model.checks.ascii_stl import CHECK as ASCII_STL
from manipcli.model.checks.centre_of_mass import CHECK as CENTRE_OF_MASS
from manipcli.model.checks.collada_up_axis import CHECK as COLLADA_UP_AXIS
from manipcli.model.checks.colour_range import CHECK as COLOUR_RANGE
from manipcli.model.checks.continuous_limits import CHECK as CONTINUOUS_LIMITS
from manipcli.model.checks.control_element import CHECK as CONTROL_ELEMENT
from manipcli.model.checks.control_interface import CHECK as CONTROL_INTERFACE
from manipcli.model.checks.control_joint import CHECK as CONTROL_JOINT
from manipcli.model.checks.control_mimic import CHECK as CONTROL_MIMIC
from manipcli.model.checks.control_number import CHECK as CONTROL_NUMBER
from manipcli.model.checks.control_plugin import CHECK as CONTROL_PLUGIN
from manipcli.model.checks.default_axis import CHECK as DEFAULT_AXIS
from manipcli.model.checks.fixed_axis import CHECK as FIXED_AXIS
from manipcli.model.checks.foreign_tags import CHECK as FOREIGN_TAGS
from manipcli.model.checks.gazebo_tags import CHECK as GAZEBO_TAGS
from manipcli.model.checks.hardware_interface import CHECK as HARDWARE_INTERFACE
from manipcli.model.checks.heavy_link import CHECK as HEAVY_LINK
from manipcli.model.checks.inertia_size import CHECK as INERTIA_SIZE
from manipcli.model.checks.inertia_without_mass import CHECK as INERTIA_WITHOUT_MASS
from manipcli.model.checks.limits_in_degrees import CHECK as LIMITS_IN_DEGREES
from manipcli.model.checks.massless_joint import CHECK as MASSLESS_JOINT
from manipcli.model.checks.mesh_suffix import CHECK as MESH_SUFFIX
from manipcli.model.checks.mesh_triangles import CHECK as MESH_TRIANGLES
from manipcli.model.checks.mesh_unit import CHECK as MESH_UNIT
from manipcli.model.checks.mimic_limits import CHECK as MIMIC_LIMITS
from manipcli.model.checks.mirrored_mesh import CHECK as MIRRORED_MESH
from manipcli.model.checks.misplaced_element import CHECK as MISPLACED_ELEMENT
from manipcli.model.checks.missing_visual import CHECK as MISSING_VISUAL
from manipcli.model.checks.no_collision import CHECK as NO_COLLISION
from manipcli.model.checks.no_inertial import CHECK as NO_INERTIAL
from manipcli.model.checks.reading_meshes import READING_MESHES
from manipcli.model.checks.reading_text import READING_TEXT
from manipcli.model.checks.reading_tree import READING_TREE
from manipcli.model.checks.redefined_material import CHECK as REDEFINED_MATERIAL
from manipcli.model.checks.repeated_element import CHECK as REPEATED_ELEMENT
from manipcli.model.checks.robot_name import CHECK as ROBOT_NAME
from manipcli.model.checks.root_inertia import CHECK as ROOT_INERTIA
from manipcli.model.checks.ros_names import CHECK as ROS_NAMES
from manipcli.model.checks.safety_limits import CHECK as SAFETY_LIMITS
from manipcli.model.checks.self_collision import CHECK as SELF_COLLISION
from manipcli.model.checks.shared_name import CHECK as SHARED_NAME
from manipcli.model.checks.stray_text import CHECK as STRAY_TEXT
from manipcli.model.checks.too_many_joints import CHECK as TOO_MANY_JOINTS
from manipcli.model.checks.transmission_count import CHECK as TRANSMISSION_COUNT
from manipcli.model.checks.transmission_joint import CHECK as TRANSMISSION_JOINT
from manipcli.model.checks.transmission_name import CHECK as TRANSMISSION_NAME
from manipcli.model.checks.transmission_reduction import CHECK as TRANSMISSION_REDUCTION
from manipcli.model.checks.transmission_roles import CHECK as TRANSMISSION_ROLES
from manipcli.model.checks.transmission_shared import CHECK as TRANSMISSION_SHARED
from manipcli.model.checks.transmission_type import CHECK as TRANSMISSION_TYPE
from manipcli.model.checks.transmission_unread import CHECK as TRANSMISSION_UNREAD
from manipcli.model.checks.undefined_material import CHECK as UNDEFINED_MATERIAL
from manipcli.model.checks.unknown_attribute import CHECK as UNKNOWN_ATTRIBUTE
from manipcli.model.checks.unknown_element import CHECK as UNKNOWN_ELEMENT
from manipcli.model.checks.unread_number import CHECK as UNREAD_NUMBER
from manipcli.model.checks.unusable_visual import CHECK as UNUSABLE_VISUAL
from manipcli.model.checks.zero_outside import CHECK as ZERO_OUTSIDE

_MEMBERS: tuple[Check, ...] = (
    *READING_TEXT,
    *READING_TREE,
    *READING_MESHES,
    ROBOT_NAME,
    UNKNOWN_ELEMENT,
    MISPLACED_ELEMENT,
    UNKNOWN_ATTRIBUTE,
    REPEATED_ELEMENT,
    STRAY_TEXT,
    UNDEFINED_MATERIAL,
    COLOUR_RANGE,
    REDEFINED_MATERIAL,
    UNREAD_NUMBER,
    SHARED_NAME,
    FOREIGN_TAGS,
    MASSLESS_JOINT,
    INERTIA_SIZE,
    CENTRE_OF_MASS,
    FIXED_AXIS,
    DEFAULT_AXIS,
    CONTINUOUS_LIMITS,
    SAFETY_LIMITS,
    INERTIA_WITHOUT_MASS,
    LIMITS_IN_DEGREES,
    ROOT_INERTIA,
    NO_INERTIAL,
    HEAVY_LINK,
    MISSING_VISUAL,
    MESH_SUFFIX,
    ABSOLUTE_MESH,
    MESH_UNIT,
    MESH_TRIANGLES,
    ASCII_STL,
    MIRRORED_MESH,
    COLLADA_UP_AXIS,
    UNUSABLE_VISUAL,
    NO_COLLISION,
    TRANSMISSION_TYPE,
    TRANSMISSION_SHARED,
    TRANSMISSION_ROLES,
    TRANSMISSION_COUNT,
    HARDWARE_INTERFACE,
    TRANSMISSION_JOINT,
    TRANSMISSION_REDUCTION,
    TRANSMISSION_NAME,
    TRANSMISSION_UNREAD,
    CONTROL_JOINT,
    CONTROL_MIMIC,
    CONTROL_PLUGIN,
    CONTROL_INTERFACE,
    CONTROL_NUMBER,
    CONTROL_ELEMENT,
    GAZEBO_TAGS,
    ROS_NAMES,
    TOO_MANY_JOINTS,
    SELF_COLLISION,
    ZERO_OUTSIDE,
    MIMIC_LIMITS,
)
_TIERS: tuple[Tier, ...] = get_args(Tier)

CHECKS: Seam[Check] = Seam(
    kind="check", members=tuple(sorted(_MEMBERS, key=lambda check: (_TIERS.index(check.tier), check.code)))
)
