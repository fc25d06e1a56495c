"""What can be wrong with a description: one file a check, in the order of tiers and codes."""

from manipcli.core.registry import Seam
from manipcli.model.check import Check
from manipcli.model.checks.absolute_mesh import CHECK as ABSOLUTE_MESH
from manipcli.model.checks.ascii_stl import CHECK as ASCII_STL
from manipcli.model.checks.axis import CHECK as AXIS
from manipcli.model.checks.axis_length import CHECK as AXIS_LENGTH
from manipcli.model.checks.bad_number import CHECK as BAD_NUMBER
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
from manipcli.model.checks.doctype import CHECK as DOCTYPE
from manipcli.model.checks.duplicate_name import CHECK as DUPLICATE_NAME
from manipcli.model.checks.fixed_axis import CHECK as FIXED_AXIS
from manipcli.model.checks.flat_mesh import CHECK as FLAT_MESH
from manipcli.model.checks.foreign_shape import CHECK as FOREIGN_SHAPE
from manipcli.model.checks.foreign_tags import CHECK as FOREIGN_TAGS
from manipcli.model.checks.gazebo_tags import CHECK as GAZEBO_TAGS
from manipcli.model.checks.hardware_interface import CHECK as HARDWARE_INTERFACE
from manipcli.model.checks.heavy_link import CHECK as HEAVY_LINK
from manipcli.model.checks.inertia import CHECK as INERTIA
from manipcli.model.checks.inertia_size import CHECK as INERTIA_SIZE
from manipcli.model.checks.inertia_without_mass import CHECK as INERTIA_WITHOUT_MASS
from manipcli.model.checks.joint_ends import CHECK as JOINT_ENDS
from manipcli.model.checks.joint_type import CHECK as JOINT_TYPE
from manipcli.model.checks.limits import CHECK as LIMITS
from manipcli.model.checks.limits_in_degrees import CHECK as LIMITS_IN_DEGREES
from manipcli.model.checks.locked_joint import CHECK as LOCKED_JOINT
from manipcli.model.checks.loop import CHECK as LOOP
from manipcli.model.checks.massless_joint import CHECK as MASSLESS_JOINT
from manipcli.model.checks.mesh_suffix import CHECK as MESH_SUFFIX
from manipcli.model.checks.mesh_triangles import CHECK as MESH_TRIANGLES
from manipcli.model.checks.mesh_unit import CHECK as MESH_UNIT
from manipcli.model.checks.mimic_circle import CHECK as MIMIC_CIRCLE
from manipcli.model.checks.mimic_limits import CHECK as MIMIC_LIMITS
from manipcli.model.checks.mimic_target import CHECK as MIMIC_TARGET
from manipcli.model.checks.mirrored_mesh import CHECK as MIRRORED_MESH
from manipcli.model.checks.misplaced_element import CHECK as MISPLACED_ELEMENT
from manipcli.model.checks.missing_attribute import CHECK as MISSING_ATTRIBUTE
from manipcli.model.checks.missing_mesh import CHECK as MISSING_MESH
from manipcli.model.checks.missing_name import CHECK as MISSING_NAME
from manipcli.model.checks.missing_visual import CHECK as MISSING_VISUAL
from manipcli.model.checks.no_collision import CHECK as NO_COLLISION
from manipcli.model.checks.no_inertial import CHECK as NO_INERTIAL
from manipcli.model.checks.no_link import CHECK as NO_LINK
from manipcli.model.checks.not_a_robot import CHECK as NOT_A_ROBOT
from manipcli.model.checks.not_xml import CHECK as NOT_XML
from manipcli.model.checks.number_count import CHECK as NUMBER_COUNT
from manipcli.model.checks.outside_mesh import CHECK as OUTSIDE_MESH
from manipcli.model.checks.point_mass import CHECK as POINT_MASS
from manipcli.model.checks.redefined_material import CHECK as REDEFINED_MATERIAL
from manipcli.model.checks.remote_mesh import CHECK as REMOTE_MESH
from manipcli.model.checks.repeated_element import CHECK as REPEATED_ELEMENT
from manipcli.model.checks.robot_name import CHECK as ROBOT_NAME
from manipcli.model.checks.root_inertia import CHECK as ROOT_INERTIA
from manipcli.model.checks.ros_names import CHECK as ROS_NAMES
from manipcli.model.checks.safety_limits import CHECK as SAFETY_LIMITS
from manipcli.model.checks.self_collision import CHECK as SELF_COLLISION
from manipcli.model.checks.self_joint import CHECK as SELF_JOINT
from manipcli.model.checks.several_roots import CHECK as SEVERAL_ROOTS
from manipcli.model.checks.several_shapes import CHECK as SEVERAL_SHAPES
from manipcli.model.checks.shape import CHECK as SHAPE
from manipcli.model.checks.shared_name import CHECK as SHARED_NAME
from manipcli.model.checks.stray_text import CHECK as STRAY_TEXT
from manipcli.model.checks.too_large import CHECK as TOO_LARGE
from manipcli.model.checks.too_many_joints import CHECK as TOO_MANY_JOINTS
from manipcli.model.checks.transmission import CHECK as TRANSMISSION
from manipcli.model.checks.transmission_count import CHECK as TRANSMISSION_COUNT
from manipcli.model.checks.transmission_joint import CHECK as TRANSMISSION_JOINT
from manipcli.model.checks.transmission_name import CHECK as TRANSMISSION_NAME
from manipcli.model.checks.transmission_reduction import CHECK as TRANSMISSION_REDUCTION
from manipcli.model.checks.transmission_roles import CHECK as TRANSMISSION_ROLES
from manipcli.model.checks.transmission_shared import CHECK as TRANSMISSION_SHARED
from manipcli.model.checks.transmission_type import CHECK as TRANSMISSION_TYPE
from manipcli.model.checks.transmission_unread import CHECK as TRANSMISSION_UNREAD
from manipcli.model.checks.two_parents import CHECK as TWO_PARENTS
from manipcli.model.checks.undefined_link import CHECK as UNDEFINED_LINK
from manipcli.model.checks.undefined_material import CHECK as UNDEFINED_MATERIAL
from manipcli.model.checks.unknown_attribute import CHECK as UNKNOWN_ATTRIBUTE
from manipcli.model.checks.unknown_element import CHECK as UNKNOWN_ELEMENT
from manipcli.model.checks.unread_number import CHECK as UNREAD_NUMBER
from manipcli.model.checks.unstated_limit import CHECK as UNSTATED_LIMIT
from manipcli.model.checks.unsupported_joint import CHECK as UNSUPPORTED_JOINT
from manipcli.model.checks.unusable_mesh import CHECK as UNUSABLE_MESH
from manipcli.model.checks.unusable_visual import CHECK as UNUSABLE_VISUAL
from manipcli.model.checks.xacro_argument import CHECK as XACRO_ARGUMENT
from manipcli.model.checks.xacro_bound import CHECK as XACRO_BOUND
from manipcli.model.checks.xacro_expansion import CHECK as XACRO_EXPANSION
from manipcli.model.checks.xacro_refused import CHECK as XACRO_REFUSED
from manipcli.model.checks.xacro_warning import CHECK as XACRO_WARNING
from manipcli.model.checks.zero_mass import CHECK as ZERO_MASS
from manipcli.model.checks.zero_outside import CHECK as ZERO_OUTSIDE

_SCHEMA: tuple[Check, ...] = (
    NOT_XML,
    NOT_A_ROBOT,
    MISSING_NAME,
    BAD_NUMBER,
    JOINT_TYPE,
    SHAPE,
    ROBOT_NAME,
    DOCTYPE,
    TOO_LARGE,
    UNKNOWN_ELEMENT,
    MISPLACED_ELEMENT,
    UNKNOWN_ATTRIBUTE,
    REPEATED_ELEMENT,
    STRAY_TEXT,
    NUMBER_COUNT,
    MISSING_ATTRIBUTE,
    JOINT_ENDS,
    SEVERAL_SHAPES,
    FOREIGN_SHAPE,
    UNDEFINED_MATERIAL,
    COLOUR_RANGE,
    UNSUPPORTED_JOINT,
    REDEFINED_MATERIAL,
    UNREAD_NUMBER,
    SHARED_NAME,
    FOREIGN_TAGS,
    XACRO_EXPANSION,
    XACRO_REFUSED,
    XACRO_ARGUMENT,
    XACRO_BOUND,
    XACRO_WARNING,
)
_TOPOLOGY: tuple[Check, ...] = (
    DUPLICATE_NAME,
    UNDEFINED_LINK,
    SEVERAL_ROOTS,
    MIMIC_TARGET,
    NO_LINK,
    LOOP,
    TWO_PARENTS,
    SELF_JOINT,
    MIMIC_CIRCLE,
)
_PHYSICS: tuple[Check, ...] = (
    AXIS,
    LIMITS,
    INERTIA,
    ZERO_MASS,
    AXIS_LENGTH,
    LOCKED_JOINT,
    UNSTATED_LIMIT,
    POINT_MASS,
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
)
_ASSETS: tuple[Check, ...] = (
    MISSING_MESH,
    MISSING_VISUAL,
    UNUSABLE_MESH,
    REMOTE_MESH,
    OUTSIDE_MESH,
    MESH_SUFFIX,
    ABSOLUTE_MESH,
    MESH_UNIT,
    MESH_TRIANGLES,
    ASCII_STL,
    MIRRORED_MESH,
    FLAT_MESH,
    COLLADA_UP_AXIS,
    UNUSABLE_VISUAL,
)
_READINESS: tuple[Check, ...] = (
    TRANSMISSION,
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

CHECKS: Seam[Check] = Seam(kind="check", members=(*_SCHEMA, *_TOPOLOGY, *_PHYSICS, *_ASSETS, *_READINESS))
