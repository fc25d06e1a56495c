"""What is recorded of a force is never far from it for long."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.model.state import Contact, ContactPoint
from manipcli.record.write.contact_filter import ContactFilter

TICK = 0.001


def recorded(forces: list[float]) -> list[float]:
    """What is known of a force at every tick from what was recorded until then."""
    kept, known, filtered = 0.0, [], ContactFilter()
    for k, force in enumerate(forces):
        changed = filtered.changed(k * TICK, [Contact("cup", "desk", force, 0.0)])
        if changed is not None:
            kept = changed[0].force
        known.append(kept)
    return known


def test_pairs_are_followed_at_once_and_forces_at_their_pace() -> None:
    def touch(force: float, distance: float = 0.0) -> list[Contact]:
        return [Contact("a", "b", force, distance)]

    contacts = ContactFilter()
    assert contacts.changed(0.0, []) == [], "that nothing touches is said once, too"
    assert contacts.changed(0.0, []) is None
    assert contacts.changed(0.001, touch(1.0)) == touch(1.0)
    assert contacts.changed(0.002, touch(1.4)) is None, "a force alone waits"
    assert contacts.changed(0.003, touch(1.0, -0.001)) == touch(1.0, -0.001), "a deeper contact does not"
    assert contacts.changed(0.012, touch(1.4)) is None
    assert contacts.changed(0.013, touch(1.4)) == touch(1.4)
    assert contacts.changed(0.014, touch(9.0)) == touch(9.0), "nor does a knock"
    assert contacts.changed(0.015, touch(1.4)) == touch(1.4), "nor its end"
    assert contacts.changed(0.030, touch(1.41)) is None, "nearly the same force"
    two = [*touch(1.4), Contact("b", "c", 1.0, 0.0)]
    assert contacts.changed(0.031, two) == two
    assert contacts.changed(0.032, []) == []
    assert contacts.changed(0.033, []) is None


@pytest.mark.parametrize(
    ("after", "was", "least"),
    [
        (1, 10.0, 6.0),  # a knock: half of it and 1 N
        (1, 0.0, 1.0),
        (10, 10.0, 1.05),  # a tenth and 0.05 N
        (10, 0.1, 0.06),
        (100, 10.0, 0.105),  # a hundredth and 0.005 N
        (100, 0.1, 0.006),
    ],
)
def test_by_how_much_a_force_must_differ(after: int, was: float, least: float) -> None:
    for factor, written in ((0.98, False), (1.02, True)):
        filtered = ContactFilter()
        filtered.changed(0.0, [Contact("a", "b", was, 0.0)])
        told = filtered.changed(after * TICK, [Contact("a", "b", was + factor * least, 0.0)])
        assert (told is not None) is written


def test_by_how_much_a_contact_must_be_deeper() -> None:
    for depth, written in ((1.9e-4, False), (2.1e-4, True)):
        filtered = ContactFilter()
        filtered.changed(0.0, [Contact("a", "b", 1.0, 0.001)])
        assert (filtered.changed(TICK, [Contact("a", "b", 1.0, 0.001 - depth)]) is not None) is written
        assert filtered.changed(2 * TICK, [Contact("a", "b", 1.0, 0.01)]) is None, "it leaves"


@pytest.mark.parametrize("change", [0.05, -0.05, 0.09, -0.03])
def test_a_force_that_changes_a_little_and_stays_is_known_within_a_tenth_of_a_second(change: float) -> None:
    forces = [1.4715] * 40 + [1.4715 * (1 + change)] * 200
    known = recorded(forces)
    assert known[-1] == forces[-1]
    late = [abs(a - b) for a, b in zip(known, forces, strict=True)][141:]
    assert max(late) <= 0.01 * forces[-1] + 0.005


def test_a_knock_is_not_remembered_longer_than_it_was() -> None:
    """A tick of 100 N: what is known gives the same impulse, within what a small force may differ."""
    forces = [2.0] * 5 + [100.0] + [2.5] * 50
    assert sum(recorded(forces)) * TICK == pytest.approx(sum(forces) * TICK, abs=50 * 0.25 * TICK)


def test_a_force_that_wanders_is_known_to_a_tenth_and_seldom_written() -> None:
    generator = np.random.default_rng(1)
    forces = (10.0 + np.cumsum(generator.normal(0.0, 0.01, 3000))).tolist()
    known = recorded(forces)
    # Beyond a tenth and 0.05 N it is written at the next hundredth of a second.
    late = [abs(a - b) - 0.1 * a - 0.05 for a, b in zip(known, forces, strict=True)]
    assert max(late) < 0.2
    assert len(set(known)) <= 3000 / 10


def test_another_pair_of_the_same_force_is_another_contact() -> None:
    filtered = ContactFilter()
    filtered.changed(0.0, [Contact("a", "b", 1.0, 0.0)])
    other = [Contact("a", "c", 1.0, 0.0)]
    assert filtered.changed(TICK, other) == other


def test_points_alone_are_no_reason_to_record() -> None:
    filtered = ContactFilter()
    points = [ContactPoint((0.1 * k, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, (0.0, 0.0, 0.0)) for k in range(2)]
    first, then = (Contact("a", "b", 1.0, 0.0, (point,)) for point in points)
    assert filtered.changed(0.0, [first]) == [first]
    assert filtered.changed(1.0, [then]) is None
