"""Checks whose findings come from reading the text of a description: XML, elements, numbers and macros."""

from functools import partial

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import bare_joint, robot

schema_check = partial(reading_check, "schema")

READING_TEXT: tuple[Check, ...] = (
    schema_check(
        "URDF001",
        "not-xml",
        "The file is not valid XML",
        "Parsers that continue after the error lose the rest of the file.",
        robot('<link name="base">'),
    ),
    schema_check(
        "URDF002",
        "not-a-robot",
        "The root element is not <robot>",
        "Other formats (SDF, MJCF) look similar, but their elements and numbers have different meanings.",
        '<sdf version="1.7"><model name="r"><link name="base"/></model></sdf>',
    ),
    schema_check(
        "URDF003",
        "missing-name",
        "A name or reference is missing, empty or not printable",
        "Links, joints and meshes are looked up by name; PyBullet gives all unnamed links the same name and connects "
        "the wrong links.",
        robot('<link name="base"/><link/>'),
    ),
    schema_check(
        "URDF004",
        "bad-number",
        "A value is not a finite number, or is implausibly large",
        "PyBullet silently reads text, a decimal comma and a missing value as 0; nan, inf or a value beyond single "
        "precision makes every state nan from the first step.",
        robot(
            '<link name="base"><inertial><mass value="heavy"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        ),
    ),
    schema_check(
        "URDF008",
        "joint-type",
        "The type of a joint is missing or unknown",
        "The motion of such a joint is undefined; PyBullet terminates the program if the type is missing.",
        bare_joint(kind="spherical"),
    ),
    schema_check(
        "URDF012",
        "shape",
        "A geometry has no shape, an unknown shape, or a size of 0 or less",
        "PyBullet silently accepts a size of 0 or less and gives the link no inertia; a link without a shape does not "
        "collide.",
        robot('<link name="base"><collision><geometry/></collision></link>'),
    ),
    schema_check(
        "URDF051",
        "doctype",
        "The file has a DOCTYPE",
        "Its entities can expand a small file to gigabytes or read other files. A description needs no DOCTYPE, and "
        "parsers disagree on it: PyBullet silently ignores entities.",
        '<!DOCTYPE robot [<!ENTITY size "0.1">]><robot name="r"><link name="base"/></robot>',
    ),
    schema_check(
        "URDF052",
        "too-large",
        "The size, depth or number of elements of the file exceeds a bound",
        "Descriptions may come from untrusted sources; the bounds stop a file that would exhaust the memory or the "
        "stack of a parser.",
        f'<robot name="r">{"<link>" * 120}{"</link>" * 120}</robot>',
    ),
    schema_check(
        "URDF058",
        "number-count",
        "A value has too few or too many numbers",
        "PyBullet silently reads a vector of two or four numbers as 0 0 0: the link is then at the origin of its "
        "parent.",
        bare_joint('<origin xyz="0 0.1"/>'),
    ),
    schema_check(
        "URDF059",
        "missing-attribute",
        "A required number is missing",
        "Programs treat a missing value differently: as 0, as 1, or as an error.",
        robot('<link name="base"><collision><geometry><sphere/></geometry></collision></link>'),
    ),
    schema_check(
        "URDF060",
        "joint-ends",
        "A joint has no parent or no child",
        "A joint connects two links; without both, the description is not a tree.",
        robot('<link name="base"/><joint name="j" type="fixed"><parent link="base"/></joint>'),
    ),
    schema_check(
        "URDF061",
        "several-shapes",
        "A geometry has more than one shape",
        "Programs read the first shape and drop the others.",
        robot('<link name="base"><visual><geometry><box size="1 1 1"/><sphere radius="1"/></geometry></visual></link>'),
        severity="warning",
    ),
    schema_check(
        "URDF062",
        "foreign-shape",
        "A shape is not part of URDF",
        "Programs support different extensions and drop the rest. Write a capsule as two spheres and a cylinder.",
        robot(
            '<link name="base"><collision><geometry><capsule radius="0.1" length="1"/></geometry></collision></link>'
        ),
        severity="warning",
    ),
    schema_check(
        "URDF065",
        "unsupported-joint",
        "A joint with several degrees of freedom is treated as fixed",
        "Floating and planar joints mean that something else moves the link. PyBullet silently makes a floating joint "
        "fixed, and gives a planar joint no axis; manipcli treats both as fixed and reports it.",
        bare_joint(kind="floating"),
        severity="warning",
    ),
    schema_check(
        "XACRO001",
        "xacro-expansion",
        "A xacro file cannot be expanded",
        "The cause is an undefined property or macro, a missing or unknown parameter, an unused block, or a bad "
        "condition. The place is that of the innermost element; the hint names the macros around it.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${nmae}"/></robot>',
    ),
    schema_check(
        "XACRO002",
        "xacro-refused",
        "An expression or substitution is not allowed in a description",
        "The usual evaluation of xacro can run Python code and read any file. In manipcli expressions can only compute "
        "numbers and text.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${load_yaml.__globals__}"/></robot>',
    ),
    schema_check(
        "XACRO003",
        "xacro-argument",
        "An argument is unknown, or has neither a value nor a default",
        "A misspelt argument would silently keep the default.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg prefix)base"/></robot>',
    ),
    schema_check(
        "XACRO004",
        "xacro-bound",
        "An expansion exceeds a bound",
        "A macro that calls itself or doubles its output many times exhausts the memory; a file that includes itself "
        "overflows the interpreter's stack.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="again"><xacro:again/>'
        "</xacro:macro><xacro:again/></robot>",
    ),
    schema_check(
        "XACRO010",
        "xacro-warning",
        "The description or its expansion reports a warning",
        "Authors of macros warn about deprecated files and inconsistent values.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base${xacro.warning(0)}"/></robot>',
        severity="warning",
    ),
    schema_check(
        "XACRO011",
        "xacro-default-of-environment",
        "A variable of the environment is not read; its default is used",
        "A description that depends on the environment is another robot on another machine.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(optenv SIDE left)"/></robot>',
        severity="note",
    ),
)
