"""Table of the elements and attributes of URDF, for the checks of the schema tier."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from manipcli.description.located_xml import Element


@dataclass(frozen=True, slots=True)
class ElementRule:
    """Attributes and children of an element; `once`: at most one such child, `many`: any number."""

    attributes: frozenset[str] = frozenset()
    once: frozenset[str] = frozenset()
    many: frozenset[str] = frozenset()

    @property
    def children(self) -> frozenset[str]:
        return self.once | self.many


def _rule(attributes: str = "", once: str = "", many: str = "") -> ElementRule:
    return ElementRule(frozenset(attributes.split()), frozenset(once.split()), frozenset(many.split()))


RULES: Final[dict[str, ElementRule]] = {
    "robot": _rule("name version", many="link joint material transmission"),
    "link": _rule("name type", once="inertial", many="visual collision"),
    "inertial": _rule(once="origin mass inertia"),
    "mass": _rule("value"),
    "inertia": _rule("ixx ixy ixz iyy iyz izz"),
    "origin": _rule("xyz rpy quat_xyzw"),
    "visual": _rule("name", once="origin geometry material"),
    "collision": _rule("name", once="origin geometry"),
    "geometry": _rule(many="box sphere cylinder capsule mesh"),
    "box": _rule("size"),
    "sphere": _rule("radius"),
    "cylinder": _rule("radius length"),
    "capsule": _rule("radius length"),
    "mesh": _rule("filename scale"),
    "material": _rule("name", once="color texture"),
    "color": _rule("rgba"),
    "texture": _rule("filename"),
    "joint": _rule("name type", once="origin parent child axis calibration dynamics limit safety_controller mimic"),
    "parent": _rule("link"),
    "child": _rule("link"),
    "axis": _rule("xyz"),
    "calibration": _rule("rising falling reference_position"),
    "dynamics": _rule("damping friction"),
    "limit": _rule("lower upper velocity effort acceleration deceleration jerk"),
    "safety_controller": _rule("soft_lower_limit soft_upper_limit k_position k_velocity"),
    "mimic": _rule("joint multiplier offset"),
}
"""By tag: a URDF element has the same rule everywhere, except `joint` below a transmission."""

PARENTS: Final[dict[str, tuple[str, ...]]] = {
    tag: tuple(parent for parent, rule in RULES.items() if tag in rule.children) for tag in RULES if tag != "robot"
}

FOREIGN: Final = frozenset(
    {
        "gazebo",
        "ros2_control",
        "mujoco",
        "sensor",
        "contact",
        "loop_joint",
        "webots",
        "isaac",
        "plugin",
        "verbose",
        "self_collide",
    }
)
"""Elements of other programs; their content is not checked."""


def is_foreign(tag: str) -> bool:
    """Whether an element is for another program: a known tag, or any tag with a prefix (`drake:capsule`)."""
    return ":" in tag or tag in FOREIGN


def known_elements(root: Element) -> Iterator[tuple[Element, ElementRule]]:
    """Every URDF element in its proper place with its rule, parents before children."""
    stack = [root]
    while stack:
        element = stack.pop()
        rule = RULES[element.tag]
        yield element, rule
        # Elements below a transmission follow other rules.
        stack += [child for child in reversed(element.children) if child.tag in rule.children & RULES.keys()]
