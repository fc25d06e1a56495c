"""How a trajectory controller comes to rest: laws over random states."""

import numpy as np
import pytest

from manipcli.control.active_trajectory import POSITION, VELOCITY, ActiveTrajectory, Part, Reference
from manipcli.control.trajectory_goal import JointFacts
from manipcli.control.transitions import Transitions
from manipcli.description.elements import JointLimits
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, JointConstraintSpec

PERIOD = 0.001
NAMES = ("a", "b", "c")


def transitions(limits, *, constraints=None, stop_duration=0.0):
    facts = JointFacts.of(NAMES[: len(limits)], limits, None)
    deceleration, together = Transitions.decelerations(facts, constraints or ConstraintsSpec())
    return Transitions(facts, True, True, False, "splines", stop_duration, deceleration, together)


def moving(position, velocity):
    """A reference that is there now."""
    still = np.zeros(len(position))
    on = JointTrajectory.of_arrays(NAMES[: len(position)], [0.0, 1.0], [position, position], [velocity, still])
    active = ActiveTrajectory.hold(np.array(position)).with_part(Part(slice(None), on, 0.0))
    reference = Reference(np.zeros((3, len(position))), ("position",))
    reference.follow(active, active.ticks(PERIOD), time=0.0, period=PERIOD)
    return reference


def stop(made, position, velocity):
    """(T, 4, n) of the ticks until all rests."""
    samples = made.to_rest(moving(position, velocity), 0.0).ticks(PERIOD)
    assert samples[0, POSITION] == pytest.approx(np.array(position))
    assert not samples[-1, VELOCITY].any()
    return samples


def random_limits(rng):
    return [
        JointLimits(lower=-1.0, upper=1.0, velocity=4.0, acceleration=float(a)) for a in 10.0 ** rng.uniform(0, 1.5, 3)
    ]


def test_a_joint_that_can_stop_inside_its_limits_alone_does():
    """From q0 it needs v^2 / (2 a): it never leaves its limits, nor brakes harder than it may; common where inside."""
    rng = np.random.default_rng(4)
    common = alone = 0
    for _ in range(150):
        limits = random_limits(rng)
        acceleration = np.array([limit.acceleration for limit in limits])
        position = rng.uniform(-1, 1, 3)
        room = 1.0 - position
        velocity = np.sqrt(2.0 * acceleration * room) * rng.uniform(0, 1, 3)
        mirror = np.sign(rng.uniform(-1, 1, 3))
        position, velocity = mirror * position, mirror * velocity
        samples = stop(transitions(limits), position, velocity)
        assert np.abs(samples[:, POSITION]).max() <= 1.0 + 1e-6
        assert (np.abs(np.diff(samples[:, VELOCITY], axis=0)) <= acceleration * PERIOD * (1 + 1e-6)).all()
        slowest = (np.abs(velocity) / acceleration).max()
        end = position + 0.5 * velocity * slowest
        if np.abs(end).max() <= 1.0:
            assert samples[-1, POSITION] == pytest.approx(end)
            common += 1
        else:
            assert samples[-1, POSITION] == pytest.approx(position + 0.5 * velocity * np.abs(velocity) / acceleration)
            alone += 1
    assert min(common, alone) > 20


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("duration", [0.0, 0.3])
def test_no_stop_leaves_the_limits_whatever_the_deceleration(duration, own):
    """Where a joint may not brake as hard as the limit is near, it stops at the limit."""
    rng = np.random.default_rng(5)
    constraints = ConstraintsSpec(joints={"a": JointConstraintSpec(max_deceleration_on_cancel=0.5)} if own else {})
    for _ in range(50):
        position, velocity = rng.uniform(-1, 1, 3), rng.uniform(-4, 4, 3)
        made = transitions(random_limits(rng), constraints=constraints, stop_duration=duration)
        assert np.abs(stop(made, position, velocity)[:, POSITION]).max() <= 1.0 + 1e-6


def test_a_joint_beyond_its_limit_comes_back_but_goes_no_farther():
    limits = [JointLimits(lower=-1.0, upper=1.0, acceleration=1.0)] * 3
    samples = stop(transitions(limits), [1.2, 1.2, 0.0], [0.4, -0.4, 0.4])
    assert samples[:, POSITION, 0].max() == pytest.approx(1.2)
    assert samples[-1, POSITION] == pytest.approx([1.2, 1.2 - 0.08, 0.08])


def test_a_joint_without_limits_needs_none():
    samples = stop(transitions([JointLimits(acceleration=2.0), JointLimits(acceleration=1.0)]), [5.0, 0.0], [2.0, 2.0])
    assert samples[-1, POSITION] == pytest.approx([7.0, 2.0])


def test_where_one_joint_says_a_deceleration_each_stops_by_its_own():
    """v^2 / (2 a): of the others, a is their limit."""
    constraints = ConstraintsSpec(joints={"a": JointConstraintSpec(max_deceleration_on_cancel=0.5)})
    made = transitions([JointLimits(acceleration=4.0)] * 3, constraints=constraints)
    rates = np.array([1.0, -2.0, 1.0])
    samples = stop(made, [0.0, 0.0, 0.0], rates)
    assert samples[-1, POSITION] == pytest.approx(rates * np.abs(rates) / (2 * np.array([0.5, 4.0, 4.0])))
