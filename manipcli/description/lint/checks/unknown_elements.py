"""Checks of elements, attributes, text and numbers that are unknown, misplaced or ignored."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import any_of, did_you_mean, nearest, shorten
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.samples import bare_joint, one_joint, robot
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
_REPORTED_ELSEWHERE: Final = frozenset({"gazebo", "ros2_control"})


@check(
    "URDF053",
    "unknown-element",
    "schema",
    "warning",
    bad=robot('<link name="base"><colision><geometry><box size="1 1 1"/></geometry></colision></link>'),
)
def _unknown_element(subject: Subject) -> Iterator[Diagnostic]:
    """An element is not part of URDF.

    Programs skip unknown elements: a misspelt <colision> leaves a link without collisions. Elements of other programs
    (gazebo, ros2_control, anything with a prefix) are not reported.
    """
    for element, rule in known_elements(subject.description.root):
        if element.tag == "geometry":
            continue  # the reader reports unknown shapes
        for child in element.children:
            if child.tag in RULES or child.tag == "transmission" or is_foreign(child.tag):
                continue
            message = f"unknown element <{shorten(child.tag)}> in <{element.tag}>; it is ignored"
            close = nearest(child.tag, [*sorted(rule.children), *RULES]) if len(child.tag) < 40 else ()
            yield Diagnostic(
                "URDF053", message, child.place, f"did you mean <{close[0]}>?" if close else None, "warning"
            )


@check("URDF054", "misplaced-element", "schema", "warning", bad=robot('<link name="base"><mass value="1"/></link>'))
def _misplaced_element(subject: Subject) -> Iterator[Diagnostic]:
    """A URDF element is in the wrong parent.

    Programs read it only in its proper place: an <inertial> below <robot> has no effect.
    """
    for element, rule in known_elements(subject.description.root):
        if element.tag == "geometry":
            continue
        for child in element.children:
            if child.tag not in RULES or child.tag in rule.children:
                continue
            message = f"<{child.tag}> does not belong in <{element.tag}>; it is ignored"
            hint = f"move it into {any_of(PARENTS.get(child.tag, ()))}" if child.tag in PARENTS else None
            # Exporters write a colour for the collision shape; dropping it is harmless.
            harmless = (element.tag, child.tag) == ("collision", "material")
            yield Diagnostic("URDF054", message, child.place, hint, "note" if harmless else "warning")


@check("URDF055", "unknown-attribute", "schema", "warning", bad=bare_joint('<origin xzy="0 0 1"/>'))
def _unknown_attribute(subject: Subject) -> Iterator[Diagnostic]:
    """An element has an attribute that URDF does not define.

    Programs skip unknown attributes and use the default of the intended one.
    """
    for element, rule in known_elements(subject.description.root):
        for name in element.attributes:
            if name in rule.attributes or ":" in name:
                continue
            message = f"unknown attribute '{shorten(name)}' of <{element.tag}>; it is ignored"
            hint = did_you_mean(name, sorted(rule.attributes), kind="attributes") if len(name) < 40 else None
            yield Diagnostic("URDF055", message, element.place, hint, "warning")


@check("URDF056", "repeated-element", "schema", "warning", bad=bare_joint('<origin xyz="0 0 1"/><origin xyz="0 0 2"/>'))
def _repeated_element(subject: Subject) -> Iterator[Diagnostic]:
    """An element is repeated where URDF allows one.

    Some programs read the first, some the last: the same file then gives different robots.
    """
    for element, rule in known_elements(subject.description.root):
        seen: set[str] = set()
        for child in element.children:
            if child.tag in seen and child.tag in rule.once:
                message = f"<{element.tag}> has more than one <{child.tag}>; the first is used"
                yield Diagnostic("URDF056", message, child.place, "delete one of them", "warning")
            seen.add(child.tag)


@check(
    "URDF057",
    "stray-text",
    "schema",
    "warning",
    bad=robot(
        '<link name="base"><inertial><mass value="1">2</mass>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
    ),
)
def _stray_text(subject: Subject) -> Iterator[Diagnostic]:
    """An element contains text, which URDF does not use.

    A value between tags has no effect; text may also be a comment without its marks.
    """
    for element, _ in known_elements(subject.description.root):
        if element.text:
            message = f"text in <{element.tag}> is ignored: '{shorten(' '.join(element.text[:200].split()))}'"
            hint = "write values as attributes, and comments as <!-- comment -->"
            yield Diagnostic("URDF057", message, element.text_place or element.place, hint, "warning")


@check("URDF067", "unread-number", "schema", "warning", bad=bare_joint('<calibration rising="soon"/>'))
def _unread_number(subject: Subject) -> Iterator[Diagnostic]:
    """A number that only other programs read is invalid.

    manipcli does not use calibrations or the axis of a fixed joint, but other programs reject the joint or the file
    for an invalid number in them.
    """
    reported = {(finding.message, finding.place) for finding in subject.parts.findings}
    for joint in subject.description.root.all("joint"):
        reader = Reader()
        for element in joint.children:
            _read(reader, element)
        for finding in reader.findings:
            if (finding.message, finding.place) not in reported:
                message = f"{finding.message} (manipcli does not use this number)"
                yield Diagnostic("URDF067", message, finding.place, severity="warning")


def _read(reader: Reader, element: Element) -> None:
    for attribute, count in _COUNTS.get(element.tag, {}).items():
        reader.numbers(element, attribute, count)


@check(
    "URDF069",
    "foreign-tags",
    "schema",
    "note",
    bad=robot('<link name="base"/><mujoco><compiler discardvisual="false"/></mujoco>'),
)
def _foreign_tags(subject: Subject) -> Iterator[Diagnostic]:
    """Elements for another program are ignored.

    Many descriptions contain settings for MuJoCo, Drake and others. What they change there (contact, actuators,
    loops) has no effect in manipcli.
    """
    # One finding per tag, at the first element, with the count.
    found: dict[str, list[Element]] = {}
    for element, _ in known_elements(subject.description.root):
        for child in element.children:
            if is_foreign(child.tag) and child.tag not in _REPORTED_ELSEWHERE:
                found.setdefault(child.tag, []).append(child)
    for tag, elements in found.items():
        many = f"{len(elements)} <{shorten(tag)}> elements are" if len(elements) > 1 else f"<{shorten(tag)}> is"
        message = f"{many} for another program and {'are' if len(elements) > 1 else 'is'} ignored"
        yield Diagnostic("URDF069", message, elements[0].place, severity="note")


@check("URDF330", "gazebo-tags", "readiness", "note", bad=one_joint(more='<gazebo reference="tip"/>'))
def _gazebo_tags(subject: Subject) -> Iterator[Diagnostic]:
    """<gazebo> elements are ignored.

    Their settings (friction, colours, sensors, plugins) apply to Gazebo only; manipcli reads the robot file.
    """
    # One finding for all of them, and one for each with an unknown reference.
    tags = subject.description.root.all("gazebo")
    if tags:
        many = f"{len(tags)} <gazebo> elements are" if len(tags) > 1 else "a <gazebo> element is"
        yield Diagnostic(
            "URDF330", f"{many} ignored", tags[0].place, "set friction with `friction` in the robot file", "note"
        )
    root = subject.description.root
    known = [element.name for tag in ("link", "joint") for element in root.all(tag)]
    for tag in tags:
        name = tag.attributes.get("reference", "").strip()
        if name and name not in known:
            message = f"<gazebo> refers to '{shorten(name)}', which is neither a link nor a joint"
            near = did_you_mean(name, known) if len(known) < 1000 else None
            yield Diagnostic("URDF330", message, tag.place, near, "note")
