"""Declarations of control laws, for checks of gains before a run and for tuning.

Each controller type declares one of: a PID loop per joint, inverse dynamics with a prescribed error, or no loop to
examine, with the reason. There is no default, so that a new controller type cannot go unchecked by omission.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from manipcli.spec.controllers import GainsSpec, Interface


@dataclass(frozen=True, slots=True)
class PidLoop:
    """u = p e + d de/dt + I for each joint on one interface, effort or velocity; de/dt uses measured velocities.

    Attributes:
        gains: by joint, as in the field `gains` of the spec; a missing joint has gains of zero.
        carries_weight: gravity is fed forward, so the gains need not hold it.
        tolerances: by joint, the error [rad or m] at which a goal fails.
        tunable: `manipcli tune` proposes its gains.
    """

    gains: Mapping[str, GainsSpec]
    carries_weight: bool = False
    tolerances: Mapping[str, float] = field(default_factory=dict)
    tunable: bool = True


@dataclass(frozen=True, slots=True)
class InverseDynamicsLoop:
    """Efforts of inverse dynamics, so that each joint's error obeys e'' = -p e - d e' - i z with the sum z of errors.

    Attributes:
        bandwidth: [Hz], as in the field `bandwidth` of the spec.
        damping_ratio: of the error.
        gains: by joint, instead of bandwidth and ratio, as in the field `gains` of the spec.
    """

    bandwidth: float
    damping_ratio: float
    gains: Mapping[str, GainsSpec]


@dataclass(frozen=True, slots=True)
class NoLoop:
    """No loop to examine; `reason` completes "controller NAME: ..." in a note of `manipcli tune`."""

    reason: str


ControlLoop = PidLoop | InverseDynamicsLoop | NoLoop


@dataclass(frozen=True, slots=True)
class HandSettings:
    """Limits of a controller of the role `hand`.

    Attributes:
        interface: what it commands of each joint.
        speed: [rad/s or m/s] of its references; None: as fast as all joints may.
        max_effort: [N m or N] of each joint; None: the joint's limit.
    """

    interface: Interface
    speed: float | None
    max_effort: float | None


def error_gains(bandwidth: float, damping_ratio: float) -> GainsSpec:
    """p = (2 pi f)^2 [1/s2] and d = 4 pi f ratio [1/s] of a bandwidth f [Hz]."""
    pulse = math.tau * bandwidth
    return GainsSpec(p=pulse * pulse, d=2.0 * damping_ratio * pulse)
