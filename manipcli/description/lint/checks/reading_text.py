"""What is found while the text of a description is read: its XML, elements, numbers and macros."""

from functools import partial

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import bare_joint, robot

schema_check = partial(reading_check, "schema")

READING_TEXT: tuple[Check, ...] = (
    schema_check(
        "URDF001",
        "not-xml",
        "The file cannot be read as XML",
        "Nothing of such a file can be trusted: parsers that go on anyway lose what follows the mistake.",
        robot('<link name="base">'),
    ),
    schema_check(
        "URDF002",
        "not-a-robot",
        "The root element is not <robot>",
        "Other formats (SDF, MJCF) look alike but say different things: none of their numbers may be read as those "
        "of a URDF.",
        '<sdf version="1.7"><model name="r"><link name="base"/></model></sdf>',
    ),
    schema_check(
        "URDF003",
        "missing-name",
        "A name or reference is missing, empty or not printable",
        "Links, joints and meshes are found by name; PyBullet calls every link without a name the same and joins "
        "the wrong ones.",
        robot('<link name="base"/><link/>'),
    ),
    schema_check(
        "URDF004",
        "bad-number",
        "A value is not a finite number, or larger than anything real",
        "PyBullet reads text, a decimal comma and a missing value as 0 without a word, and nan, inf or what is too "
        "large for single precision makes every state nan from the first step.",
        robot(
            '<link name="base"><inertial><mass value="heavy"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        ),
    ),
    schema_check(
        "URDF008",
        "joint-type",
        "The type of a joint is missing or unknown",
        "Nobody can say how such a joint moves; PyBullet ends the whole program where the type is missing.",
        bare_joint(kind="spherical"),
    ),
    schema_check(
        "URDF012",
        "shape",
        "A geometry has no shape, an unknown one, or one without extent",
        "PyBullet takes a size of 0 or less without a word and gives the link no inertia; without a shape nothing "
        "collides.",
        robot('<link name="base"><collision><geometry/></collision></link>'),
    ),
    schema_check(
        "URDF051",
        "doctype",
        "The file has a DOCTYPE",
        "Entities declared there can blow a small file up to gigabytes or read other files. A description needs "
        "none, and parsers disagree on them: PyBullet ignores them without a word.",
        '<!DOCTYPE robot [<!ENTITY size "0.1">]><robot name="r"><link name="base"/></robot>',
    ),
    schema_check(
        "URDF052",
        "too-large",
        "The file, its depth or its number of elements is beyond a bound",
        "Descriptions come from anywhere; one that was made to exhaust memory or the stack of a parser is stopped "
        "early.",
        f'<robot name="r">{"<link>" * 120}{"</link>" * 120}</robot>',
    ),
    schema_check(
        "URDF058",
        "number-count",
        "A value has too few or too many numbers",
        "PyBullet takes a vector of two or four numbers for 0 0 0 without a word: a link then sits where its parent"
        " is.",
        bare_joint('<origin xyz="0 0.1"/>'),
    ),
    schema_check(
        "URDF059",
        "missing-attribute",
        "A number that must be stated is missing",
        "Each program has an idea of its own of what a missing value means: 0, 1, or to refuse the file.",
        robot('<link name="base"><collision><geometry><sphere/></geometry></collision></link>'),
    ),
    schema_check(
        "URDF060",
        "joint-ends",
        "A joint has no parent or no child",
        "A joint joins two links; without both, the description is no tree.",
        robot('<link name="base"/><joint name="j" type="fixed"><parent link="base"/></joint>'),
    ),
    schema_check(
        "URDF061",
        "several-shapes",
        "A geometry has more than one shape",
        "Programs read the first and lose the others: what is drawn or collides is less than what was written.",
        robot('<link name="base"><visual><geometry><box size="1 1 1"/><sphere radius="1"/></geometry></visual></link>'),
        severity="warning",
    ),
    schema_check(
        "URDF062",
        "foreign-shape",
        "A shape is not one of URDF",
        "Each program knows other extensions and drops the rest: a capsule is two spheres and a cylinder; use those.",
        robot(
            '<link name="base"><collision><geometry><capsule radius="0.1" length="1"/></geometry></collision></link>'
        ),
        severity="warning",
    ),
    schema_check(
        "URDF065",
        "unsupported-joint",
        "A joint of several degrees of freedom is held fixed",
        "Floating and planar joints say that something else moves the link. PyBullet makes a floating joint a fixed"
        " one without a word, and gives a planar one no axis; so does manipcli hold it, but says it.",
        bare_joint(kind="floating"),
        severity="warning",
    ),
    schema_check(
        "XACRO001",
        "xacro-expansion",
        "A xacro file cannot be expanded",
        "An undefined property or macro, a missing or unknown parameter, a block nobody uses, a bad condition: the "
        "place is that of the innermost element, the hint names the macros around it.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${nmae}"/></robot>',
    ),
    schema_check(
        "XACRO002",
        "xacro-refused",
        "An expression or substitution asks for what a description may not do",
        "The usual evaluation of xacro runs any Python and reads any file. Here a description is data: expressions "
        "compute numbers and text, and only what they need for that is there.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${load_yaml.__globals__}"/></robot>',
    ),
    schema_check(
        "XACRO003",
        "xacro-argument",
        "An argument is unknown, or has neither a value nor a default",
        "A misspelt argument would leave the default in place without a word.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg prefix)base"/></robot>',
    ),
    schema_check(
        "XACRO004",
        "xacro-bound",
        "An expansion is beyond a bound",
        "A macro that calls itself, or doubles ten times over, fills the memory; a file that includes itself ends "
        "the interpreter's stack.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="again"><xacro:again/>'
        "</xacro:macro><xacro:again/></robot>",
    ),
    schema_check(
        "XACRO010",
        "xacro-warning",
        "The description or its expansion gives a warning",
        "Authors of macros warn of deprecated files and of values that do not fit together.",
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base${xacro.warning(0)}"/></robot>',
        severity="warning",
    ),
)
