"""PID gains of a controllers file: conversion to a `Pid`, and their checks."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TypeVar

from pydantic import ValidationError

from manipcli.conditions.condition import Problem
from manipcli.control.pid import AntiWindup, Pid
from manipcli.core.errors import InvalidArgument, Loc
from manipcli.core.text import did_you_mean, nearest
from manipcli.description.transmission import Compat
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import GainsSpec, Interface


def joint_gains(
    name: str, joints: tuple[str, ...], gains: Mapping[str, GainsSpec | Mapping[str, float]]
) -> tuple[GainsSpec, ...]:
    """The gains (n) in the order of the joints, all zero where none are given.

    Raises:
        InvalidArgument: gains of a joint that is not in controller `name`; see `gains_of`.
    """
    unknown = sorted(set(gains) - set(joints))
    if unknown:
        message = f"controller '{name}': '{unknown[0]}' has gains, but is not a joint of the controller"
        raise InvalidArgument("CTRL102", message)
    return tuple(gains_of(name, joint, gains.get(joint, {}), GainsSpec) for joint in joints)


G = TypeVar("G", bound=GainsSpec)


def gains_of(name: str, joint: str, given: object, kind: type[G]) -> G:
    """The gains of one joint of controller `name`, which may be `given` as a mapping of its fields.

    Raises:
        InvalidArgument: unknown fields, values out of range, or no mapping.
    """
    try:
        return kind.model_validate(given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in first["loc"])
    where = f"controller '{name}': the gains of joint '{joint}'"
    if first["type"] == "extra_forbidden":
        hint = did_you_mean(field, kind.model_fields, kind="gains")
        raise InvalidArgument("CTRL109", f"{where} have an unknown field '{field}'", hint=hint)
    what = f"{field} {first['input']!r}" if field else repr(first["input"])
    raise InvalidArgument("CTRL109", f"{where}: {what}: {first['msg']}")


def build_pid(name: str, joints: tuple[str, ...], gains: tuple[GainsSpec, ...], compat: Compat | None) -> Pid:
    """The PID of gains (n).

    Raises:
        InvalidArgument: the gains of a joint are all zero, without velocity feed-forward: it would never move.
    """
    return Pid(
        **_numbers(name, joints, gains),
        antiwindup=[_antiwindup(g, compat) for g in gains],
        compat="ros2" if compat is None else compat,
    )


def tune_pid(pid: Pid | None, name: str, joints: tuple[str, ...], gains: tuple[GainsSpec, ...]) -> None:
    """Replace the gains (n) of a PID of `build_pid`, except its anti-windup; raises as that, and then changes none."""
    if pid is not None:
        pid.set_gains(**_numbers(name, joints, gains))


def _numbers(name: str, joints: tuple[str, ...], gains: tuple[GainsSpec, ...]) -> dict[str, list[float]]:
    """What `Pid.set_gains` takes."""
    for joint, g in zip(joints, gains, strict=True):
        if g.idle:
            raise InvalidArgument(
                "CTRL103",
                f"controller '{name}': the gains of joint '{joint}' are all zero; it would not move",
                hint=f"give gains.{joint}.p",
            )
    return {
        "p": [g.p for g in gains],
        "i": [g.i for g in gains],
        "d": [g.d for g in gains],
        "u_min": [-math.inf if g.u_clamp_min is None else g.u_clamp_min for g in gains],
        "u_max": [math.inf if g.u_clamp_max is None else g.u_clamp_max for g in gains],
        "i_min": [g.integral_bounds[0] for g in gains],
        "i_max": [g.integral_bounds[1] for g in gains],
        "tracking_time": [g.tracking_time_constant for g in gains],
        "error_deadband": [g.error_deadband for g in gains],
    }


def _antiwindup(gains: GainsSpec, compat: Compat | None) -> AntiWindup:
    """ROS 1 has a boolean, for its own law; by the other rules the integral is always clamped."""
    return "conditional_integration" if compat == "ros1" and gains.antiwindup else gains.antiwindup_strategy


def own_joints(robot: RobotModel, joints: Sequence[str]) -> tuple[str, ...]:
    """The joints that do not mimic another: mimic joints cannot be commanded, so they need no values."""
    following = {joint.name for joint in robot.joints if joint.mimic is not None}
    return tuple(joint for joint in joints if joint not in following)


def strangers(
    robot: RobotModel, joints: Sequence[str], given: Collection[str], loc: Loc, what: str, code: str
) -> Iterator[Problem]:
    """Values (`what`: gains, tolerances) at `loc` for joints that are not in `joints`."""
    without = [
        joint for joint in own_joints(robot, joints) if joint not in given
    ]  # only a joint without values can be meant
    for joint in given:
        if joint not in joints:
            near = did_you_mean(joint, without, kind=f"joints without {what}")
            hint = near or f"remove them, or add '{joint}' to `joints`"
            message = f"'{joint}' has {what}, but is not a joint of the controller"
            yield Problem((*loc, joint), message, hint, code)


def idle_gains(
    robot: RobotModel, joints: Sequence[str], gains: Mapping[str, GainsSpec], interface: Interface
) -> Iterator[Problem]:
    """Joints that would never move: their gains are all zero, without velocity feed-forward.

    Not a joint whose gains are under a misspelt name, which `strangers` reports.
    """
    lacking = [joint for joint in own_joints(robot, joints) if joint not in gains]
    misspelt = {near for name in gains if name not in joints for near in nearest(name, lacking)}
    for joint in own_joints(robot, joints):
        own = gains.get(joint)
        if joint in misspelt:
            continue
        if own is None or own.idle:
            loc = ("gains", joint) if own is not None else ("gains",) if gains else ()
            what = "has no gains" if own is None else "has gains that are all zero"
            message = f"joint '{joint}' {what}; on the {interface} interface it would not move"
            wanted = f"give gains.{joint}.p" if gains else f"add `gains: {{{joint}: {{p: ..., d: ...}}}}`"
            yield Problem(loc, message, f"{wanted}; `manipcli tune ROBOT CONTROLLERS` proposes them", "CTRL103")
