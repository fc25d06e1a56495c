"""Places relative to things: against poses computed by hand from matrices, and edges of boxes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.plan.keeps.inside import MEMBER
from manipcli.plan.steps.place_spec import PlaceSpec
from manipcli.plan.steps.placed import goal, in_region, located
from manipcli.shapes.proximity import coal_shape, distance
from manipcli.spec.keep import KeepSpec

Make = Callable[..., Any]

SCENE = """
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}
  brick: {box: {size: [10 cm, 6 cm, 4 cm]}, mass: 0.3, rests_on: table, at: [0.52, 0.12], yaw: 30 deg}
  tray: {tray: {size: [0.2, 0.2, 0.03], wall: 5 mm}, rests_on: table, at: [0.72, -0.2], yaw: 20 deg, fixed: true}
  pot: {cup: {radius: 4 cm, height: 6 cm}, mass: 0.3, rests_on: table, at: [0.4, 0.25],
        parts: {knob: {pose: {xyz: [0, 4 cm, 3 cm], rpy: [0, 0, 90 deg]}}}}
  mug: {cup: {radius: 3 cm, height: 6 cm}, mass: 0.3, rests_on: table, at: [0.75, 0.1]}
  peg: {box: {size: [8 mm, 8 mm, 4 cm]}, rests_on: table, at: [0.7, 0.35], fixed: true}
  slide: {box: {size: [0.1, 0.1, 1 cm]}, pose: {xyz: [0.8, 0.3, 0.3], rpy: [0, 20 deg, 0]}, fixed: true}
  ball: {sphere: {radius: 2 cm}, mass: 0.1, rests_on: table, at: [0.33, -0.3]}
"""
FRAMES = "frames: {spot: {parent: table, pose: {xyz: [0, -0.3, 0.1], rpy: [0, 0, 45 deg]}}}"


@pytest.fixture(scope="module")
def held(bench: Make) -> Any:
    """A Panda that holds the block, 12 cm above the table."""
    panda = bench("panda", SCENE, FRAMES)
    panda.do("pick", {"object": "block", "approach": {"from": "top"}})
    panda.do("lift", {"object": "block"})
    return panda, panda.now


@pytest.fixture
def arm(held: Any) -> Any:
    """The same before each test."""
    panda, panda.now = held
    return panda


def matrix(xyz: tuple[float, float, float], yaw_deg: float) -> Any:
    c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    return np.array([[c, -s, 0, xyz[0]], [s, c, 0, xyz[1]], [0, 0, 1, xyz[2]], [0, 0, 0, 1.0]])


def placed(arm: Any, **spec: Any) -> Transform:
    """X_WG of the block."""
    return goal(PlaceSpec.model_validate({"object": "block", **spec}), arm.planner, arm.now)


BRICK = matrix((0.52, 0.12, 0.22), 30.0)


def test_onto_alone_is_the_middle_of_the_body_as_it_lies(arm: Any) -> None:
    arm.do("place", {"object": "block", "onto": "brick", "yaw": 0})
    np.testing.assert_allclose(arm.body("block").matrix, BRICK @ matrix((0, 0, 0.045), 0.0), atol=1e-9)


def test_into_alone_is_the_middle_of_the_floor(arm: Any) -> None:
    arm.do("place", {"object": "block", "into": "tray", "yaw": "90 deg"})
    expected = matrix((0.72, -0.2, 0.2), 20.0) @ matrix((0, 0, 0.005 + 0.025), 90.0)
    np.testing.assert_allclose(arm.body("block").matrix, expected, atol=1e-9)


def test_a_point_of_a_frame_is_the_same_absolute_pose(arm: Any) -> None:
    before = arm.now
    relation = {"of": "brick", "xyz": ["2 cm", "-1 cm", "4.5 cm"]}
    arm.do("place", {"object": "block", "at": relation, "yaw": "10 deg"})
    there = arm.body("block")
    np.testing.assert_allclose(there.matrix, BRICK @ matrix((0.02, -0.01, 0.045), 10.0), atol=1e-9)
    arm.now = before
    x, y, z = (float(v) for v in there.p)
    arm.do("place", {"object": "block", "at": {"of": "world", "xyz": [x, y, z]}, "yaw": "40 deg"})
    np.testing.assert_allclose(arm.body("block").matrix, there.matrix, atol=1e-9)
    arm.now = before
    arm.do("place", {"object": "block", "at": [x, y], "onto": "brick", "yaw": "40 deg"})
    np.testing.assert_allclose(arm.body("block").matrix, there.matrix, atol=1e-9)


def test_a_relation_follows_the_body_that_was_moved(arm: Any) -> None:
    names = [body.name for body in arm.scene.movable]
    bodies = list(arm.now.bodies)
    moved = Transform.of(xyz=(0.6, 0.1, 0.22), rpy=(0.0, 0.0, 1.0))
    bodies[names.index("brick")] = moved
    arm.now = replace(arm.now, bodies=tuple(bodies))
    arm.do("place", {"object": "block", "onto": "brick", "yaw": 0})
    np.testing.assert_allclose(arm.body("block").matrix, moved.matrix @ matrix((0, 0, 0.045), 0.0), atol=1e-9)


def test_with_a_support_a_point_gives_the_place_on_it(arm: Any) -> None:
    there = placed(arm, onto="table", at={"of": "brick", "xyz": ["-2 cm", "9 cm", 0]}, yaw=0)
    np.testing.assert_allclose(there.matrix, BRICK @ matrix((-0.02, 0.09, 0.005), 0.0), atol=1e-9)


@pytest.mark.parametrize(
    ("side", "direction", "reach"),
    [("left", (0, 1), 0.03), ("right", (0, -1), 0.03), ("front", (1, 0), 0.05), ("behind", (-1, 0), 0.05)],
)
def test_sides_are_those_of_the_body_and_the_gap_is_between_the_faces(
    arm: Any, side: str, direction: tuple[int, int], reach: float
) -> None:
    there = placed(arm, at={"of": "brick", "side": side, "gap": "4 cm"}, yaw=0)
    away = reach + 0.04 + 0.02  # half of the brick, the gap, half of the block
    expected = BRICK @ matrix((away * direction[0], away * direction[1], 0.005), 0.0)
    np.testing.assert_allclose(there.matrix, expected, atol=2e-6)


@pytest.mark.parametrize(("of", "yaw"), [("brick", 25.0), ("pot", 45.0), ("pot", -10.0)])
def test_a_gap_is_the_smallest_distance_of_the_shapes(arm: Any, of: str, yaw: float) -> None:
    there = placed(arm, at={"of": of, "side": "right", "gap": "35 mm"}, yaw=f"{yaw} deg")
    a, b = arm.scene.body("block"), arm.scene.body(of)
    apart = [
        distance(coal_shape(m.shape), there @ m.X_LS, coal_shape(n.shape), arm.body(of) @ n.X_LS).distance
        for m in a.geometries
        for n in b.geometries
    ]
    assert min(apart) == pytest.approx(0.035, abs=2e-6)


def test_a_part_of_the_object_is_set_at_the_point(arm: Any) -> None:
    arm.do("place", {"object": "block", "part": "bottom", "at": {"of": "brick/top", "xyz": [0, 0, 0]}, "yaw": 0})
    np.testing.assert_allclose(arm.body("block").matrix, BRICK @ matrix((0, 0, 0.045), 0.0), atol=1e-9)


def test_a_region_lies_along_the_axes_of_its_frame(arm: Any) -> None:
    region = {"frame": "tray", "box": {"centre": [0, 0], "size": ["10 cm", "10 cm"]}}
    spec = PlaceSpec.model_validate({"object": "block", "into": "tray", "region": region, "yaw": 0})
    assert spec.region is not None
    at = located(spec.region, arm.planner, arm.now)((0.0, 0.05))
    expected = matrix((0.72, -0.2, 0.2), 20.0) @ matrix((0, 0.05, 0.03), 0.0)
    np.testing.assert_allclose(in_region(spec, arm.planner, arm.now, at).matrix, expected, atol=1e-9)


def test_a_place_in_a_body_or_in_the_air_is_refused(arm: Any) -> None:
    inside = arm.refused("place", {"object": "block", "at": {"of": "brick", "xyz": [0, 0, 0]}, "yaw": 0})
    assert inside.cause == "'block' would overlap 'brick' by 45 mm at its place"
    assert inside.hint == "to set it on top, write `onto: brick`"
    above = arm.refused("place", {"object": "block", "at": {"of": "brick", "xyz": [0, 0, "8 cm"]}, "yaw": 0})
    assert above.cause == "'block' would fall by 35 mm: nothing is below its place"
    off = arm.refused("place", {"object": "block", "onto": "table", "at": {"of": "brick", "xyz": [1, 0, 0]}})
    assert off.loc == ("at",) and off.hint is not None and "in the frame of 'brick'" in off.hint


@pytest.mark.parametrize(
    ("spec", "loc", "message", "hint"),
    [
        ({"onto": "slide"}, ("onto",), "'slide' is tilted", "an upright body"),
        ({"onto": "ball"}, ("onto",), "'ball' is a sphere; nothing stands on it", "a box, a cylinder or the floor"),
        ({"onto": "peg"}, ("onto",), "the top of 'peg' is too narrow for 'block': 8 mm wide", "10 mm wide"),
        ({"onto": "floor"}, ("onto",), "the floor has no middle", "at: [x, y]"),
        ({"onto": "block"}, ("onto",), "cannot be placed on itself", "another body"),
        ({"into": "brick"}, ("into",), "'brick' is a box and has no hollow", "tray, pot, mug"),
        ({"into": "tray", "onto": "brick"}, ("into",), "`onto` and `into` both set", "remove one"),
        ({"at": "start", "onto": "brick"}, ("onto",), "`at: start` and `onto` both set", "for the middle of 'brick'"),
        ({"at": {"of": "birck", "xyz": [0, 0, 0]}}, ("at", "of"), "unknown frame 'birck'", "'brick'"),
        ({"at": {"of": "pot/nob", "xyz": [0, 0, 0]}}, ("at", "of"), "'pot' has no part 'nob'", "'knob'"),
        ({"at": {"of": "pto/knob", "xyz": [0, 0, 0]}}, ("at", "of"), "unknown frame 'pto/knob'", "'pot/knob'"),
        ({"at": {"of": "pot.rim", "xyz": [0, 0, 0]}}, ("at", "of"), "unknown frame 'pot.rim'", "'pot/rim'"),
        ({"at": {"of": "tool", "xyz": [0, 0, 0]}}, ("at", "of"), "'tool' moves with the robot", "`base`"),
        ({"at": {"of": "robot/palm", "xyz": [0, 0, 0]}}, ("at", "of"), "'palm' is not a link", ""),
        ({"at": {"of": "block/top", "xyz": [0, 0, 0]}}, ("at", "of"), "relative to itself", ""),
        ({"at": {"of": "slide", "side": "left", "gap": 0}}, ("at", "of"), "'slide' is tilted, so its sides", "xyz"),
        ({"at": {"of": "spot", "side": "left", "gap": 0}}, ("at", "of"), "`side` needs a body; 'spot'", "xyz"),
        ({"at": {"of": "brick", "xyz": [0, 0, 1]}, "onto": "table"}, ("at", "xyz", 2), "no effect", "write 0"),
        ({"part": "botom", "at": {"of": "spot", "xyz": [0, 0, 0]}}, ("part",), "has no part 'botom'", "'bottom'"),
        ({"part": "bottom", "onto": "brick"}, ("part",), "needs a point", "brick/top"),
        ({"yaw": 1.0}, ("yaw",), "`yaw` needs a place", "remove `yaw`"),
    ],
)
def test_what_depends_only_on_the_file_is_found_without_a_plan(
    bench: Make, spec: dict[str, Any], loc: tuple[object, ...], message: str, hint: str
) -> None:
    panda = bench("panda", SCENE, FRAMES)
    ((found, text, advice),) = panda.problems("place", {"object": "block", **spec})
    assert found == loc
    assert message in text and hint in (advice or "")


def test_the_frame_of_a_part_goes_along_with_its_body(bench: Make) -> None:
    panda = bench("panda", SCENE, FRAMES)
    names = [body.name for body in panda.scene.movable]
    bodies = list(panda.now.bodies)
    X_WO = Transform.of(xyz=(0.3, 0.2, 0.5), rpy=(0.3, -0.4, 2.0))
    bodies[names.index("pot")] = X_WO
    moved = replace(panda.now, bodies=tuple(bodies))
    knob = Transform.of(xyz=(0.0, 0.04, 0.03), rpy=(0.0, 0.0, np.pi / 2)).matrix
    np.testing.assert_allclose(panda.planner.frame("pot/knob", moved).matrix, X_WO.matrix @ knob, atol=1e-12)
    np.testing.assert_allclose(panda.planner.frame("pot/rim", moved).p, X_WO.apply([0.0, 0.0, 0.06]), atol=1e-12)
    link = panda.robot.tool.link
    X_WL = panda.planner.frame(f"robot/{link}", moved) @ panda.robot.tool.X_LT
    np.testing.assert_allclose(X_WL.matrix, panda.planner.tool_pose(moved).matrix, atol=1e-12)


def test_a_pick_of_a_part_closes_on_it(bench: Make) -> None:
    scene = SCENE.replace("at: [0.5, -0.15]}", "at: [0.5, -0.15], parts: {end: {pose: {xyz: [1 cm, 0, 1.5 cm]}}}}")
    panda = bench("panda", scene, FRAMES)
    picked = panda.do("pick", {"object": "block", "part": "end", "approach": {"from": "top"}})
    X_TO = panda.planner.tool_pose(picked.end).inverse() @ panda.body("block")
    np.testing.assert_allclose(X_TO.inverse().p, [0.01, 0.0, 0.015], atol=2e-3)
    ((loc, text, hint),) = panda.problems("pick", {"object": "block", "part": "edn"})
    assert (loc, text, hint) == (("part",), "'block' has no part 'edn'", "did you mean 'end'?")


def test_the_yaw_of_an_approach_is_measured_from_its_frame(bench: Make) -> None:
    panda = bench("panda", SCENE, FRAMES)
    approach = {"from": "top", "yaw": "10 deg"}
    turned = panda.plan("pick", {"object": "block", "approach": {**approach, "frame": "spot"}})
    straight = panda.plan("pick", {"object": "block", "approach": {**approach, "yaw": "55 deg"}})
    np.testing.assert_allclose(turned.end.position, straight.end.position, atol=1e-9)


def test_a_volume_that_is_kept_lies_along_the_axes_of_its_frame(bench: Make) -> None:
    """A box of 10 cm around the tool, turned by 45 deg: its corners on the axes of the world, 7 cm away."""
    panda = bench("panda", SCENE, FRAMES)
    p = panda.planner.tool_pose(panda.now).p
    spot = panda.planner.frame("spot", panda.now)
    centre = [float(v) for v in spot.inverse().apply(p)]
    box = {"centre": centre, "size": [0.1, 0.1, 0.1]}
    kept = MEMBER.open(KeepSpec.model_validate({"inside": {"box": box, "frame": "spot"}}), panda.planner, panda.now)
    assert kept is not None and kept.margin is not None
    assert kept.margin(panda.now.position[None])[0] == pytest.approx(0.05, abs=1e-9)
    aside = {**box, "centre": [float(v) for v in spot.inverse().apply(p + np.array([0.06, 0.0, 0.0]))]}
    kept = MEMBER.open(KeepSpec.model_validate({"inside": {"box": aside, "frame": "spot"}}), panda.planner, panda.now)
    assert kept is not None and kept.margin is not None
    assert kept.margin(panda.now.position[None])[0] == pytest.approx(0.05 - 0.06 / np.sqrt(2), abs=1e-9)
