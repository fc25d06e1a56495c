"""The margin of a grasp against closed forms, on contacts made by hand, and on the plans of two robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.plan.grasp_contacts import PALM, GraspContact, finger_links, grasp_contacts
from manipcli.plan.grasp_margin import MOST, HeldForce, _load, carries, cone_edges, force_limits, grasp_margin
from manipcli.plan.motion import CLOSING

Make = Callable[..., Any]

DOWN = np.array([0.0, 0.0, -1.0])


def pad(x: float, finger: int, *, half: float = 0.01) -> list[GraspContact]:
    """A flat square pad of a finger on the plane at `x`, pressing towards x = 0."""
    normal = np.array([-np.sign(x), 0.0, 0.0])
    corners = [(half * a, half * b) for a in (-1, 1) for b in (-1, 1)]
    return [GraspContact(np.array([x, y, z]), normal, f"finger_{finger}", finger) for y, z in corners]


def held(contacts: list[GraspContact], mu: float, force: float = 10.0, centre: Array | None = None) -> HeldForce:
    return HeldForce(contacts, force_limits(contacts, force, 2), np.zeros(3) if centre is None else centre, mu)


@pytest.mark.parametrize("mu", [0.2, 0.5, 1.0])
def test_two_opposed_pads_hold_twice_mu_times_the_force(mu: float) -> None:
    """2 mu F across the line of the fingers; along it one finger gives way by its whole force, F."""
    two = held([*pad(0.02, 0), *pad(-0.02, 1)], mu)
    assert two.most(DOWN) == pytest.approx(2.0 * mu * 10.0, rel=1e-6)
    assert two.most(np.array([0.0, 1.0, 0.0])) == pytest.approx(2.0 * mu * 10.0, rel=1e-6)
    assert two.most(np.array([1.0, 0.0, 0.0])) == pytest.approx(10.0, rel=1e-6)


def test_the_margin_is_proportional_to_the_force_and_grows_with_friction() -> None:
    contacts = [*pad(0.02, 0), *pad(-0.02, 1)]
    loads = [held(contacts, mu, force).most(DOWN) for force in (5.0, 10.0) for mu in (0.3, 0.6)]
    assert loads[2:] == pytest.approx([2.0 * load for load in loads[:2]], rel=1e-6)
    assert loads[1] > loads[0]


def test_one_finger_and_no_finger_hold_nothing() -> None:
    assert held(pad(0.02, 0), 0.5).most(DOWN) == 0.0
    assert held([], 0.5).most(DOWN) == 0.0


def test_points_carry_no_moment_about_their_line_and_pads_do() -> None:
    """The centre of mass 5 mm beside the line through two points: the weight turns the object about it."""
    aside = np.array([0.0, 0.005, 0.0])
    points = [
        GraspContact(np.array([sign * 0.02, 0.0, 0.0]), np.array([-sign, 0.0, 0.0]), "f", k)
        for k, sign in enumerate((1.0, -1.0))
    ]
    assert held(points, 0.5, centre=aside).most(DOWN) == pytest.approx(0.0, abs=1e-6)
    assert held([*pad(0.02, 0), *pad(-0.02, 1)], 0.5, centre=aside).most(DOWN) > 5.0


def test_a_finger_below_holds_without_friction() -> None:
    """Form closure: the weight on two pads that face up is carried by their normals."""
    up = np.array([0.0, 0.0, 1.0])
    below = [
        GraspContact(np.array([sign * 0.02, y, -0.01]), up, f"f{k}", k)
        for k, sign in enumerate((1.0, -1.0))
        for y in (-0.01, 0.01)
    ]
    assert held(below, 0.0).most(DOWN) == pytest.approx(20.0, rel=1e-6)
    palm = [contact._replace(finger=PALM) for contact in below]
    assert held(palm, 0.0).most(DOWN) == pytest.approx(20.0, rel=1e-6)  # it reacts to what two fingers press


def test_a_load_beside_lowers_what_is_left() -> None:
    two = held([*pad(0.02, 0), *pad(-0.02, 1)], 0.5)
    assert two.most(DOWN, beside=3.0 * DOWN) == pytest.approx(7.0, rel=1e-6)
    assert two.most(DOWN, beside=11.0 * DOWN) == 0.0


def test_the_edges_lie_on_the_friction_cone() -> None:
    rng = np.random.default_rng(0)
    for normal in rng.normal(size=(20, 3)):
        n = normal / np.linalg.norm(normal)
        edges = cone_edges(n, 0.7)
        np.testing.assert_allclose(edges @ n, 1.0)
        np.testing.assert_allclose(np.linalg.norm(edges - n, axis=1), 0.7)
        np.testing.assert_allclose(edges.mean(axis=0), n, atol=1e-12)


def test_the_contacts_of_a_planned_grasp_lie_on_the_object_and_press_into_it(bench: Make) -> None:
    panda = bench("panda")
    plan = panda.do("pick", {"object": "block", "approach": {"from": "top"}, "grasp": {"force": "7 N"}})
    body = panda.scene.body("block")
    X_OW = panda.planner.body_pose(plan.end, "block").inverse()
    contacts = grasp_contacts(panda.planner, plan.end, panda.planner.gripper_joints)
    assert {contact.finger for contact in contacts} == {0, 1}
    for contact in contacts:
        p = np.abs(X_OW.apply(contact.point))
        assert (p <= body.size / 2 + 2e-3).all()
        assert (p >= body.size / 2 - 2e-3).any()
        assert (X_OW.R @ contact.normal) @ X_OW.apply(contact.point) < 0.0


def test_the_margin_of_a_block_between_two_fingers_is_that_of_the_rule_of_thumb(bench: Make) -> None:
    panda = bench("panda")
    plan = panda.do("pick", {"object": "block", "approach": {"from": "top"}, "grasp": {"force": "7 N"}})
    margin = grasp_margin(panda.planner, plan)
    assert margin is not None
    body = panda.scene.body("block")
    weight = body.mass * 9.81
    assert margin.ratio == pytest.approx(2.0 * margin.friction * 7.0 / weight, rel=0.02)
    assert 0.0 < margin.acceleration < margin.ratio * 9.81
    assert "2 fingers at 7 N each" in margin.text
    assert "block" in margin.text
    assert carries(panda.planner, plan)


def test_what_does_not_grasp_has_no_margin(story: Any) -> None:
    _, lift = story.steps["lift"]
    assert grasp_margin(story.bench.planner, lift) is None
    assert carries(story.bench.planner, lift)
    _, pick = story.steps["pick"]
    margin = grasp_margin(story.bench.planner, pick)
    assert margin is not None
    assert margin.contacts == 3
    assert 1.0 < margin.ratio < MOST
    assert any(motion.label == CLOSING for motion in pick.motions)


def test_fingers_that_mimic_count_and_joints_of_one_finger_do_not(bench: Make, story: Any) -> None:
    panda = bench("panda")
    assert len(finger_links(panda.robot, panda.planner.gripper_joints)) == 2
    assert len(finger_links(story.bench.robot, story.bench.planner.gripper_joints)) == 3


HEAVY = """
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  cup: {cup: {radius: 30 mm, height: 90 mm, wall: 3 mm}, mass: 80 g, rests_on: table, at: [0.5, -0.1]}
"""
STONE = "  stone: {sphere: {radius: 20 mm}, mass: MASS, inside: cup}\n"


def test_what_lies_in_the_object_hangs_on_the_hand_too(bench: Make) -> None:
    """Fingers that hold 9 x the empty cup hold less than its weight with a stone of 900 g: the oracle adds masses."""
    found = {}
    for mass in ("", "20 g", "900 g"):
        panda = bench("panda", scene=HEAVY + (STONE.replace("MASS", mass) if mass else ""))
        plan = panda.do("pick", {"object": "cup", "grasp": {"force": "6 N"}})
        margin = grasp_margin(panda.planner, plan)
        assert margin is not None
        found[mass] = margin
        assert carries(panda.planner, plan)  # by friction too low at any grasp, too
    empty, light, heavy = found[""], found["20 g"], found["900 g"]
    assert (empty.contents, light.contents, heavy.contents) == ((), ("stone",), ("stone",))
    assert empty.weight == pytest.approx(0.08 * 9.81, rel=1e-3)
    assert heavy.weight == pytest.approx(0.98 * 9.81, rel=1e-3)
    assert light.ratio * light.weight == pytest.approx(empty.ratio * empty.weight, rel=0.2)
    assert heavy.ratio < 1.0 < light.ratio < empty.ratio
    assert "'cup' with its contents (9.61 N) is not held" in heavy.text
    assert "contents" not in empty.text


def test_the_centre_of_mass_is_that_of_the_object_and_its_contents(bench: Make) -> None:
    """Mass and first moment, summed by hand."""
    panda = bench("panda", scene=HEAVY + STONE.replace("MASS", "240 g"))
    load = _load(panda.planner, panda.now, "cup")
    cup, stone = (panda.scene.body(name) for name in ("cup", "stone"))
    centres = [panda.body(body.name).apply(body.X_OI.p) for body in (cup, stone)]
    assert load.mass == pytest.approx(0.32)
    np.testing.assert_allclose(load.centre, (0.08 * centres[0] + 0.24 * centres[1]) / 0.32, atol=1e-9)
