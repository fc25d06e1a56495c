"""Joint limits from <ros2_control>: `min` and `max` of command interfaces, and `<limits>`.

    <joint name="elbow">
      <command_interface name="position"><param name="min">-1</param><param name="max">1</param></command_interface>
      <command_interface name="velocity"><limits enable="false"/></command_interface>
    </joint>

As in ros2_control, they narrow the joint's own <limit> and never widen it: a velocity, effort, acceleration or jerk
limit becomes the smaller of |min| and |max|. `enable="false"` removes the limit of its interface or, directly below
<joint>, the limits of all interfaces.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from manipcli.description.elements import Joint, JointLimits
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import finite


def with_control_limits(root: Element, joints: Mapping[str, Joint]) -> dict[str, Joint]:
    """The joints with their limits narrowed or removed by the <ros2_control> elements of a description."""
    found = dict(joints)
    for component in root.all("ros2_control"):
        for element in component.all("joint"):
            name = element.name
            joint = found.get(name)
            if joint is not None and joint.moves:
                found[name] = dataclasses.replace(joint, limits=_limited(joint, element))
    return found


def _limited(joint: Joint, element: Element) -> JointLimits:
    limits = joint.limits
    whole = _is_enabled(element)
    for interface in element.all("command_interface"):
        name = interface.name
        if not (whole and _is_enabled(interface)):
            limits = _without(limits, name)
            continue
        low, high = _bound(interface, "min"), _bound(interface, "max")
        if low is not None and high is not None and low > high:
            continue  # reported by check control-number
        if name == "position" and joint.type != "continuous":
            lower = max((v for v in (limits.lower, low) if v is not None), default=None)
            upper = min((v for v in (limits.upper, high) if v is not None), default=None)
            if lower is None or upper is None or lower <= upper:  # else reported by check control-number
                limits = dataclasses.replace(limits, lower=lower, upper=upper)
        elif name == "velocity":
            limits = dataclasses.replace(limits, velocity=_smaller(limits.velocity, low, high))
        elif name == "effort":
            limits = dataclasses.replace(limits, effort=_smaller(limits.effort, low, high))
        elif name == "acceleration":
            limits = dataclasses.replace(limits, acceleration=_smaller(limits.acceleration, low, high))
        elif name == "jerk":
            limits = dataclasses.replace(limits, jerk=_smaller(limits.jerk, low, high))
    return limits


def _without(limits: JointLimits, interface: str) -> JointLimits:
    if interface == "position":
        return dataclasses.replace(limits, lower=None, upper=None)
    if interface == "velocity":
        return dataclasses.replace(limits, velocity=None)
    if interface == "effort":
        return dataclasses.replace(limits, effort=None)
    return limits


def _is_enabled(element: Element) -> bool:
    tag = element.first("limits")
    return tag is None or tag.attributes.get("enable", "true").strip().lower() not in ("false", "0")


def _bound(interface: Element, key: str) -> float | None:
    for parameter in interface.all("param"):
        if parameter.name == key:
            return finite(parameter.text.strip())
    return None


def _smaller(limit: float | None, low: float | None, high: float | None) -> float | None:
    """The smallest of `limit`, |low| and |high|; bounds of 0 or on one side only have no effect."""
    sizes = [abs(v) for v in (low, high) if v is not None]
    if len(sizes) < 2 or min(sizes) == 0.0:
        return limit
    return min(sizes) if limit is None else min(limit, *sizes)
