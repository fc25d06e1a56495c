"""Contact points of PyBullet as contacts: which count, and whose force they state."""

from __future__ import annotations

import pytest

from manipcli.model.state import ContactPoint
from manipcli.simulate.engines.pybullet_contacts import BulletPoint, ContactMerger


def _point(distance: float, force: float, *, bodies: tuple[int, int] = (0, 1)) -> BulletPoint:
    """Halfway between z = 1 and z = 3; friction of 0.5 N along x and of -0.25 N along y on the first body."""
    places = (0.0, 2.0, 1.0), (0.0, 4.0, 3.0)
    friction = 0.5, (1.0, 0.0, 0.0), -0.25, (0.0, 1.0, 0.0)
    return (0, *bodies, -1, -1, *places, (0.0, 0.0, -1.0), distance, force, *friction)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_point_states_the_force_on_the_part_whose_name_is_first(side: float) -> None:
    names = ("cup", "desk") if side > 0 else ("desk", "cup")
    merge = ContactMerger({(0, -1): names[0], (1, -1): names[1]})
    for _ in range(2):  # the second time from the cache of names
        (contact,) = merge.merged([_point(-0.001, 2.0)])
        assert contact[:4] == ("cup", "desk", 2.0, -0.001)
        friction = (side * 0.5, -side * 0.25, 0.0)
        assert contact.points == (ContactPoint((0.0, 3.0, 2.0), (0.0, 0.0, -side), 2.0, friction),)


def test_points_that_touch_belong_to_their_pair_and_those_apart_to_none() -> None:
    merge = ContactMerger({(0, -1): "cup", (1, -1): "desk", (2, -1): "ball"})
    near = [_point(0.001, 0.0), _point(0.001, 1.0), _point(0.0, 0.0), _point(0.002, 0.0, bodies=(2, 0))]
    (contact,) = merge.merged([*near, _point(-0.002, 3.0)])
    assert (contact.force, contact.distance) == (4.0, -0.002)
    assert [point.force for point in contact.points] == [1.0, 0.0, 3.0]
