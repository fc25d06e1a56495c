"""The reflex of a hand against ideal pads: each measures the force that the fingers press with, late, and its share of
the load."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.control.action import GripperGoal
from manipcli.control.controller import JointState
from manipcli.control.grip_reflex import RATE, GripReflex, Pad
from manipcli.control.gripper_controller import GripperController
from manipcli.core.geometry import Array, Transform, frozen, matrix_from_rpy
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import Reflex
from manipcli.spec.controllers import GainsSpec

PERIOD = 1e-3
MU, ONSET, FORCE = 0.5, 0.8, 4.0
JOINTS = ("left", "right")
TURNS = (np.pi / 2.0, -np.pi / 2.0)
EFFORT = np.array([30.0, 30.0])


def robot() -> RobotModel:
    """Two plates that slide along x towards each other."""
    sides, limits = (("left", 1.0), ("right", -1.0)), JointLimits(-1.0, 1.0, 1.0, 30.0)
    joints = tuple(
        Joint(name, "prismatic", "base", name, Transform.identity(), frozen((side, 0.0, 0.0)), limits)
        for name, side in sides
    )
    links = tuple(Link(name, None, (), ()) for name in ("base", *JOINTS))
    return RobotModel("vice", "base", links, joints, (), (), (), Transform.identity(), "")


def pads() -> list[Pad]:
    """One cell each, at +-90 deg about y."""
    return [Pad(name, matrix_from_rpy((0.0, turn, 0.0)), np.zeros(3)) for name, turn in zip(JOINTS, TURNS, strict=True)]


def load(pad: Pad, normal: float, down: float, strain: float = 0.0) -> None:
    """Forces on a pad: along its normal, down in the world, and along y."""
    pad.reading[:] = normal, pad.R_LS[2, 0] * -down, strain


class Held:
    """An object between the two plates, and what the pads measure `delay` ticks later."""

    def __init__(self, reflex: Reflex, delay: int = 20) -> None:
        self.pads, self.delay = pads(), delay
        self.reflex = GripReflex(2)
        self.reflex.attach(robot(), JOINTS, self.pads)
        self.reflex.begin(reflex, FORCE)
        self.effort = np.full(2, FORCE)
        self.coming = deque[tuple[float, float]]()
        self.forces: list[float] = []

    def hold(self, ticks: int, weight: float, strain: float = 0.0) -> bool:
        fed = False
        for _ in range(ticks):
            self.coming.append((float(self.effort[0]), weight / 2.0))
            if len(self.coming) > self.delay:
                normal, down = self.coming.popleft()
                load(self.pads[0], normal, down, strain)
                load(self.pads[1], normal, down, -strain)
            fed = self.reflex.update(PERIOD, np.zeros(2), self.effort, EFFORT)
            self.effort = FORCE + self.reflex.extra
            self.forces.append(self.reflex.force)
        return fed


def test_it_presses_until_the_share_is_the_onset_and_never_less() -> None:
    """N = m g / (mu onset); the overshoot is what the gain adds within the delay of 20 ms."""
    held = Held(Reflex(MU, ONSET))
    weight = 8.0
    held.hold(1000, weight)
    wanted = weight / (2.0 * MU * ONSET)
    assert wanted <= held.reflex.force * 1.001 < wanted * 1.12
    assert (np.diff(held.forces) >= 0.0).all()
    assert np.diff(held.forces).max() <= RATE * PERIOD * (1.0 + 1e-9)
    np.testing.assert_allclose(held.effort, held.reflex.force)
    before = held.reflex.force
    held.hold(500, 0.1)
    assert held.reflex.force == before  # no release
    assert held.reflex.report() == f"reflex: 4 N to {before:.3g} N"
    assert held.reflex.report() == ""


@pytest.mark.parametrize(
    ("limit", "most", "why"), [(7.0, 7.0, "its limit"), (None, 30.0, "the effort limit of the hand")]
)
def test_it_stops_at_the_limit(limit: float | None, most: float, why: str) -> None:
    held = Held(Reflex(MU, ONSET, limit))
    held.hold(1000, 500.0)
    assert held.reflex.force == pytest.approx(most)
    assert (held.effort <= most + 1e-9).all()
    assert held.reflex.report() == f"reflex: 4 N to {most:.3g} N, {why}"


readings = st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6)


@settings(max_examples=40)
@given(st.lists(readings, min_size=1, max_size=20))
def test_whatever_is_measured_it_keeps_its_limit_and_its_rate(measured: list[list[float]]) -> None:
    held = Held(Reflex(MU, ONSET, 7.0))
    for values in measured:
        for pad, numbers in zip(held.pads, (values[:3], values[3:]), strict=True):
            pad.reading[:] = numbers
        before = held.reflex.extra.copy()
        held.reflex.update(PERIOD, np.zeros(2), np.full(2, FORCE), EFFORT)
        assert (before <= held.reflex.extra).all()
        assert (held.reflex.extra <= before + RATE * PERIOD + 1e-9).all()
        assert (FORCE + held.reflex.extra <= 7.0 + 1e-9).all()


def test_internal_forces_and_untouched_pads_do_not_press() -> None:
    """Fingers that strain the object against each other use their cones, but not together; noise is no object."""
    held = Held(Reflex(MU, ONSET))
    assert not held.hold(200, 1.0, strain=1.9)
    held.reflex.begin(Reflex(MU, ONSET), FORCE)
    for pad in held.pads:
        load(pad, 0.1, 0.3)
    assert not held.reflex.update(PERIOD, np.zeros(2), held.effort, EFFORT)
    assert not held.reflex.extra.any()


def commands(reflex: Reflex | None, weight: float) -> list[bytes]:
    """What a gripper commands that closes on a spring of 20 kN/m at 1 cm, and then holds it for 0.3 s."""
    gains = {name: GainsSpec(p=2000.0, d=20.0) for name in JOINTS}
    hand = GripperController(
        name="hand", joints=JOINTS, types=["prismatic"] * 2, gains=gains, speed=0.1, max_effort=30.0
    )
    felt = pads()
    hand.reflex.attach(robot(), JOINTS, felt)
    hand.send_goal(GripperGoal(target=np.full(2, 0.02), force=FORCE, reflex=reflex))
    q, v = np.zeros(2), np.zeros(2)
    found = []
    for k in range(600):
        force: Array = np.maximum(q - 0.01, 0.0) * 2e4
        for pad, pressed in zip(felt, force, strict=True):
            load(pad, float(pressed), weight / 2.0 if k > 300 else 0.0)
        output = hand.update(k * PERIOD, PERIOD, JointState(q, v, np.zeros(2)), contact_force=force)
        found.append(output.rows.tobytes())
        v = v + PERIOD * (output.command - force - 60.0 * v * (force > 0.0)) / 0.2
        q = q + PERIOD * v
    return found


def test_without_slip_the_commands_are_those_without_a_reflex() -> None:
    assert commands(Reflex(MU, ONSET), 2.0) == commands(None, 2.0) == commands(None, 50.0)
    assert commands(Reflex(MU, ONSET), 8.0)[-1] != commands(None, 8.0)[-1]


def test_the_next_goal_ends_it() -> None:
    held = Held(Reflex(MU, ONSET))
    held.hold(300, 8.0)
    assert held.reflex.extra.all()
    held.reflex.begin(None, None)
    assert not held.reflex.extra.any()
    assert not held.reflex.update(PERIOD, np.zeros(2), held.effort, EFFORT)
    assert held.reflex.report() == ""
