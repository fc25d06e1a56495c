"""Two pendulums that hang: doubts about the gains of controllers while they are active, and at no other time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic
from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task

ARM = """<link name="{0}_arm"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{0}" type="revolute"><parent link="base"/><child link="{0}_arm"/><origin xyz="0 {1} 0"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="200"/></joint>"""
URDF = f'<robot name="two"><link name="base"/>{ARM.format("hinge", 0)}{ARM.format("other", 1)}</robot>'
ROBOT = """robot: two
description: two.urdf
groups: {all: {joints: [hinge, other]}}
poses: {zero: {all: [0, 0]}, up: {all: [1.2, 0]}}
limits: {hinge: {acceleration: 10}, other: {acceleration: 10}}
"""
Found = Callable[..., tuple[Diagnostic, ...]]
BOUND = 2.0 * (0.02 + 1.0 * 0.25**2) / 1e-3
"""[N m s/rad] 2 I / h."""
PLACED = "  a: {type: joint_trajectory, joints: [hinge], command_interface: position}\n"
HELD = "  b: {type: joint_trajectory, joints: [hinge], command_interface: effort, active: false, MORE}\n"
OTHER = "  c: {type: joint_trajectory, joints: [other], command_interface: effort, gains: {other: {p: 10, d: 200}}}\n"


@pytest.fixture
def found(tmp_path: Path) -> Found:
    def of(*controllers: str, steps: str) -> tuple[Diagnostic, ...]:
        (tmp_path / "two.urdf").write_text(URDF)
        (tmp_path / "robot.yaml").write_text(ROBOT)
        (tmp_path / "c.yaml").write_text("controllers:\n" + "".join(controllers))
        (tmp_path / "task.yaml").write_text(
            f"task: t\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: zero\nsteps: [{steps}]\n"
        )
        return preflight_findings(load_task(tmp_path / "task.yaml"))

    return of


UP, DOWN = "move: {to: {hinge: 1.2}}", "move: {to: {hinge: 0}}"
TO_A, TO_B = "switch_controllers: a", "switch_controllers: b"


def test_gains_of_a_controller_that_a_step_switches_on_are_looked_at(found: Found) -> None:
    wild = HELD.replace("MORE", "gravity_compensation: true, gains: {hinge: {p: 10, d: 200}}")
    assert found(PLACED, wild, steps=f"{{{UP}}}") == ()
    (one,) = found(PLACED, wild, steps=f"{{{UP}}}, {{{TO_B}}}, {{{DOWN}}}, {{{TO_A}}}, {{{UP}}}, {{{TO_B}}}")
    assert (one.code, one.severity) == ("CTRL150", "warning")
    assert one.message.startswith(f"hinge: d 200 is unstable, the limit is {BOUND:.3g}")
    assert one.place is not None
    assert (Path(one.place.file).name, one.place.line) == ("c.yaml", 3)


def test_they_are_looked_at_where_the_robot_is_while_it_is_active(found: Found) -> None:
    """Hanging there is no weight to hold; lifted by 1.2 rad there is."""
    soft = HELD.replace("MORE", "gains: {hinge: {p: 20, d: 2}}, constraints: {joints: {hinge: {goal: 0.03}}}")
    there_and_back = f"{{{UP}}}, {{{DOWN}}}"
    assert found(PLACED, soft, steps=f"{there_and_back}, {{{TO_B}}}") == ()
    assert found(PLACED, soft, steps=f"{{{TO_B}}}, {{{TO_A}}}, {there_and_back}") == ()
    (one,) = found(PLACED, soft, steps=f"{{{UP}}}, {{{TO_B}}}, {{{TO_A}}}, {{{DOWN}}}")
    assert one.code == "CTRL156"
    assert "hinge: p 20 sags 0.11 rad under its gravity load of 2.29 N m" in one.message


def test_who_stays_while_others_change_is_told_once(found: Found) -> None:
    soft = HELD.replace("MORE", "gravity_compensation: true, gains: {hinge: {p: 20, d: 2}}")
    (one,) = found(PLACED, soft, OTHER, steps=f"{{{UP}}}, {{{TO_B}}}, {{{DOWN}}}")
    assert (one.code, one.message.partition(":")[0]) == ("CTRL150", "other")


def test_motors_of_a_controller_that_a_step_switches_on_are_looked_at(found: Found) -> None:
    fast = "  a: {type: joint_trajectory, joints: [hinge], command_interface: velocity, active: false, GAINS}\n"
    fast = fast.replace("GAINS", "gains: {hinge: {p: 2100}}")
    calm = HELD.replace("MORE", "gravity_compensation: true, gains: {hinge: {p: 20, d: 2}}").replace("false", "true")
    assert found(fast, calm, steps=f"{{{UP}}}") == ()
    (one,) = found(fast, calm, steps=f"{{{UP}}}, {{{TO_A}}}, {{{DOWN}}}")
    assert (one.code, one.severity) == ("CTRL157", "warning")


def test_a_pid_controller_is_examined_where_its_derivative_is_that_of_measured_velocities(found: Found) -> None:
    pid = (
        "  a: {type: pid, joints: [hinge], gravity_compensation: true, GAINS, reference_and_state_interfaces: [LED]}\n"
    )
    wild = pid.replace("GAINS", "gains: {hinge: {p: 10, d: 200}}")
    (one,) = found(wild.replace("LED", "position, velocity"), steps="{wait: 1 s}")
    assert (one.code, one.message.partition(":")[0]) == ("CTRL150", "hinge")
    assert found(wild.replace("LED", "position"), steps="{wait: 1 s}") == ()
    calm = pid.replace("GAINS", "gains: {hinge: {p: 10, d: 2}}")
    assert found(calm.replace("LED", "position, velocity"), steps="{wait: 1 s}") == ()


def test_the_effort_limit_is_examined_whatever_the_type_of_the_controller_is(found: Found, tmp_path: Path) -> None:
    passed_on = "  a: {type: forward_command, joints: [hinge], command_interface: effort}\n"
    assert found(passed_on, steps="{wait: 1 s}") == ()
    weak = ROBOT.replace("hinge: {acceleration: 10}", "hinge: {acceleration: 10, effort: 1}")
    (tmp_path / "weak.yaml").write_text(weak)
    task = load_task(tmp_path / "task.yaml", overrides=["robot=weak.yaml", "start=up"])
    (one,) = preflight_findings(task)
    assert (one.code, one.severity) == ("CTRL155", "warning")
    assert one.message.startswith("hinge: gravity needs up to 2.29 N m, its effort limit is 1 N m")
