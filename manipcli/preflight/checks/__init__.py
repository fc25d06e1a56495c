"""The preflight checks, in the order of their findings."""

from manipcli.core.registry import Seam
from manipcli.preflight.checks import (
    closing_speed,
    deadlines,
    error_dynamics,
    gain_stability,
    goal_tolerances,
    grip_force_limit,
    grip_friction,
    grip_stiffness,
    idle_keeps,
    inert_actuators,
    insufficient_effort,
    light_objects,
    overlapping_start,
    position_grips,
    rotation_slip,
    round_trips,
    unsupported,
    velocity_gains,
)
from manipcli.preflight.preflight import Check

PREFLIGHT_CHECKS: Seam[Check] = Seam(
    kind="preflight check",
    members=(
        round_trips.CHECK,
        closing_speed.CHECK,
        deadlines.CHECK,
        idle_keeps.CHECK,
        grip_force_limit.CHECK,
        light_objects.CHECK,
        grip_friction.CHECK,
        grip_stiffness.CHECK,
        position_grips.CHECK,
        rotation_slip.CHECK,
        gain_stability.CHECK,
        velocity_gains.CHECK,
        error_dynamics.CHECK,
        insufficient_effort.CHECK,
        goal_tolerances.CHECK,
        inert_actuators.CHECK,
        overlapping_start.CHECK,
        unsupported.CHECK,
    ),
)
