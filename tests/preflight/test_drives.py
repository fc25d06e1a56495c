"""Joints that engines' motors move: velocity loops that ring, motors too weak, and what of an actuator does not act."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic
from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task

TRANSMISSION = """<transmission name="t"><type>transmission_interface/SimpleTransmission</type>
<joint name="hinge"><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>
<actuator name="motor"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>"""
ROBOT = """poses: {zero: {all: [0]}, up: {all: [1.2]}}
tool: {link: arm}
limits: {hinge: {acceleration: 10}}
actuators: {motor: {effort: 1, MORE}}
"""
Found = Callable[..., tuple[Diagnostic, ...]]
NEEDED = 9.81 * 0.25 * 0.932
"""[N m] that hold 1 kg at 0.25 m, turned by 1.2 rad."""


@pytest.fixture
def found(pendulum: Callable[..., Path]) -> Found:
    def of(controller: str, *overrides: str, more: str = "rotor_inertia: 2e-5") -> tuple[Diagnostic, ...]:
        folder = pendulum(ROBOT.replace("MORE", more), urdf=TRANSMISSION)
        (folder / "c.yaml").write_text(
            f"controllers:\n  c: {{type: joint_trajectory, joints: [hinge], {controller}}}\n"
        )
        (folder / "task.yaml").write_text(
            "task: t\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: zero\nsteps: [{move: {to: up}}]\n"
        )
        return preflight_findings(load_task(folder / "task.yaml", overrides=overrides))

    return of


@pytest.mark.parametrize(
    ("gains", "told"),
    [
        ("p: 2100", "p 2100 on the velocity interface is unstable, the limit is 2000 at 1 ms"),
        ("p: 1700", "p 1700 on the velocity interface rings at 1 ms: its command changes sign every tick"),
        ("p: 1700, d: 0.2", "p 1700 on the velocity interface is unstable, the limit is 1600 at 1 ms"),
        ("p: 20, d: 1.1", "p 20, i 0 and d 1.1 on the velocity interface are unstable at 1 ms"),
        ("p: 1000", None),
        ("p: 20, i: 10, d: 0.1", None),
    ],
)
def test_a_velocity_loop_that_rings_is_told(found: Found, gains: str, told: str | None) -> None:
    messages = [one.message for one in found(f"command_interface: velocity, gains: {{hinge: {{{gains}}}}}")]
    assert messages == ([f"hinge: {told}"] if told else [])


def test_a_slow_controller_bears_less(found: Found) -> None:
    (ring,) = found("command_interface: velocity, update_rate: 250, gains: {hinge: {p: 600}}")
    assert "p 600 on the velocity interface is unstable, the limit is 500 at 4 ms" in ring.message


@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_a_motor_too_weak_for_gravity_is_told(found: Found, interface: str) -> None:
    controller = f"command_interface: {interface}" + (", gains: {hinge: {p: 20}}" if interface == "velocity" else "")
    (weak,) = found(controller, "robot.actuators.motor.effort=0.04")
    told = re.search(r"hinge: gravity needs up to ([\d.]+) N m, its effort limit is 2 N m", weak.message)
    assert told is not None
    assert float(told[1]) == pytest.approx(NEEDED, rel=0.01)
    assert (weak.code, weak.severity) == ("CTRL155", "warning")
    assert found(controller, "robot.actuators.motor.effort=0.3") == ()
    assert found(controller, "robot.actuators.motor.effort=0.04", "simulation.engine=kinematic") == ()


def test_what_of_an_actuator_does_not_act_is_named(found: Found) -> None:
    more = "velocity: 50, viscous_friction: 1e-5, latency: 3"
    (one,) = found("command_interface: position", more=more)
    assert one.message == (
        "actuator 'motor': velocity limit, friction and latency have no effect under the position commands of 'c'; "
        "the plan moves 'motor' at 150 (limit 50) per second"
    )
    assert (one.code, one.severity, Path(one.place.file).name) == ("CTRL158", "warning", "robot.yaml")
    for limit, beyond in ((149, True), (151, False)):  # 3 rad/s of the joint behind a gear of 50
        (one,) = found("command_interface: position", more=f"velocity: {limit}")
        assert ("the plan moves 'motor' at 150" in one.message) is beyond
    (one,) = found("command_interface: position", more="latency: 3")
    assert one.message == "actuator 'motor': latency has no effect under the position commands of 'c'"
    efforts = found("command_interface: effort, gains: {hinge: {p: 80, d: 6}}", more=more)
    assert "CTRL158" not in {each.code for each in efforts}


def test_latency_counts_in_whole_ticks_of_the_controller(found: Found) -> None:
    """1 ms of latency delays by a whole tick of 4 ms: v' = v - (h / I) d v_before is stable below d = I / h."""
    controller = "command_interface: effort, update_rate: 250, gravity_compensation: true"
    (late,) = found(f"{controller}, gains: {{hinge: {{p: 1, d: 25}}}}", more="latency: 1")
    told = re.match(r"hinge: d 25 is unstable, the limit is ([\d.]+) at 4 ms and 1 tick of latency", late.message)
    assert told is not None, late.message
    assert float(told[1]) == pytest.approx((0.02 + 0.25**2) / 4e-3, rel=0.02)
    assert found(f"{controller}, gains: {{hinge: {{p: 1, d: 19}}}}") == ()
