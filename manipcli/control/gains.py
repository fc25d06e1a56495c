"""From the gains of a controllers file to the PID of a controller."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from manipcli.control.pid import Compat, Pid
from manipcli.core.errors import InvalidArgument
from manipcli.spec.controllers import GainsSpec


def joint_gains(name: str, joints: tuple[str, ...], gains: Mapping[str, GainsSpec]) -> tuple[GainsSpec, ...]:
    """The gains (n) in the order of the joints, all zero where none are given.

    Raises:
        InvalidArgument: gains of a joint that controller `name` does not have.
    """
    unknown = sorted(set(gains) - set(joints))
    if unknown:
        raise InvalidArgument("CTRL102", f"controller '{name}': '{unknown[0]}' has gains, but is not one of its joints")
    return tuple(gains.get(joint, GainsSpec()) for joint in joints)


def build_pid(name: str, joints: tuple[str, ...], gains: tuple[GainsSpec, ...], compat: Compat) -> Pid:
    """The PID of gains (n).

    Raises:
        InvalidArgument: gains of a joint that are all zero and feed no velocity forward: it would never move.
    """
    for joint, g in zip(joints, gains, strict=True):
        if g.p == g.i == g.d == g.ff_velocity_scale == 0.0:
            raise InvalidArgument(
                "CTRL103",
                f"controller '{name}': the gains of joint '{joint}' are all zero, so it would not move",
                hint=f"give gains.{joint}.p",
            )
    clamp = np.array([math.inf if g.i_clamp is None else g.i_clamp for g in gains])
    return Pid(
        p=[g.p for g in gains],
        i=[g.i for g in gains],
        d=[g.d for g in gains],
        i_min=-clamp,
        i_max=clamp,
        compat=compat,
    )
