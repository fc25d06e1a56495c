"""What is written where nobody reads it, or reads something else: elements, attributes, text, numbers."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.core.text import any_of, did_you_mean, nearest, shorten
from manipcli.description.lint.check import Check, Subject
from manipcli.description.lint.samples import one_joint
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import Reader
from manipcli.description.urdf.schema_table import PARENTS, RULES, is_foreign, known_elements

_COUNTS: Final[dict[str, dict[str, int]]] = {
    "safety_controller": dict.fromkeys(("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), 1),
    "calibration": dict.fromkeys(("rising", "falling", "reference_position"), 1),
    "limit": dict.fromkeys(("lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"), 1),
    "mimic": dict.fromkeys(("multiplier", "offset"), 1),
    "axis": {"xyz": 3},
}
_TOLD_ELSEWHERE: Final = frozenset({"gazebo", "ros2_control"})


def _unknown_element(subject: Subject) -> Iterator[Finding]:
    """Elements that URDF does not have."""
    for element, rule in known_elements(subject.description.root):
        if element.tag == "geometry":
            continue  # what is no shape is told where shapes are read
        for child in element.children:
            if child.tag in RULES or child.tag == "transmission" or is_foreign(child.tag):
                continue
            message = f"unknown element <{shorten(child.tag)}> in <{element.tag}>; it is ignored"
            close = nearest(child.tag, [*sorted(rule.children), *RULES]) if len(child.tag) < 40 else ()
            yield Finding("URDF053", message, child.place, f"did you mean <{close[0]}>?" if close else None, "warning")


def _misplaced_element(subject: Subject) -> Iterator[Finding]:
    """Elements of URDF where they do not belong."""
    for element, rule in known_elements(subject.description.root):
        if element.tag == "geometry":
            continue
        for child in element.children:
            if child.tag not in RULES or child.tag in rule.children:
                continue
            message = f"<{child.tag}> does not belong in <{element.tag}>; it is ignored"
            hint = f"it belongs in {any_of(PARENTS.get(child.tag, ()))}" if child.tag in PARENTS else None
            # Exporters write a colour for the collision shape; nobody misses it.
            harmless = (element.tag, child.tag) == ("collision", "material")
            yield Finding("URDF054", message, child.place, hint, "note" if harmless else "warning")


def _unknown_attribute(subject: Subject) -> Iterator[Finding]:
    """Attributes that an element does not have."""
    for element, rule in known_elements(subject.description.root):
        for name in element.attributes:
            if name in rule.attributes or ":" in name:
                continue
            message = f"<{element.tag}> has no attribute '{shorten(name)}' in URDF; it is ignored"
            hint = did_you_mean(name, sorted(rule.attributes), kind="attributes") if len(name) < 40 else None
            yield Finding("URDF055", message, element.place, hint, "warning")


def _repeated_element(subject: Subject) -> Iterator[Finding]:
    """Elements that are there twice where one is read."""
    for element, rule in known_elements(subject.description.root):
        seen: set[str] = set()
        for child in element.children:
            if child.tag in seen and child.tag in rule.once:
                message = f"<{element.tag}> has more than one <{child.tag}>; the first is used"
                yield Finding("URDF056", message, child.place, "delete one of them", "warning")
            seen.add(child.tag)


def _stray_text(subject: Subject) -> Iterator[Finding]:
    """Text between elements."""
    for element, _ in known_elements(subject.description.root):
        if element.text:
            message = f"text in <{element.tag}>, which is ignored: '{shorten(' '.join(element.text[:200].split()))}'"
            hint = "URDF says everything with attributes; a remark is written <!-- like this -->"
            yield Finding("URDF057", message, element.text_place or element.place, hint, "warning")


def _unread_number(subject: Subject) -> Iterator[Finding]:
    """Bad numbers where only other programs read them."""
    told = {(finding.message, finding.place) for finding in subject.parts.findings}
    for joint in subject.description.root.all("joint"):
        reader = Reader()
        for element in joint.children:
            _read(reader, element)
        for finding in reader.findings:
            if (finding.message, finding.place) not in told:
                message = f"{finding.message} (manipcli does not read it here)"
                yield Finding("URDF067", message, finding.place, severity="warning")


def _read(reader: Reader, element: Element) -> None:
    for attribute, count in _COUNTS.get(element.tag, {}).items():
        reader.numbers(element, attribute, count)


def _foreign_tags(subject: Subject) -> Iterator[Finding]:
    """One finding for each tag: the first of them, and how many there are."""
    found: dict[str, list[Element]] = {}
    for element, _ in known_elements(subject.description.root):
        for child in element.children:
            if is_foreign(child.tag) and child.tag not in _TOLD_ELSEWHERE:
                found.setdefault(child.tag, []).append(child)
    for tag, elements in found.items():
        many = f"{len(elements)} <{shorten(tag)}> elements are" if len(elements) > 1 else f"<{shorten(tag)}> is"
        yield Finding("URDF069", f"{many} for another program, and ignored", elements[0].place, severity="note")


def _gazebo_tags(subject: Subject) -> Iterator[Finding]:
    """One finding for all of them, and one for each that refers to nothing."""
    tags = subject.description.root.all("gazebo")
    if tags:
        many = f"{len(tags)} <gazebo> elements are" if len(tags) > 1 else "a <gazebo> element is"
        yield Finding("URDF330", f"{many} ignored", tags[0].place, "friction: see `friction` of the robot file", "note")
    root = subject.description.root
    known = [each.attributes.get("name", "").strip() for tag in ("link", "joint") for each in root.all(tag)]
    for tag in tags:
        name = tag.attributes.get("reference", "").strip()
        if name and name not in known:
            message = f"<gazebo> refers to '{shorten(name)}', which is no link and no joint"
            near = did_you_mean(name, known) if len(known) < 1000 else None
            yield Finding("URDF330", message, tag.place, near, "note")


ELEMENT_CHECKS: tuple[Check, ...] = (
    Check(
        code="URDF053",
        name="unknown-element",
        tier="schema",
        severity="warning",
        summary="An element is none of URDF",
        reason=(
            "Programs skip what they do not know: a misspelt <colision> is a link that nothing touches. Elements that "
            "are known to speak to another program (gazebo, ros2_control, anything with a prefix) are left alone."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"><colision><geometry><box size="1 1 1"/></geometry></colision></link></robot>'
        ),
        find=_unknown_element,
    ),
    Check(
        code="URDF054",
        name="misplaced-element",
        tier="schema",
        severity="warning",
        summary="An element of URDF stands where it does not belong",
        reason="Programs read it only in its place: an <inertial> below <robot> says nothing to anybody.",
        bad=('<robot name="r"><link name="base"><mass value="1"/></link></robot>'),
        find=_misplaced_element,
    ),
    Check(
        code="URDF055",
        name="unknown-attribute",
        tier="schema",
        severity="warning",
        summary="An attribute is none of its element",
        reason="Programs skip what they do not know: what was meant by it is not there, and a default is.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/><origin xzy="0 0 1"/></joint>'
            "</robot>"
        ),
        find=_unknown_attribute,
    ),
    Check(
        code="URDF056",
        name="repeated-element",
        tier="schema",
        severity="warning",
        summary="An element is there twice where one is read",
        reason="Programs read the first, some the last: the same file then is two robots.",
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/>'
            '<origin xyz="0 0 1"/><origin xyz="0 0 2"/></joint>'
            "</robot>"
        ),
        find=_repeated_element,
    ),
    Check(
        code="URDF057",
        name="stray-text",
        tier="schema",
        severity="warning",
        summary="There is text where URDF has none",
        reason="A value written between tags is read by nobody; a comment without its marks may hide what stood there.",
        bad=(
            '<robot name="r">'
            '<link name="base"><inertial><mass value="1">2</mass>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
            "</robot>"
        ),
        find=_stray_text,
    ),
    Check(
        code="URDF067",
        name="unread-number",
        tier="schema",
        severity="warning",
        summary="A number that only other programs read is none",
        reason=(
            "Safety controllers, calibrations and the axis of a fixed joint mean nothing to a simulation, but other "
            "programs refuse the joint, or the file, for a bad number in them."
        ),
        bad=(
            '<robot name="r">'
            '<link name="base"/><link name="tip"/>'
            '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/><calibration rising="soon"/></joint>'
            "</robot>"
        ),
        find=_unread_number,
    ),
    Check(
        code="URDF069",
        name="foreign-tags",
        tier="schema",
        severity="note",
        summary="Elements for another program are ignored",
        reason=(
            "Settings for MuJoCo, Drake and others ride along in many descriptions. What they change there (contact, "
            "actuators, loops) is not changed here."
        ),
        bad='<robot name="r"><link name="base"/><mujoco><compiler discardvisual="false"/></mujoco></robot>',
        find=_foreign_tags,
    ),
    Check(
        code="URDF330",
        name="gazebo-tags",
        tier="readiness",
        severity="note",
        summary="<gazebo> elements are ignored",
        reason=(
            "What they say (friction, colours, sensors, plugins) is for Gazebo alone; the robot file says what "
            "manipcli needs."
        ),
        bad=one_joint(more='<gazebo reference="tip"/>'),
        find=_gazebo_tags,
    ),
)
