"""Builds the groups and named poses of a robot file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean, distinguished
from manipcli.description.elements import Joint, Link
from manipcli.model.robot import Group, NamedPose
from manipcli.spec.robot import GroupSpec, RobotSpec

if TYPE_CHECKING:
    from manipcli.model.reporter import Reporter

LIMIT_TOLERANCE = 1e-6
"""Accepted excess of a named pose over a limit [rad or m]: angles in degrees are written with few digits."""


def interval(lower: float | None, upper: float | None) -> str:
    """`-1 to 2`; None is unlimited."""
    return f"{'-inf' if lower is None else f'{lower:g}'} to {'inf' if upper is None else f'{upper:g}'}"


def build_groups(
    reporter: Reporter, spec: RobotSpec, links: Sequence[Link], joints: Sequence[Joint]
) -> tuple[Group, ...]:
    """The groups of a robot file; errors go to the reporter."""
    found = []
    for name, group in spec.groups.items():
        built = _group(reporter, name, group, links, joints)
        if built is not None:
            found.append(built)
    return tuple(found)


def _group(
    reporter: Reporter, name: str, spec: GroupSpec, links: Sequence[Link], joints: Sequence[Joint]
) -> Group | None:
    link_names = [link.name for link in links]
    if (spec.chain is None) == (spec.joints is None):
        message = f"group '{name}' must have either a chain or a list of joints"
        reporter.error("ROBOT310", message, ("groups", name))
        return None
    if spec.tip is not None and spec.tip not in link_names:
        message = f"group '{name}': tip link '{spec.tip}' is not in the robot"
        reporter.error("ROBOT306", message, ("groups", name, "tip"), hint=did_you_mean(spec.tip, link_names))
        return None
    if spec.joints is not None:
        return _listed(reporter, name, spec.joints, spec.tip, joints)
    assert spec.chain is not None
    for key, link in (("base", spec.chain.base), ("tip", spec.chain.tip)):
        if link not in link_names:
            message = f"group '{name}': {key} link '{link}' is not in the robot"
            reporter.error("ROBOT306", message, ("groups", name, "chain", key), hint=did_you_mean(link, link_names))
            return None
    by_child = {joint.child: joint for joint in joints}
    path: list[Joint] = []
    at = spec.chain.tip
    while at != spec.chain.base and at in by_child:
        path.append(by_child[at])
        at = by_child[at].parent
    if at != spec.chain.base:
        message = f"group '{name}': tip link '{spec.chain.tip}' is not below base link '{spec.chain.base}'"
        reporter.error("ROBOT311", message, ("groups", name, "chain"))
        return None
    names = tuple(joint.name for joint in reversed(path) if joint.independent)
    if not names:
        message = f"group '{name}': no moving joint between '{spec.chain.base}' and '{spec.chain.tip}'"
        reporter.error("ROBOT311", message, ("groups", name, "chain"))
        return None
    return Group(name=name, joints=names, tip=spec.tip or spec.chain.tip)


def _listed(
    reporter: Reporter, name: str, listed: Sequence[str], tip: str | None, joints: Sequence[Joint]
) -> Group | None:
    by_name = {joint.name: joint for joint in joints}
    usable = [joint.name for joint in joints if joint.independent]
    good = bool(listed)
    if not listed:
        reporter.error("ROBOT310", f"group '{name}' has no joint", ("groups", name, "joints"))
    for k, joint in enumerate(listed):
        if joint in usable and joint not in listed[:k]:
            continue
        good = False
        known = by_name.get(joint)
        if known is None:
            message = f"group '{name}': joint '{joint}' is not in the robot"
        elif known.mimic is not None:
            message = f"group '{name}': joint '{joint}' mimics '{known.mimic.joint}' and cannot be commanded"
        elif not known.moves:
            message = f"group '{name}': joint '{joint}' is fixed"
        else:
            message = f"group '{name}': duplicate joint '{joint}'"
        hint = did_you_mean(joint, usable) if known is None else None
        reporter.error("ROBOT312", message, ("groups", name, "joints", k), hint=hint)
    return Group(name=name, joints=tuple(listed), tip=tip) if good else None


def build_poses(
    reporter: Reporter, spec: RobotSpec, groups: Sequence[Group], moving: Mapping[str, Joint]
) -> tuple[NamedPose, ...]:
    """The named poses of a robot file, each over all its groups, within the limits of the joints."""
    return tuple(_Poses(reporter, spec, groups, moving).build(name) for name in spec.poses)


class _Poses:
    """Named poses, looked up by (pose, group): a pose can refer to another pose for each group."""

    def __init__(
        self, reporter: Reporter, spec: RobotSpec, groups: Sequence[Group], moving: Mapping[str, Joint]
    ) -> None:
        self._reporter = reporter
        self._spec = spec
        self._groups = {group.name: group for group in groups}
        self._moving = moving

    def build(self, name: str) -> NamedPose:
        values: dict[str, float] = {}
        for group in self._spec.poses[name]:
            if group not in self._spec.groups:
                message = f"pose '{name}': unknown group '{group}'"
                self._reporter.error("ROBOT320", message, ("poses", name, group), hint=self._group_hint(group))
            elif group in self._groups:  # invalid groups are already reported
                values |= self._part(name, group, ())
        at = (self._moving[joint].limits.nearest(q) if joint in self._moving else q for joint, q in values.items())
        return NamedPose(name=name, joints=tuple(values), positions=tuple(at))

    def _group_hint(self, group: str) -> str | None:
        if group in self._moving:
            own = next((known.name for known in self._groups.values() if group in known.joints), "GROUP")
            return f"'{group}' is a joint; write its position below a group: {{{own}: {{{group}: ...}}}}"
        if not self._spec.groups:
            return f"define it: groups: {{{group}: {{joints: [...]}}}}"
        return did_you_mean(group, self._spec.groups)

    def _part(self, name: str, group: str, seen: tuple[str, ...]) -> dict[str, float]:
        """Joint values of a group in a pose; references to other poses are resolved."""
        part = self._spec.poses[name][group]
        loc = ("poses", name, group)
        joints = self._groups[group].joints
        if isinstance(part, str):
            having = [other for other, parts in self._spec.poses.items() if group in parts and other != name]
            if part in seen or part == name:
                circle = " -> ".join([*seen, name, part])
                self._reporter.error("ROBOT321", f"pose '{name}' refers to itself: {circle}", loc)
                return {}
            if part not in having:
                message = f"pose '{name}': unknown pose '{part}' of group '{group}'"
                self._reporter.error("ROBOT321", message, loc, hint=did_you_mean(part, having))
                return {}
            return self._part(part, group, (*seen, name))
        if seen:  # the values are checked in the pose that defines them
            return dict(part) if isinstance(part, dict) else dict(zip(joints, part, strict=False))
        if isinstance(part, dict):
            for joint in part:
                if joint not in joints:
                    message = f"pose '{name}': joint '{joint}' is not in group '{group}'"
                    hint = did_you_mean(joint, joints)
                    self._reporter.error("ROBOT322", message, ("poses", name, group, joint), hint=hint)
            named = {joint: value for joint, value in part.items() if joint in joints}
            return self._checked(name, named, {joint: (*loc, joint) for joint in named})
        if len(part) != len(joints):
            message = f"pose '{name}' has {len(part)} values for the {len(joints)} joints of group '{group}'"
            self._reporter.error("ROBOT322", message, loc, hint=f"give one value each for {', '.join(joints)}")
            return {}
        return self._checked(name, dict(zip(joints, part, strict=True)), {j: (*loc, k) for k, j in enumerate(joints)})

    def _checked(self, name: str, values: dict[str, float], locs: Mapping[str, Loc]) -> dict[str, float]:
        for joint, value in values.items():
            limits = self._moving[joint].limits
            low = limits.lower is not None and value < limits.lower - LIMIT_TOLERANCE
            high = limits.upper is not None and value > limits.upper + LIMIT_TOLERANCE
            if low or high:
                within = interval(limits.lower, limits.upper)
                message = f"pose '{name}': joint '{joint}' at {value:g} is outside its limits {within}"
                self._reporter.error("ROBOT323", message, locs[joint], hint=self._moving[joint].meant(value))
                continue
            least, most = limits.within_soft
            if not least <= limits.nearest(value) <= most:
                word, limit = ("lower", least) if value < least else ("upper", most)
                at, bound = distinguished(value, limit, form=".6g")
                message = f"pose '{name}': joint '{joint}' at {at} is beyond its soft {word} limit {bound}"
                hint = f"change the pose, `soft_{word}` or `k_position`: no arm motion starts or ends there"
                self._reporter.warning("ROBOT324", message, locs[joint], hint=hint)
        return values
