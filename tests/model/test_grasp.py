"""How hard a hand squeezes an object: the smaller of two opposite forces, from contact points."""

from __future__ import annotations

import math

import pytest

from manipcli.model.grasp import squeeze_force
from manipcli.model.state import Contact, ContactPoint

Vector = tuple[float, float, float]


def touch(link: str, *points: tuple[Vector, float], other: str = "block", flipped: bool = False) -> Contact:
    """A contact of a link with a body; each point has the direction of the force on the body, and the force."""
    made = [ContactPoint((0.0, 0.0, 0.0), n, f, (0.0, 0.0, 0.0)) for n, f in points]
    force = sum(f for _, f in points)
    if not flipped:
        return Contact(other, f"robot/{link}", force, 0.0, tuple(made))
    back = tuple(point._replace(normal=tuple(-x for x in point.normal)) for point in made)
    return Contact(f"robot/{link}", other, force, 0.0, back)


LEFT, RIGHT, DOWN = (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)


@pytest.mark.parametrize("flipped", [False, True])
def test_two_fingers_squeeze_with_the_weaker_of_their_forces(flipped: bool) -> None:
    contacts = [touch("a", (LEFT, 7.0)), touch("b", (RIGHT, 3.0), flipped=flipped)]
    assert squeeze_force(contacts, "block") == pytest.approx(3.0)


def test_fingers_on_top_of_an_object_or_at_one_side_do_not_squeeze_it() -> None:
    assert squeeze_force([touch("a", (DOWN, 7.0)), touch("b", (DOWN, 7.0))], "block") == 0.0
    assert squeeze_force([touch("a", (LEFT, 7.0)), touch("b", (LEFT, 7.0))], "block") == 0.0
    assert squeeze_force([touch("a", (LEFT, 7.0)), touch("b", (DOWN, 7.0))], "block") == pytest.approx(0.0)


def test_three_fingers_around_an_object_squeeze_it() -> None:
    around = [(math.cos(a), math.sin(a), 0.0) for a in (0.0, 2.0 * math.pi / 3.0, -2.0 * math.pi / 3.0)]
    contacts = [touch(f"finger_{k}", (n, 8.0)) for k, n in enumerate(around)]
    assert squeeze_force(contacts, "block") == pytest.approx(8.0)


def test_other_bodies_and_walls_do_not_count() -> None:
    wall = Contact("block", "wall", 7.0, 0.0, (ContactPoint((0.0, 0.0, 0.0), RIGHT, 7.0, (0.0, 0.0, 0.0)),))
    assert squeeze_force([touch("a", (LEFT, 7.0)), wall], "block") == 0.0
    assert squeeze_force([touch("a", (LEFT, 7.0)), touch("b", (RIGHT, 7.0), other="ball")], "block") == 0.0
    assert squeeze_force([], "block") == 0.0


def test_without_contact_points_two_links_that_press_are_opposite() -> None:
    contacts = [Contact("block", "robot/a", 7.0, 0.0), Contact("block", "robot/b", 3.0, 0.0)]
    assert squeeze_force(contacts, "block") == 3.0
    assert squeeze_force(contacts[:1], "block") == 0.0
