"""Elements of URDF where they do not belong."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import any_of
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_schema import PARENTS, RULES, known_elements


def _find(subject: Subject) -> Iterator[Finding]:
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


CHECK = Check(
    code="URDF054",
    name="misplaced-element",
    tier="schema",
    severity="warning",
    summary="An element of URDF stands where it does not belong",
    reason="Programs read it only in its place: an <inertial> below <robot> says nothing to anybody.",
    bad=('<robot name="r"><link name="base"><mass value="1"/></link></robot>'),
    find=_find,
)
