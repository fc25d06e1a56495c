"""What is found while the text of a description is read: its XML, elements, numbers and macros."""

from manipcli.description.lint.check import Check, reading_check

READING_TEXT: tuple[Check, ...] = (
    reading_check(
        "URDF001",
        name="not-xml",
        tier="schema",
        summary="The file cannot be read as XML",
        reason="Nothing of such a file can be trusted: parsers that go on anyway lose what follows the mistake.",
        bad='<robot name="r"><link name="base"></robot>',
    ),
    reading_check(
        "URDF002",
        name="not-a-robot",
        tier="schema",
        summary="The root element is not <robot>",
        reason=(
            "Other formats (SDF, MJCF) look alike but say different things: none of their numbers may be read as those "
            "of a URDF."
        ),
        bad='<sdf version="1.7"><model name="r"><link name="base"/></model></sdf>',
    ),
    reading_check(
        "URDF003",
        name="missing-name",
        tier="schema",
        summary="A name or reference is missing, empty or not printable",
        reason=(
            "Links, joints and meshes are found by name; PyBullet calls every link without a name the same and joins "
            "the wrong ones."
        ),
        bad='<robot name="r"><link name="base"/><link/></robot>',
    ),
    reading_check(
        "URDF004",
        name="bad-number",
        tier="schema",
        summary="A value is not a finite number, or larger than anything real",
        reason=(
            "PyBullet reads text, a decimal comma and a missing value as 0 without a word, and nan, inf or what is too "
            "large for single precision makes every state nan from the first step."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"><inertial><mass value="heavy"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF008",
        name="joint-type",
        tier="schema",
        summary="The type of a joint is missing or unknown",
        reason="Nobody can say how such a joint moves; PyBullet ends the whole program where the type is missing.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="spherical"><parent link="base"/><child link="tip"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF012",
        name="shape",
        tier="schema",
        summary="A geometry has no shape, an unknown one, or one without extent",
        reason=(
            "PyBullet takes a size of 0 or less without a word and gives the link no inertia; without a shape nothing "
            "collides."
        ),
        bad='<robot name="r"><link name="base"><collision><geometry/></collision></link></robot>',
    ),
    reading_check(
        "URDF051",
        name="doctype",
        tier="schema",
        summary="The file has a DOCTYPE",
        reason=(
            "Entities declared there can blow a small file up to gigabytes or read other files. A description needs "
            "none, and parsers disagree on them: PyBullet ignores them without a word."
        ),
        bad='<!DOCTYPE robot [<!ENTITY size "0.1">]><robot name="r"><link name="base"/></robot>',
    ),
    reading_check(
        "URDF052",
        name="too-large",
        tier="schema",
        summary="The file, its depth or its number of elements is beyond a bound",
        reason=(
            "Descriptions come from anywhere; one that was made to exhaust memory or the stack of a parser is stopped "
            "early."
        ),
        bad=f'<robot name="r">{"<link>" * 120}{"</link>" * 120}</robot>',
    ),
    reading_check(
        "URDF058",
        name="number-count",
        tier="schema",
        summary="A value has too few or too many numbers",
        reason=(
            "PyBullet takes a vector of two or four numbers for 0 0 0 without a word: a link then sits where its "
            "parent is."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/>'
            '<origin xyz="0 0.1"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF059",
        name="missing-attribute",
        tier="schema",
        summary="A number that must be stated is missing",
        reason="Each program has an idea of its own of what a missing value means: 0, 1, or to refuse the file.",
        bad='<robot name="r"><link name="base"><collision><geometry><sphere/></geometry></collision></link></robot>',
    ),
    reading_check(
        "URDF060",
        name="joint-ends",
        tier="schema",
        summary="A joint has no parent or no child",
        reason="A joint joins two links; without both, the description is no tree.",
        bad='<robot name="r"><link name="base"/><joint name="j" type="fixed"><parent link="base"/></joint></robot>',
    ),
    reading_check(
        "URDF061",
        name="several-shapes",
        tier="schema",
        severity="warning",
        summary="A geometry has more than one shape",
        reason="Programs read the first and lose the others: what is drawn or collides is less than what was written.",
        bad=(
            '<robot name="r">'
            '<link name="base"><visual><geometry>'
            '<box size="1 1 1"/><sphere radius="1"/></geometry></visual></link>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF062",
        name="foreign-shape",
        tier="schema",
        severity="warning",
        summary="A shape is not one of URDF",
        reason=(
            "Each program knows other extensions and drops the rest: a capsule is two spheres and a cylinder; use "
            "those."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"><collision><geometry>'
            '<capsule radius="0.1" length="1"/></geometry></collision></link>'
            "</robot>"
        ),
    ),
    reading_check(
        "URDF065",
        name="unsupported-joint",
        tier="schema",
        severity="warning",
        summary="A joint of several degrees of freedom is held fixed",
        reason=(
            "Floating and planar joints say that something else moves the link. PyBullet makes a floating joint a "
            "fixed one without a word, and gives a planar one no axis; so does manipcli hold it, but says it."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="floating"><parent link="base"/><child link="tip"/></joint>'
            "</robot>"
        ),
    ),
    reading_check(
        "XACRO001",
        name="xacro-expansion",
        tier="schema",
        summary="A xacro file cannot be expanded",
        reason=(
            "An undefined property or macro, a missing or unknown parameter, a block nobody uses, a bad condition: the "
            "place is that of the innermost element, the hint names the macros around it."
        ),
        bad='<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${nmae}"/></robot>',
    ),
    reading_check(
        "XACRO002",
        name="xacro-refused",
        tier="schema",
        summary="An expression or substitution asks for what a description may not do",
        reason=(
            "The usual evaluation of xacro runs any Python and reads any file. Here a description is data: expressions "
            "compute numbers and text, and only what they need for that is there."
        ),
        bad=(
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
            '<link name="${load_yaml.__globals__}"/></robot>'
        ),
    ),
    reading_check(
        "XACRO003",
        name="xacro-argument",
        tier="schema",
        summary="An argument is unknown, or has neither a value nor a default",
        reason="A misspelt argument would leave the default in place without a word.",
        bad='<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg prefix)base"/></robot>',
    ),
    reading_check(
        "XACRO004",
        name="xacro-bound",
        tier="schema",
        summary="An expansion is beyond a bound",
        reason=(
            "A macro that calls itself, or doubles ten times over, fills the memory; a file that includes itself ends "
            "the interpreter's stack."
        ),
        bad=(
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
            '<xacro:macro name="again"><xacro:again/></xacro:macro>'
            "<xacro:again/>"
            "</robot>"
        ),
    ),
    reading_check(
        "XACRO010",
        name="xacro-warning",
        tier="schema",
        severity="warning",
        summary="The description or its expansion gives a warning",
        reason="Authors of macros warn of deprecated files and of values that do not fit together.",
        bad=(
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base${xacro.warning(0)}"/></robot>'
        ),
    ),
)
