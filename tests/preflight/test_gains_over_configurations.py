"""Two links in a plane: a loop is looked at with the least and the most inertia that the planned postures give it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic
from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task

LINK = """<link name="{0}"><inertial><origin xyz="{1} 0 0"/><mass value="{2}"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
HINGE = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3} 0 0"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="200"/></joint>"""
L, C, M_1, M_2 = 0.4, 0.3, 1.0, 2.0
"""[m] from joint to joint and from the elbow to the centre of the forearm, [kg]; the upper arm's centre is at L / 2."""
BENT = 2.6
CONTROLLER = """controllers:
  c: {type: joint_trajectory, joints: [shoulder, elbow], command_interface: effort,
      gains: {shoulder: {GAINS}, elbow: {p: 40, d: 4}}}
"""
Found = Callable[[str], tuple[Diagnostic, ...]]


def masses(elbow: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """m_11, m_12, m_22 of a planar arm (Murray, Li, Sastry, A Mathematical Introduction, 4.2.3) [kg m2]."""
    last, both = 0.01 + M_2 * C**2, M_2 * L * C * np.cos(elbow)
    return 0.01 + M_1 * (L / 2) ** 2 + last + M_2 * L**2 + 2.0 * both, last + both, last + 0.0 * elbow


@pytest.fixture
def found(tmp_path: Path) -> Found:
    def of(gains: str) -> tuple[Diagnostic, ...]:
        links = '<link name="base"/>' + LINK.format("upper", L / 2, M_1) + LINK.format("fore", C, M_2)
        hinges = HINGE.format("shoulder", "base", "upper", 0) + HINGE.format("elbow", "upper", "fore", L)
        (tmp_path / "two.urdf").write_text(f'<robot name="two">{links}{hinges}</robot>')
        (tmp_path / "robot.yaml").write_text(
            "robot: two\ndescription: two.urdf\ngroups: {all: {joints: [shoulder, elbow]}}\n"
            "poses: {straight: {all: [0, 0]}}\nlimits: {shoulder: {acceleration: 10}, elbow: {acceleration: 10}}\n"
        )
        (tmp_path / "c.yaml").write_text(CONTROLLER.replace("GAINS", gains))
        (tmp_path / "task.yaml").write_text(
            "task: t\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: straight\n"
            f"steps: [{{move: {{to: {{elbow: {BENT}}}}}}}]\n"
        )
        return preflight_findings(load_task(tmp_path / "task.yaml"))

    return of


def test_damping_is_bounded_by_the_least_inertia_that_the_joint_moves_alone(found: Found) -> None:
    """1 / (M^-1)_11 = m_11 - m_12^2 / m_22: the elbow gives way."""
    one, other, two = masses(np.linspace(0.0, BENT, 500))
    least = float((one - other**2 / two).min())
    (finding,) = found("p: 40, d: 400")
    told = re.match(
        r"shoulder: d 400 is unstable, the limit is ([\d.]+) at 1 ms; least inertia ([\d.]+) kg m2", finding.message
    )
    assert told is not None, finding.message
    assert float(told[1]) == pytest.approx(2.0 * least / 1e-3, rel=0.02)
    assert float(told[2]) == pytest.approx(least, rel=0.05)


def test_swinging_is_that_of_the_most_inertia_while_the_others_hold(found: Found) -> None:
    """m_11 of the straight arm: w = sqrt(p / m), the damping ratio d / (2 sqrt(p m))."""
    most = float(masses(np.zeros(1))[0][0])
    (finding,) = found("p: 40, d: 1")
    told = re.match(
        r"shoulder: .* oscillates at ([\d.]+) Hz, damping ratio ([\d.]+); largest inertia ([\d.]+)", finding.message
    )
    assert told is not None, finding.message
    measured = [float(one) for one in told.groups()]
    expected = [np.sqrt(40.0 / most) / (2.0 * np.pi), 0.5 / np.sqrt(40.0 * most), most]
    assert measured == pytest.approx(expected, rel=0.05)
