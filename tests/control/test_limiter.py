"""The limiter against the pure functions, tick by tick, in every mode; what it counts, and what it refuses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.control import JointLimiter, NotFinite, limit_effort, limit_position, limit_velocity
from manipcli.control.command import JointCommand
from manipcli.control.limiter import SLACK
from manipcli.control.saturation import EFFORT, KINDS
from manipcli.core.errors import InvalidArgument
from manipcli.description.elements import JointLimits, SoftLimits

HARD = {"lower": -1.0, "upper": 1.0}
SOFT = SoftLimits(-0.8, 0.8, 20.0, 5.0)
DT = 0.01


def soft_arguments(soft, *, effort=False):
    if soft is None:
        return {}
    law = {"soft_lower": soft.lower, "soft_upper": soft.upper, "k_position": soft.k_position}
    return {**law, "k_velocity": soft.k_velocity} if effort else law


@pytest.mark.parametrize("soft", [None, SOFT])
@pytest.mark.parametrize("scale", [0.02, 1.0])
def test_it_is_the_pure_functions_and_counts_what_they_cut(soft, scale):
    """Near zero no effort is cut, else some of all are: the short way must notice all that is."""
    rng = np.random.default_rng(0)
    limits = [JointLimits(-1, 1, 2, 10, 5, None, soft)] * 4
    limiter = JointLimiter(limits)
    command = JointCommand(4)
    command.obey(["effort", "velocity", "position", "free"])
    counts = np.zeros(4, dtype=int)
    speed, last, step = None, None, 0.0
    for _ in range(300):
        q, v = scale * rng.normal(size=4), 2 * scale * rng.normal(size=4)
        wanted = scale * rng.normal(size=3) * [10, 3, 1]
        command.effort[0], command.velocity[1], command.position[2] = wanted
        expected = np.array([
            limit_effort(
                wanted[0], effort=10, position=q[0], velocity=v[0], max_velocity=2, **HARD,
                **soft_arguments(soft, effort=True),
            ),
            limit_velocity(
                wanted[1], velocity=2, dt=DT, position=q[1], acceleration=5, beyond="return", **HARD,
                previous=v[1] if speed is None else speed, **soft_arguments(soft),
            ),
            limit_position(
                wanted[2], velocity=2 * (1 + SLACK), acceleration=5 * (1 + SLACK), measured_velocity=step / DT, dt=DT,
                previous=q[2] if last is None else last, **HARD, **soft_arguments(soft),
            ),
        ])  # fmt: skip
        limiter.apply(command, q, v, DT)
        got = np.array([command.effort[0], command.velocity[1], command.position[2]])
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12)
        step = expected[2] - (q[2] if last is None else last)
        speed, last = expected[1], expected[2]
        cut = np.append(got != wanted, False)
        np.testing.assert_array_equal(limiter.saturated, cut)
        counts += cut
    np.testing.assert_array_equal(limiter.saturations, counts)
    assert (counts[0] > 0) == (scale == 1.0)
    assert (counts[:3] < 300).all()  # both ways were taken
    assert (counts[1:3] > 0).all()
    limiter.reset()
    assert not limiter.saturations.any()


def test_what_nobody_commands_passes_through():
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 10)] * 2), JointCommand(2)
    for modes in (["brake", "free"], ["free", "brake"]):
        command.obey(modes)
        command.effort[:] = 99.0
        limiter.apply(command, np.array([5.0, 5.0]), np.array([9.0, 9.0]), 0.001)
        assert command.effort.tolist() == [99.0, 99.0]
    assert not limiter.saturations.any()


def test_ticks_in_which_the_effort_was_too_much_are_counted_apart():
    """More than 10 N m; then less, on a joint that is as fast as it may be; then both."""
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 10)]), JointCommand(1)
    command.obey(["effort"])
    for effort, speed, counts in ((30.0, 0.0, (1, 1)), (5.0, 3.0, (2, 1)), (-30.0, 0.0, (3, 2)), (5.0, 0.0, (3, 2))):
        command.effort[:] = effort
        limiter.apply(command, np.zeros(1), np.array([speed]), 0.001)
        assert (limiter.saturations[0], limiter.by_kind[EFFORT, 0]) == counts
    limiter.reset()
    assert not limiter.by_kind.any()


@pytest.mark.parametrize(
    ("mode", "wanted", "kinds"),
    [
        ("effort", (30.0, 0.0, 0.0), {"effort"}),
        ("effort", (5.0, 1.0, 0.0), {"position"}),
        ("effort", (-5.0, 1.0, 0.0), set()),
        ("effort", (-30.0, 1.0, 3.0), {"effort"}),
        ("effort", (5.0, 0.0, 3.0), {"velocity"}),
        ("effort", (5.0, 0.9, 0.0), {"soft_limit"}),
        ("velocity", (2.1, 0.0, 2.08), {"velocity"}),
        ("velocity", (1.0, 0.0, 0.0), {"acceleration"}),
        ("velocity", (1.9, 0.999, 1.9), {"position"}),
        ("velocity", (1.0, 0.79, 1.0), {"soft_limit"}),
        ("position", (0.021, 0.0, 0.0), {"velocity", "acceleration"}),
        ("position", (0.015, 0.0, 0.0), {"acceleration"}),
        ("position", (1.00001, 1.0, 0.0), {"position"}),
    ],
)
def test_a_cut_names_the_limits_that_it_was(mode, wanted, kinds):
    """Limits of 1 rad, 2 rad/s, 10 N m and 5 rad/s2, in a period of 10 ms: 20 mrad, or 0.5 mrad from rest; a soft one
    at 0.8 rad that leaves no velocity there, where one is told."""
    soft = SoftLimits(-0.8, 0.8, 20.0, 5.0) if "soft_limit" in kinds else None
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 10, 5, None, soft)] * 2), JointCommand(2)
    command.obey([mode, "free"])
    value, q, v = wanted
    getattr(command, mode)[0] = value
    limiter.apply(command, np.array([q, 0.0]), np.array([v, 0.0]), DT)
    assert {kind for kind, counts in zip(KINDS, limiter.by_kind, strict=True) if counts[0]} == kinds
    assert limiter.saturations.tolist() == [int(bool(kinds)), 0]
    assert not limiter.by_kind[:, 1].any()


def test_what_goes_with_a_position_is_limited_too():
    """position + velocity + acceleration, and position + effort."""
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 10, 5)]), JointCommand(1)
    command.obey(["position"])
    command.velocity[:], command.acceleration[:], command.effort[:] = 7.0, -70.0, -30.0
    limiter.apply(command, np.zeros(1), np.zeros(1), 0.001)
    assert command.velocity[0] == pytest.approx(2.0 * (1 + SLACK))
    assert command.acceleration[0] == pytest.approx(-5.0 * (1 + SLACK))
    assert command.effort[0] == -10.0
    assert limiter.saturations.tolist() == [1]


def test_a_position_planned_to_the_limits_goes_through_as_it_is():
    """Rest to rest in a parabola of exactly the greatest acceleration, to exactly the position limit."""
    a, dt = 4.0, 0.001
    t = np.arange(1001) * dt
    q = np.where(t < 0.5, 0.5 * a * t**2, 1.0 - 0.5 * a * (1.0 - t) ** 2)
    limiter, command = JointLimiter([JointLimits(-1.0, 1.0, 2.0, 10.0, a)]), JointCommand(1)
    command.obey(["position"])
    for value in q:
        command.position[0] = value
        limiter.apply(command, np.zeros(1), np.zeros(1), dt)
        assert command.position[0] == value
    assert limiter.saturations[0] == 0


@pytest.mark.parametrize("acceleration", [None, 1e4])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_velocity_within_all_its_limits_stops_at_those_of_the_position(acceleration, way):
    """0.1 m before the limit at 1 m/s: there after 100 ticks of 1 ms, and there to stay."""
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 10, acceleration)]), JointCommand(1)
    command.obey(["velocity"])
    q, v = np.array([0.9 * way]), np.array([way])
    for tick in range(400):
        command.velocity[:] = way
        limiter.apply(command, q, v, 0.001)
        v = command.velocity.copy()
        q = q + 0.001 * v
        assert way * q[0] <= 1.0 + 1e-12
        assert v[0] == way or tick >= 99
    assert q[0] == pytest.approx(way)
    assert 299 <= limiter.saturations[0] <= 301


@given(st.floats(-1.0, 1.0), st.floats(-100.0, 100.0))
def test_no_velocity_leads_beyond_a_position_limit_within_a_tick(q, velocity):
    """By closed form: it is cut to what is left of the way, and to nothing else."""
    limiter, command = JointLimiter([JointLimits(-1.0, 1.0)]), JointCommand(1)
    command.obey(["velocity"])
    command.velocity[:] = velocity
    limiter.apply(command, np.array([q]), np.zeros(1), DT)
    assert command.velocity[0] == pytest.approx(min(max(velocity, (-1.0 - q) / DT), (1.0 - q) / DT), abs=1e-9)


@pytest.mark.parametrize("mode", ["velocity", "position"])
def test_after_a_reset_a_command_is_limited_as_by_a_new_limiter(mode):
    """From what is measured, and from nothing that was commanded before."""
    limits = [JointLimits(-1, 1, 2, 10, 5)]
    used, new, command = JointLimiter(limits), JointLimiter(limits), JointCommand(1)
    command.obey([mode])
    for _ in range(20):
        getattr(command, mode)[:] = 0.9
        used.apply(command, np.zeros(1), np.zeros(1), DT)
    assert used.saturations[0] > 0
    used.reset()
    told = []
    for limiter in (used, new):
        getattr(command, mode)[:] = -0.9
        limiter.apply(command, np.full(1, -0.2), np.zeros(1), DT)
        told.append((getattr(command, mode)[0], limiter.saturations[0], limiter.saturated[0]))
    assert told[0] == told[1]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("mode", ["effort", "velocity", "position"])
def test_a_command_that_is_no_finite_number_names_its_joint(mode, bad):
    """Also of a joint without any limit."""
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 10), JointLimits()], ["elbow", "wrist"]), JointCommand(2)
    command.obey([mode, mode])
    limiter.apply(command, np.zeros(2), np.zeros(2), 0.001)
    getattr(command, mode)[1] = bad
    with pytest.raises(NotFinite, match=f"joint 'wrist': the {mode} command is {bad}"):
        limiter.apply(command, np.zeros(2), np.zeros(2), 0.001)


def test_a_measurement_that_is_no_finite_number_names_its_joint():
    limiter, command = JointLimiter([JointLimits()] * 2, ["elbow", "wrist"]), JointCommand(2)
    command.obey(["effort", "free"])
    with pytest.raises(NotFinite, match="joint 'wrist': the measured velocity is nan"):
        limiter.apply(command, np.zeros(2), np.array([0.0, math.nan]), 0.001)


def test_efforts_and_soft_limits_stop_a_thrown_joint_before_its_hard_limit():
    """A unit mass on its way out with a full push: the effort law turns it round inside of the hard limit."""
    limiter, command = JointLimiter([JointLimits(-1, 1, 2, 50, None, None, SoftLimits(-0.8, 0.8, 20, 40))]), None
    command = JointCommand(1)
    command.obey(["effort"])
    q, v = np.zeros(1), np.full(1, 1.9)
    highest = 0.0
    for _ in range(2000):
        command.effort[:] = 50.0
        limiter.apply(command, q, v, 0.001)
        v = v + 0.001 * command.effort
        q = q + 0.001 * v
        highest = max(highest, float(q[0]))
    assert highest < 0.85
    assert q[0] == pytest.approx(0.8, abs=1e-3)


@pytest.mark.parametrize("beside", [0, 1])
@given(st.sampled_from([0.3, 1.0, 3.0]), st.floats(-0.99, 0.99), st.floats(-1.0, 1.0), st.sampled_from([-1.0, 1.0]))
def test_an_effort_is_cut_just_above_what_the_velocity_leaves_of_it(beside, fastest, share, beyond, way):
    """kv (v_max - v) in the direction of v_max; and nothing of a joint beside it that has no such law."""
    kv, v, n = 5.0, share * fastest, 1 + beside
    limits = [JointLimits(None, None, fastest, 100, soft=SoftLimits(k_velocity=kv)), JointLimits()][:n]
    limiter, command = JointLimiter(limits), JointCommand(n)
    command.obey(["effort"] * n)
    most = kv * (fastest - v)
    command.effort[:] = wanted = way * (most + beyond)
    limiter.apply(command, np.zeros(n), np.full(n, way * v), DT)
    assert command.effort == pytest.approx([way * (most + min(beyond, 0.0)), wanted][:n], abs=1e-12)
    assert limiter.saturations.tolist() == (command.effort != wanted).tolist()


@pytest.mark.parametrize(
    "limits",
    [JointLimits(1, -1), JointLimits(velocity=-2), JointLimits(effort=math.nan), JointLimits(lower=math.nan, upper=1)],
)
def test_limits_that_nothing_keeps_are_refused_before_any_tick(limits):
    with pytest.raises(InvalidArgument, match=r"CTRL194"):
        JointLimiter([JointLimits(), limits])
