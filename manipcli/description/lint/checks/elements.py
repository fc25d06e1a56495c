"""What is written where nobody reads it, or reads something else: elements, attributes, text, numbers."""

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
_TOLD_ELSEWHERE: Final = frozenset({"gazebo", "ros2_control"})


@check(
    "URDF053",
    "unknown-element",
    "schema",
    "warning",
    bad=robot('<link name="base"><colision><geometry><box size="1 1 1"/></geometry></colision></link>'),
)
def _unknown_element(subject: Subject) -> Iterator[Diagnostic]:
    """An element is none of URDF.

    Programs skip what they do not know: a misspelt <colision> is a link that nothing touches. Elements that are
    known to speak to another program (gazebo, ros2_control, anything with a prefix) are left alone.
    """
    for element, rule in known_elements(subject.description.root):
        if element.tag == "geometry":
            continue  # what is no shape is told where shapes are read
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
    """An element of URDF stands where it does not belong.

    Programs read it only in its place: an <inertial> below <robot> says nothing to anybody.
    """
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
            yield Diagnostic("URDF054", message, child.place, hint, "note" if harmless else "warning")


@check("URDF055", "unknown-attribute", "schema", "warning", bad=bare_joint('<origin xzy="0 0 1"/>'))
def _unknown_attribute(subject: Subject) -> Iterator[Diagnostic]:
    """An attribute is none of its element.

    Programs skip what they do not know: what was meant by it is not there, and a default is.
    """
    for element, rule in known_elements(subject.description.root):
        for name in element.attributes:
            if name in rule.attributes or ":" in name:
                continue
            message = f"<{element.tag}> has no attribute '{shorten(name)}' in URDF; it is ignored"
            hint = did_you_mean(name, sorted(rule.attributes), kind="attributes") if len(name) < 40 else None
            yield Diagnostic("URDF055", message, element.place, hint, "warning")


@check("URDF056", "repeated-element", "schema", "warning", bad=bare_joint('<origin xyz="0 0 1"/><origin xyz="0 0 2"/>'))
def _repeated_element(subject: Subject) -> Iterator[Diagnostic]:
    """An element is there twice where one is read.

    Programs read the first, some the last: the same file then is two robots.
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
    """There is text where URDF has none.

    A value written between tags is read by nobody; a comment without its marks may hide what stood there.
    """
    for element, _ in known_elements(subject.description.root):
        if element.text:
            message = f"text in <{element.tag}>, which is ignored: '{shorten(' '.join(element.text[:200].split()))}'"
            hint = "URDF says everything with attributes; a remark is written <!-- like this -->"
            yield Diagnostic("URDF057", message, element.text_place or element.place, hint, "warning")


@check("URDF067", "unread-number", "schema", "warning", bad=bare_joint('<calibration rising="soon"/>'))
def _unread_number(subject: Subject) -> Iterator[Diagnostic]:
    """A number that only other programs read is none.

    Safety controllers, calibrations and the axis of a fixed joint mean nothing to a simulation, but other programs
    refuse the joint, or the file, for a bad number in them.
    """
    told = {(finding.message, finding.place) for finding in subject.parts.findings}
    for joint in subject.description.root.all("joint"):
        reader = Reader()
        for element in joint.children:
            _read(reader, element)
        for finding in reader.findings:
            if (finding.message, finding.place) not in told:
                message = f"{finding.message} (manipcli does not read it here)"
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

    Settings for MuJoCo, Drake and others ride along in many descriptions. What they change there (contact,
    actuators, loops) is not changed here.
    """
    # One finding for each tag: the first of them, and how many there are.
    found: dict[str, list[Element]] = {}
    for element, _ in known_elements(subject.description.root):
        for child in element.children:
            if is_foreign(child.tag) and child.tag not in _TOLD_ELSEWHERE:
                found.setdefault(child.tag, []).append(child)
    for tag, elements in found.items():
        many = f"{len(elements)} <{shorten(tag)}> elements are" if len(elements) > 1 else f"<{shorten(tag)}> is"
        yield Diagnostic("URDF069", f"{many} for another program, and ignored", elements[0].place, severity="note")


@check("URDF330", "gazebo-tags", "readiness", "note", bad=one_joint(more='<gazebo reference="tip"/>'))
def _gazebo_tags(subject: Subject) -> Iterator[Diagnostic]:
    """<gazebo> elements are ignored.

    What they say (friction, colours, sensors, plugins) is for Gazebo alone; the robot file says what manipcli
    needs.
    """
    # One finding for all of them, and one for each that refers to nothing.
    tags = subject.description.root.all("gazebo")
    if tags:
        many = f"{len(tags)} <gazebo> elements are" if len(tags) > 1 else "a <gazebo> element is"
        yield Diagnostic(
            "URDF330", f"{many} ignored", tags[0].place, "friction: see `friction` of the robot file", "note"
        )
    root = subject.description.root
    known = [each.name for tag in ("link", "joint") for each in root.all(tag)]
    for tag in tags:
        name = tag.attributes.get("reference", "").strip()
        if name and name not in known:
            message = f"<gazebo> refers to '{shorten(name)}', which is no link and no joint"
            near = did_you_mean(name, known) if len(known) < 1000 else None
            yield Diagnostic("URDF330", message, tag.place, near, "note")
