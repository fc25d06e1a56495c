"""Joints that the model of the robot leads, by computed torque or an impedance: plans, bandwidths, motors too weak."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic
from manipcli.preflight.check_files import check_files

TRANSMISSION = """<transmission name="t"><type>transmission_interface/SimpleTransmission</type>
<joint name="hinge"><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>
<actuator name="motor"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>"""
ROBOT = """poses: {zero: {all: [0]}, up: {all: [1.2]}}
tool: {link: arm}
limits: {hinge: {acceleration: 30, k_velocity: THROTTLE}}
actuators: {motor: {effort: EFFORT, LATENCY}}
"""
Found = Callable[..., tuple[Diagnostic, ...]]
COMPUTED = "type: computed_torque"
SOFT = "type: cartesian_impedance, stiffness: {translation: 100, rotation: 10}"
WEIGHT = 9.81 * 0.25 * math.sin(1.2)
"""[N m] that hold 1 kg at 0.25 m."""


@pytest.fixture
def found(pendulum: Callable[..., Path]) -> Found:
    def of(
        controller: str,
        *,
        effort: float = 20.0,
        latency: int = 0,
        k_velocity: float = 0.0,
        step: str = "move: {to: up}",
    ) -> tuple[Diagnostic, ...]:
        robot = ROBOT.replace("EFFORT", f"{effort} N m").replace("LATENCY", f"latency: {latency}")
        robot = robot.replace("THROTTLE", str(k_velocity))
        folder = pendulum(robot, urdf=TRANSMISSION)
        (folder / "c.yaml").write_text(f"controllers:\n  c: {{joints: [hinge], {controller}}}\n")
        (folder / "task.yaml").write_text(
            f"task: t\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: zero\nsteps: [{{{step}}}]\n"
        )
        return tuple(one for one in check_files([folder / "task.yaml"]) if one.severity != "note")

    return of


def test_a_task_is_planned_whoever_controls_it(found: Found) -> None:
    """The limit is 2 rad."""
    (refusal,) = found(COMPUTED, step="follow: {joint_names: [hinge], points: [{positions: [9], time_from_start: 9}]}")
    assert (refusal.code, refusal.severity) == ("PLAN100", "error")
    assert "beyond its upper limit" in refusal.message


def test_an_error_that_does_not_come_to_rest_is_told(found: Found) -> None:
    """Damped critically and looked at every h, e'' + 2 w e' + w^2 e = 0 needs w h < 2 (sqrt 2 - 1)."""
    most = 2.0 * (math.sqrt(2.0) - 1.0) / (math.tau * 1e-3)
    assert not found(f"{COMPUTED}, bandwidth: {0.99 * most}")
    (told,) = found(f"{COMPUTED}, bandwidth: {1.01 * most}")
    assert (told.code, told.severity) == ("CTRL150", "warning")
    assert told.message == f"c: bandwidth 133 Hz is unstable, the limit is {most:.3g} Hz at 1 ms"
    assert told.hint == f"lower it to at most half the limit: {most / 2:.3g} Hz"
    assert told.place is not None
    assert (Path(told.place.file).name, told.place.line) == ("c.yaml", 2)


def test_a_late_motor_bears_less(found: Found) -> None:
    assert not found(f"{COMPUTED}, bandwidth: 100")
    (told,) = found(f"{COMPUTED}, bandwidth: 100", latency=3)
    limit = re.search(r"the limit is (\S+) Hz at 1 ms and 3 ticks of latency", told.message)
    assert limit is not None
    assert not found(f"{COMPUTED}, bandwidth: {0.98 * float(limit[1])}", latency=3)


def test_gains_of_accelerations_are_told_with_a_bandwidth_that_would_do(found: Found) -> None:
    (told,) = found(f"{COMPUTED}, gains: {{hinge: {{p: 100, d: 2100}}}}")
    assert told.message == "hinge: p 100, i 0 and d 2100 (on acceleration) are unstable at 1 ms"
    assert told.hint == "remove these gains and set a `bandwidth` of at most 65.9 Hz"


@pytest.mark.parametrize("controller", [COMPUTED, SOFT])
def test_a_motor_too_weak_for_its_load_is_told(found: Found, controller: str) -> None:
    (told,) = found(controller, effort=1.0)
    assert (told.code, told.severity) == ("CTRL155", "warning")
    assert told.message == f"hinge: gravity needs up to {WEIGHT:.3g} N m, its effort limit is 1 N m"
    (told,) = found(controller, effort=WEIGHT + 0.01)
    assert told.message.startswith("hinge: the planned motions need up to")
    assert not found(controller)


@pytest.mark.parametrize("controller", [COMPUTED, SOFT])
def test_a_soft_limit_of_the_velocity_that_leaves_too_little_effort_is_told(found: Found, controller: str) -> None:
    """At v it lets k_velocity (3 rad/s - v) through."""
    (told,) = found(controller, k_velocity=1.0)
    assert (told.code, told.severity) == ("CTRL169", "warning")
    numbers = re.search(r"hinge: .* need (\S+) N m at (\S+) rad/s, .* leaves (\S+) N m", told.message)
    assert numbers is not None
    needed, v, left = map(float, numbers.groups())
    assert left == pytest.approx(3.0 - v, abs=0.006), "v has three digits"
    assert left < needed
    assert not found(controller, k_velocity=100.0, step="move: {to: up, velocity_scaling: 0.3}")
