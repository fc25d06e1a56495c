"""Builds a robot from a robot file: descriptions welded together, groups, named poses, limits, tool frame."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput, Loc
from manipcli.core.geometry import Transform, frozen
from manipcli.core.text import did_you_mean
from manipcli.description.elements import Joint, JointLimits, Link, Mimic, Pin, TransmissionTag
from manipcli.description.expanded import is_plain, unread_description
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.examine import examine
from manipcli.description.packages import NotFound, Packages, may_name, own_root
from manipcli.description.urdf.joint import UNSTATED
from manipcli.description.urdf.link import MISSING_VISUAL, REGULARISED
from manipcli.description.urdf.urdf import Parts, read_parts
from manipcli.description.xacro.values import OPTENV
from manipcli.model.build_drives import build_actuators, build_transmissions
from manipcli.model.build_limits import with_limits
from manipcli.model.holding import CUP_RADIUS, Holding
from manipcli.model.inertials import ESTIMATE, repaired_links, with_inertials
from manipcli.model.joint_units import misread_units
from manipcli.model.link_collisions import REMEDY, replaced_meshes, with_collisions
from manipcli.model.link_parts import LINK_PARTS, link_parts_from_json, split_links, with_parts
from manipcli.model.loops import closed_loops, passive_joints
from manipcli.model.named_poses import build_groups, build_poses
from manipcli.model.normalised_urdf import portable_urdf
from manipcli.model.reporter import Reporter
from manipcli.model.robot import Group, RobotModel, Tool
from manipcli.spec.holding import HoldingSpec
from manipcli.spec.located import Source
from manipcli.spec.robot import AttachSpec, RobotSpec


def build_robot(
    spec: RobotSpec,
    *,
    file: Path,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    source: Source | None = None,
) -> tuple[RobotModel, tuple[Diagnostic, ...]]:
    """The robot that a robot file describes.

    Args:
        spec: the robot file.
        file: path of the robot file; its relative paths start in that folder.
        package_path: additional folders to search for packages.
        allow_outside: permits meshes and includes outside of packages and the description's folder.
        source: of the robot file, for places and units of its values.

    Returns:
        The robot, and warnings and notes.

    Raises:
        InvalidInput: all errors of the descriptions at once; if these are valid, all errors of the robot file.
    """
    reporter = Reporter(source)
    read = _Descriptions(reporter, spec, file, tuple(package_path), allow_outside)
    main = read.parts(spec.description, spec.args, ("description",))
    attached = [
        read.parts(each.description, each.args, ("attach", k, "description"), each.prefix)
        for k, each in enumerate(spec.attach)
    ]
    reporter.stop()
    assert main is not None
    body = _Body(main.root, list(main.links), list(main.joints), list(main.transmissions))
    for k, (each, parts) in enumerate(zip(spec.attach, attached, strict=True)):
        assert parts is not None
        body.weld(reporter, each, parts, k)
    reporter.stop()
    body.links = with_collisions(reporter, spec.collision, body.links)
    body.links, inertials = with_inertials(reporter, spec.inertials, body.links, body.ordered())
    names = [name for k, name in enumerate(spec.collision_parts) if _known(reporter, name, body, k)]
    body.links = list(split_links(reporter, body.links, names))
    robot = dataclasses.replace(_assembled(reporter, spec, body), inertials=inertials)
    return robot, tuple(reporter.findings)


def rebuild_robot(spec: RobotSpec, urdf: bytes, *, link_parts: bytes | None = None) -> RobotModel:
    """The robot of a log, from the complete description in it; meshes are not read.

    Args:
        spec: the resolved robot file; attached descriptions are already part of `urdf`.
        urdf: `RobotModel.urdf` of the robot.
        link_parts: what `link_parts_to_json` gave for the robot.

    Raises:
        InvalidInput: the description, the robot file or the parts are damaged.
    """
    parts = read_parts(unread_description(urdf, "robot.urdf"))
    reporter = Reporter(None)
    reporter.findings += parts.findings
    reporter.stop()
    body = _Body(parts.root, list(parts.links), list(parts.joints), list(parts.transmissions))
    if link_parts is not None:
        try:
            body.links = list(with_parts(body.links, *link_parts_from_json(link_parts)))
        except ValueError as error:
            raise InvalidInput([Diagnostic("LOG103", f"{LINK_PARTS}: {error}")]) from error
    return _assembled(reporter, spec, body)


def bare_robot(parts: Parts) -> RobotModel:
    """The robot of a valid description without a robot file: no groups, no named poses, at the world's origin."""
    return RobotModel(
        name=parts.name,
        root=parts.root,
        links=parts.links,
        joints=parts.joints,
        groups=(),
        poses=(),
        transmissions=parts.transmissions,
        X_WB=Transform.identity(),
        urdf=portable_urdf(parts.name, parts.links, parts.joints, parts.transmissions),
    )


def _assembled(reporter: Reporter, spec: RobotSpec, body: _Body) -> RobotModel:
    """The robot of welded descriptions and a robot file."""
    joints = with_limits(reporter, spec, passive_joints(reporter, spec.loops or (), body.ordered()))
    pins: tuple[Pin, ...] = ()
    if spec.loops:
        reporter.stop()
        joints, pins = closed_loops(reporter, spec.loops, joints)
    links = tuple(body.links)
    moving = {joint.name: joint for joint in joints if joint.moves}
    groups = build_groups(reporter, spec, links, joints)
    if reporter.source is not None:
        reporter.findings += misread_units(spec, reporter.source, joints, groups)
    poses = build_poses(reporter, spec, groups, moving)
    tool = _tool(reporter, spec, groups, links)
    for k, pair in enumerate(spec.collision_ignore):
        for name in pair:
            _known_link(reporter, name, links, ("collision_ignore", k))
    transmissions = build_transmissions(reporter, spec, joints, body.transmissions)
    actuators = build_actuators(reporter, spec, joints, transmissions)
    reporter.stop()
    return RobotModel(
        name=spec.robot,
        root=body.root,
        links=links,
        joints=joints,
        groups=groups,
        poses=poses,
        transmissions=transmissions,
        X_WB=spec.mount.transform,
        urdf=portable_urdf(spec.robot, links, joints, transmissions),
        tool=tool,
        collision_ignore=(*spec.collision_ignore, *(pin.links for pin in pins)),
        friction=spec.friction,
        compat=spec.compat or "ros2",
        actuators=actuators,
        pins=pins,
    )


class _Descriptions:
    """Reads the description files that a robot file names."""

    def __init__(
        self, reporter: Reporter, spec: RobotSpec, file: Path, package_path: tuple[Path, ...], allow_outside: bool
    ) -> None:
        self._reporter = reporter
        self._spec = spec
        self._folder = file.resolve().parent
        self._package_path = package_path
        self._allow_outside = allow_outside
        self._named = dict(self._packages(own_root(file) or self._folder))
        self._sources = Packages(file, package_path=package_path, allow_outside=True, named=self._named)

    def _packages(self, root: Path) -> Iterator[tuple[str, Path]]:
        """The folders of `packages:` by name, which start at the folder of the robot file; `root`: of its project."""
        for name, written in (self._spec.packages or {}).items():
            folder, loc = self._folder / written, ("packages", name)
            given = any(folder.resolve().is_relative_to(place.resolve()) for place in self._package_path)
            if not folder.is_dir():
                message = f"package '{name}': there is no folder '{written}'"
                self._reporter.error("ROBOT309", message, loc, hint="write it relative to this file")
            elif not (self._allow_outside or given or may_name(folder, name, root)):
                message = (
                    f"package '{name}': '{written}' is outside the robot file's folder, and no ROS package '{name}'"
                )
                hint = "move it into the project, add its folder with --package-path DIR, or pass --allow-outside"
                self._reporter.error("ROBOT370", message, loc, hint=hint)
            else:
                yield name, folder

    def parts(
        self, uri: str, arguments: Mapping[str, str | int | float | bool], loc: Loc, prefix: str = ""
    ) -> Parts | None:
        """The parts of a description, or None; findings go to the reporter, but those that the robot file mends."""
        try:
            path = self._sources.resolve(uri, relative_to=self._folder)
        except NotFound as error:
            self._reporter.error("ROBOT301", f"description: {error.message}", loc, hint=error.hint)
            return None
        packages = Packages(path, package_path=self._package_path, allow_outside=self._allow_outside, named=self._named)
        if arguments and is_plain(path):
            message = f"'{path.name}' is plain URDF: `args` only fill `$(var NAME)` of the controllers file"
            self._reporter.note("XACRO003", message, (*loc[:-1], "args"), hint=None)
            arguments = {}
        errors_only = tuple(check for check in CHECKS if check.severity == "error")  # others also read visual meshes
        examination = examine(path, packages=packages, arguments=arguments, checks=errors_only)
        parts = examination.parts
        links = parts.links if parts is not None else ()
        mended = {
            *repaired_links(self._spec.inertials, links, prefix),
            *replaced_meshes(self._spec.collision, links, prefix),
        }
        remedies = {finding: ESTIMATE for link in links if link.unusable for finding in link.unusable.findings}
        remedies |= {finding: REMEDY.format(link=prefix + link.name) for link in links for finding in link.missing}
        for finding in examination.errors:
            if finding not in mended:
                hint = "; or ".join(filter(None, (remedies.get(finding), finding.hint)))
                self._reporter.findings.append(dataclasses.replace(finding, hint=hint or None))
        if parts is not None:
            # Other notes are for the author of a description, not for its users.
            read = [
                each
                for each in parts.findings
                if (each.severity == "warning" and each.code != UNSTATED) or each.code in (REGULARISED, OPTENV)
            ]
            self._reporter.findings += _grouped(list(dict.fromkeys(read)))
        return parts


def _grouped(findings: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The findings, with all visual meshes that are missing in one."""
    missing = [finding for finding in findings if finding.code == MISSING_VISUAL]
    if len(missing) < 2:
        return list(findings)
    first, more = missing[0], len(missing) - 1
    message = f"{first.message} (and {more} more): the robot is simulated as before, and drawn without them"
    hint = "`manipcli check-urdf` lists them all"
    return [dataclasses.replace(first, message=message, hint=hint), *(each for each in findings if each not in missing)]


def is_mount(parts: Parts) -> bool:
    """Whether the root is only where a description alone is mounted: a bare frame `world` with one fixed joint.

    Published grippers have it, and so have arms: without it, the names of both need no prefix.
    """
    root = next(link for link in parts.links if link.name == parts.root)
    below = [joint for joint in parts.joints if joint.parent == root.name]
    bare = not (root.visuals or root.collisions or root.inertial)
    return root.name == "world" and bare and len(below) == 1 and below[0].type == "fixed"


def without_root(parts: Parts) -> tuple[Parts, Joint]:
    """The description below its mount, and the joint between the two."""
    above = next(joint for joint in parts.joints if joint.parent == parts.root)
    links = tuple(link for link in parts.links if link.name != parts.root)
    joints = tuple(joint for joint in parts.joints if joint is not above)
    return dataclasses.replace(parts, root=above.child, links=links, joints=joints), above


class _Body:
    """Links and joints while descriptions are welded together."""

    def __init__(self, root: str, links: list[Link], joints: list[Joint], transmissions: list[TransmissionTag]) -> None:
        self.root = root
        self.links = links
        self.joints = joints
        self.transmissions = transmissions

    def weld(self, reporter: Reporter, spec: AttachSpec, parts: Parts, k: int) -> None:
        """Attaches prefixed parts, below a mount, to link `spec.parent` by a fixed joint `<prefix><root>_attach`."""
        prefix = spec.prefix
        names = [link.name for link in self.links]
        if spec.parent not in names:
            message = f"link '{spec.parent}' is not in the description"
            reporter.error("ROBOT302", message, ("attach", k, "parent"), hint=did_you_mean(spec.parent, names))
            return
        X_PA = spec.pose.transform.by_angles
        if is_mount(parts):
            parts, above = without_root(parts)
            X_PA = (X_PA @ above.X_PJ).by_angles
        taken = {f"link '{name}'" for name in names} | {f"joint '{joint.name}'" for joint in self.joints}
        added = [f"link '{prefix}{link.name}'" for link in parts.links]
        added += [f"joint '{prefix}{joint.name}'" for joint in parts.joints]
        joint_name = f"{prefix}{parts.root}_attach"
        for what in (*added, f"joint '{joint_name}'"):
            if what in taken:
                hint = f"give this attachment {'another' if prefix else 'a'} prefix"
                reporter.error("ROBOT303", f"{what} already exists", ("attach", k), hint=hint)
        self.links += [dataclasses.replace(link, name=prefix + link.name) for link in parts.links]
        self.joints.append(
            Joint(
                name=joint_name,
                type="fixed",
                parent=spec.parent,
                child=prefix + parts.root,
                X_PJ=X_PA,
                axis=frozen([1.0, 0.0, 0.0]),
                limits=JointLimits(),
            )
        )
        self.joints += [_prefixed(joint, prefix) for joint in parts.joints]
        self.transmissions += [
            dataclasses.replace(
                tag,
                name=prefix + tag.name,
                joints=tuple(prefix + name for name in tag.joints),
                actuators=tuple(prefix + name for name in tag.actuators),
            )
            for tag in parts.transmissions
        ]

    def ordered(self) -> tuple[Joint, ...]:
        """Joints depth first; also sorts the links into that order."""
        from manipcli.description.urdf.topology import depth_first

        joints = depth_first(self.root, {joint.name: joint for joint in self.joints})
        by_name = {link.name: link for link in self.links}
        self.links = [by_name[self.root], *(by_name[joint.child] for joint in joints)]
        return joints


def _prefixed(joint: Joint, prefix: str) -> Joint:
    mimic = joint.mimic
    return dataclasses.replace(
        joint,
        name=prefix + joint.name,
        parent=prefix + joint.parent,
        child=prefix + joint.child,
        mimic=Mimic(prefix + mimic.joint, mimic.multiplier, mimic.offset) if mimic is not None else None,
    )


def _known(reporter: Reporter, name: str, body: _Body, k: int) -> bool:
    return _known_link(reporter, name, body.links, ("collision_parts", k))


def _known_link(reporter: Reporter, name: str, links: Sequence[Link], loc: Loc) -> bool:
    names = [link.name for link in links]
    if name not in names:
        reporter.error("ROBOT306", f"link '{name}' is not in the robot", loc, hint=did_you_mean(name, names))
    return name in names


def _tool(reporter: Reporter, spec: RobotSpec, groups: Sequence[Group], links: Sequence[Link]) -> Tool | None:
    """The tool as written, else the tip of the first group, else None."""
    if spec.tool is None:
        tip = groups[0].tip if groups else None
        return None if tip is None else Tool(link=tip, X_LT=Transform.identity())
    if not _known_link(reporter, spec.tool.link, links, ("tool", "link")):
        return None
    return Tool(link=spec.tool.link, X_LT=spec.tool.pose.transform, holding=_holding(spec.tool.holding))


def _holding(spec: HoldingSpec | None) -> Holding | None:
    if spec is None:
        return None
    if spec.suction is not None:
        force = spec.suction.force
        torque = CUP_RADIUS * force if spec.suction.torque is None else spec.suction.torque
        return Holding("suction", force, torque, spec.suction.reach)
    if spec.weld is not None:
        limits = (math.inf if limit is None else limit for limit in (spec.weld.force, spec.weld.torque))
        return Holding("weld", *limits)
    return None
