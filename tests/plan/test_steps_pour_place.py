"""`pour` and `place`: where the cup goes, by plain trigonometry and the description's joints multiplied by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.plan.steps import STEPS
from manipcli.plan.steps.place import _tilted

Make = Callable[..., Any]  # fixtures of conftest.py: a Bench of a robot and a scene; steps already planned on one
Story = Any

RADIUS, HEIGHT = 0.036, 0.110
DRAWER_SIDES = ((0.095, 0), (-0.095, 0), (0, 0.095), (0, -0.095))
TRAY = np.array([0.70, 0.32])
RIM = 0.4 + 0.05
TABLE = """
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}
"""
LEANING = {-7.0: 0.0, 7.0: 4.0}
FACETS = 8e-4  # the cup's wall is 16 boxes, whose corners reach up to r (1 / cos(pi / 16) - 1) beyond its circle


def cups(story: Story, verb: str, label: str) -> np.ndarray:
    """X_WO (k, 4, 4) of the cup along a motion: it keeps its place in the hand."""
    before, plan = story.steps[verb]
    X_WT = story.bench.tools(before, plan, label)
    X_TO = np.linalg.inv(story.bench.tool(before.position)) @ story.bench.body("cup", before).matrix
    return X_WT @ X_TO


def tilts(X_WO: np.ndarray) -> np.ndarray:
    return np.arccos(np.clip(X_WO[:, 2, 2], -1.0, 1.0))


def lip(X_WO: np.ndarray) -> np.ndarray:
    """The lowest of 3600 points on the rim."""
    angle = np.linspace(0.0, 2 * np.pi, 3600, endpoint=False)
    rim = np.column_stack((RADIUS * np.cos(angle), RADIUS * np.sin(angle), np.full(3600, HEIGHT)))
    points = rim @ X_WO[:3, :3].T + X_WO[:3, 3]
    return points[np.argmin(points[:, 2])]


def test_the_cup_stays_upright_while_it_is_carried(story: Story) -> None:
    """What is in it must stay in."""
    for verb, label in (("lift", "lift"), ("pour", "carry"), ("place", "carry"), ("place", "lower")):
        assert tilts(cups(story, verb, label)).max() < np.radians(0.1)


def test_tilted_the_lip_is_over_the_middle_of_the_tray_at_the_clearance(story: Story) -> None:
    low = lip(cups(story, "pour", "tilt")[-1])
    np.testing.assert_allclose(low[:2], TRAY, atol=FACETS)
    assert low[2] - RIM == pytest.approx(0.08, abs=FACETS)  # the middle of the default 4 to 12 cm


def test_with_an_offset_the_lip_is_that_far_before_the_middle(bench: Make, story: Story) -> None:
    """Before: the tilted cup's own axis points from the lip to the middle."""
    arm = bench()
    arm.now = before = story.steps["pour"][0]
    plan = arm.plan("pour", {"object": "cup", "into": "tray", "tilt": "105 deg", "offset": "3 cm"})
    X_TO = np.linalg.inv(arm.tool(before.position)) @ arm.body("cup", before).matrix
    end = arm.tools(before, plan, "tilt")[-1] @ X_TO
    ahead = end[:2, 2] / np.linalg.norm(end[:2, 2])
    np.testing.assert_allclose(lip(end)[:2], TRAY - 0.03 * ahead, atol=FACETS)


def test_an_offset_outside_the_container_is_refused(bench: Make) -> None:
    arm = bench()
    spec = STEPS["pour"].spec.model_validate({"object": "cup", "into": "tray", "offset": "16 cm"})
    (problem,) = STEPS["pour"].check(spec, arm.robot, arm.scene)
    assert problem.loc == ("offset",)
    assert problem.message == "the lip is 160 mm from the centre of 'tray', outside its rim"
    assert problem.hint == "'tray' reaches 150 mm from its centre"


def test_the_cup_tilts_as_far_as_asked_about_one_horizontal_axis_in_place(story: Story) -> None:
    X = cups(story, "pour", "tilt")
    tilt = tilts(X)
    assert tilt[-1] == pytest.approx(np.radians(125.0), abs=2e-4)
    assert (np.diff(tilt) >= -1e-5).all()
    # In a turn about a horizontal axis the cup's own axis stays in one upright plane: its heading does not change.
    heading = X[10:, :2, 2] / np.linalg.norm(X[10:, :2, 2], axis=1)[:, None]
    np.testing.assert_allclose(heading, np.broadcast_to(heading[-1], heading.shape), atol=2e-3)
    before, plan = story.steps["pour"]
    p_WT = story.bench.tools(before, plan, "tilt")[:, :3, 3]
    np.testing.assert_allclose(p_WT, np.broadcast_to(p_WT[0], p_WT.shape), atol=1e-4)


def test_tilting_back_is_the_tilt_reversed(story: Story) -> None:
    before, plan = story.steps["pour"]
    forth = story.bench.at(before, plan, "tilt")[1].trajectory
    back = story.bench.at(before, plan, "tilt back")[1].trajectory
    np.testing.assert_array_equal(back.positions, forth.positions[::-1])
    np.testing.assert_array_equal(back.velocities, -forth.velocities[::-1])
    assert tilts(cups(story, "pour", "tilt back"))[-1] < np.radians(0.1)


def test_only_the_dwell_waits_for_until(story: Story) -> None:
    _, plan = story.steps["pour"]
    assert [(m.label, m.awaits) for m in plan.motions] == [
        ("carry", False), ("tilt", False), ("dwell", True), ("tilt back", False)
    ]  # fmt: skip
    assert plan.motions[2].duration == 1.0


def test_after_a_pour_the_ball_is_predicted_on_the_floor_of_the_tray(story: Story) -> None:
    """The tray's floor is as thick as its wall; a ball of 14 mm lies on it, and stays when the cup leaves."""
    _, plan = story.steps["pour"]
    p = story.bench.body("ball", plan.end).p
    np.testing.assert_allclose(p[:2], TRAY, atol=1e-9)
    assert 0.4 + 0.014 < p[2] < 0.4 + 0.014 + 0.01
    np.testing.assert_array_equal(story.bench.body("ball", story.steps["place"][1].end).p, p)


def test_half_a_tilt_spills_nothing(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["pour"][0]
    plan = arm.plan("pour", {"object": "cup", "into": "tray", "tilt": "60 deg"})
    apart = arm.body("ball", plan.end).p - arm.body("cup", plan.end).p
    np.testing.assert_allclose(apart, arm.body("ball", arm.start).p - arm.body("cup", arm.start).p, atol=1e-6)


def test_a_tilted_cup_is_put_upright_before_it_pours(bench: Make, story: Story) -> None:
    """Carried 20 degrees askew, it still pours its lip over the middle of the tray."""
    arm = bench()
    arm.now = story.steps["pour"][0]
    arm.do("move", {"pose": {"rpy": [0, 0, "20 deg"]}, "frame": "tool", "path": "linear"})
    before = arm.now
    assert tilts(arm.body("cup").matrix[None])[0] == pytest.approx(np.radians(20.0), abs=1e-3)
    plan = arm.do("pour", {"object": "cup", "into": "tray"})
    X_TO = np.linalg.inv(arm.tool(before.position)) @ arm.body("cup", before).matrix
    X_WO = arm.tools(before, plan, "tilt") @ X_TO
    assert tilts(X_WO[:1])[0] < np.radians(0.1)
    np.testing.assert_allclose(lip(X_WO[-1])[:2], TRAY, atol=FACETS)


@pytest.mark.slow
def test_a_receiver_out_of_reach_is_refused_with_what_was_tried(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["pour"][0]
    refusal = arm.refused("pour", {"object": "cup", "into": "floor", "clearance": "2 m"})
    assert refusal.cause.startswith(
        "cannot pour from 'cup' into 'floor', all 18 candidates failed: carry: the end of the straight line, ("
    )


def test_a_cup_put_back_stands_where_it_stood(story: Story) -> None:
    before, plan = story.steps["place"]
    bench = story.bench
    cup = bench.body("cup", plan.end)
    np.testing.assert_allclose(cup.p, [0.75, 0.0, 0.4], atol=1e-4)
    np.testing.assert_allclose(cup.R, np.eye(3), atol=1e-3)
    assert plan.end.carried is None
    assert not plan.end.closed
    np.testing.assert_array_equal(bench.body("cup", before).p == cup.p, [False] * 3)


def test_lowering_is_vertical_and_withdrawing_backs_off_and_rises(story: Story) -> None:
    before, plan = story.steps["place"]
    down = cups(story, "place", "lower")[:, :3, 3]
    np.testing.assert_allclose(down[:, :2], np.broadcast_to([0.75, 0.0], (40, 2)), atol=1e-4)
    assert 0.04 - 1e-4 <= down[0, 2] - down[-1, 2] <= 0.1 + 1e-4
    X = story.bench.tools(before, plan, "withdraw")
    way = X[-1, :3, 3] - X[0, :3, 3]
    assert 0.12 - 1e-4 <= -(way @ X[0, :3, 2]) <= 0.18 + 1e-4  # against the direction of approach
    assert way[2] > 0.0


def test_opening_takes_as_long_as_the_closed_fingers_need(story: Story) -> None:
    before, plan = story.steps["place"]
    planner = story.bench.planner
    motion = story.bench.at(before, plan, "open")[1]
    columns = story.bench.robot.indices(planner.gripper_joints)
    way = np.abs(before.position[columns] - plan.end.position[columns]).max()
    assert way > 0.05
    assert motion.duration == pytest.approx(way / planner.gripper_speed)


def held_block(bench: Make, scene: str | None = None) -> Any:
    panda = bench("panda", scene)
    panda.do("pick", {"object": "block", "approach": {"from": "top"}})
    panda.do("lift", {"object": "block"})
    return panda


def test_a_block_is_put_back_or_elsewhere_and_turned(bench: Make) -> None:
    panda = held_block(bench)
    lifted = panda.now
    panda.do("place", {"object": "block"})
    np.testing.assert_allclose(panda.body("block").matrix, panda.body("block", panda.start).matrix, atol=1e-4)
    panda.now = lifted
    panda.do("place", {"object": "block", "at": [0.5, 0.2], "onto": "table"})
    np.testing.assert_allclose(panda.body("block").p, [0.5, 0.2, 0.225], atol=1e-4)
    np.testing.assert_allclose(panda.body("block").R, np.eye(3), atol=1e-3)
    panda.now = lifted
    panda.do("place", {"object": "block", "at": [0.5, 0.2], "onto": "table", "yaw": "30 deg"})
    assert panda.body("block").rpy[2] == pytest.approx(np.radians(30), abs=1e-3)


def test_a_support_that_was_moved_is_where_it_was_moved_to(bench: Make) -> None:
    table = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    block = "  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 0.1, rests_on: table, at: [0.5, -0.15]}\n"
    foot = "  foot: {box: {size: [6 cm, 6 cm, 4 cm]}, mass: 0.1, rests_on: table, at: [0.5, 0.1]}\n"
    panda = bench("panda", table + block + foot)
    panda.do("pick", {"object": "foot", "approach": {"from": "top"}})
    panda.do("lift", {"object": "foot"})
    panda.do("place", {"object": "foot", "at": [0.6, 0.2], "onto": "table"})
    panda.do("pick", {"object": "block", "approach": {"from": "top"}})
    panda.do("lift", {"object": "block"})
    refusal = panda.refused("place", {"object": "block", "at": [0.5, 0.1], "onto": "foot"})
    assert refusal.cause == "[0.5, 0.1] m is outside 'foot', whose centre is at [0.6, 0.2] m"
    panda.do("place", {"object": "block", "at": [0.6, 0.2], "onto": "foot"})
    np.testing.assert_allclose(panda.body("block").p, [0.6, 0.2, 0.2 + 0.04 + 0.025], atol=2e-4)


def test_a_block_goes_inside_a_tray(bench: Make) -> None:
    scene = """
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}
  tray: {tray: {size: [0.3, 0.3, 0.02], wall: 5 mm}, rests_on: table, at: [0.55, 0.2], fixed: true}
"""
    panda = held_block(bench, scene)
    panda.do("place", {"object": "block", "at": [0.5, 0.2], "onto": "tray"})
    assert panda.body("block").p[2] == pytest.approx(0.2 + 0.005 + 0.025, abs=1e-4)


def test_the_cup_does_not_go_back_through_what_was_poured_out(bench: Make) -> None:
    """A rod of 10 cm, predicted upright in the tray, ends 5 cm above its rim: above the lip, which is at 4 cm."""
    scene = """
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  cup: {cup: {radius: 36 mm, height: 110 mm, wall: 4 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}
  rod: {cylinder: {radius: 8 mm, height: 100 mm}, mass: 10 g, inside: cup}
  tray: {tray: {size: [0.3, 0.3, 0.05]}, rests_on: desk, at: [0.70, 0.32], fixed: true}
"""
    arm = bench(scene=scene)
    arm.do("pick", {"object": "cup", "grasp": {"posture": "wrap", "height": "68 mm"}})
    arm.do("lift", {"object": "cup"})
    pour = {"object": "cup", "into": "tray", "tilt": "125 deg"}
    refusal = arm.refused("pour", {**pour, "clearance": "4 cm"})
    assert "'cup' still touches 'rod' at t = 0.00 s of 'tilt back'" in refusal.cause
    assert refusal.hint == "pour from higher, `clearance: ...`: what is poured out is in the way"
    arm.do("pour", {**pour, "clearance": "12 cm"})


REGION = {"object": "block", "onto": "table", "region": {"box": {"centre": [0.5, 0.2], "size": ["20 cm", "30 cm"]}}}


def test_a_place_in_a_region_keeps_away_from_what_stands_there(bench: Make) -> None:
    """The centre if it is free; else a place in the rectangle with 10 mm to every other body, by their edges."""
    panda = held_block(bench)
    lifted = panda.now
    panda.do("place", REGION)
    np.testing.assert_allclose(panda.body("block").p, [0.5, 0.2, 0.225], atol=1e-4)
    post = "  post: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 0.1, rests_on: table, at: [0.5, 0.2]}\n"
    crowd = held_block(bench, TABLE + post)
    crowd.do("place", REGION)
    x, y, z = crowd.body("block").p
    assert abs(x - 0.5) <= 0.1 and abs(y - 0.2) <= 0.15 and z == pytest.approx(0.225, abs=1e-4)
    assert max(abs(x - 0.5), abs(y - 0.2)) >= 0.04 + 0.01 - 1e-6  # both are squares of 4 cm along the axes
    assert not np.allclose(lifted.position, crowd.now.position)
    small = {**REGION, "region": {"box": {"centre": [0.5, 0.2], "size": ["2 cm", "2 cm"]}}}
    refusal = held_block(bench, TABLE + post).refused("place", small)
    assert "all 128 candidates failed" in refusal.cause and "is within 10 mm of 'post' (128 of 128)" in refusal.cause
    assert refusal.hint == "make `region` larger, or move 'post'"
    assert "post" in refusal.parts


def test_a_region_off_its_support_is_refused_at_once(bench: Make) -> None:
    panda = held_block(bench)
    off = {**REGION, "region": {"box": {"centre": [1.5, 0.2], "size": ["20 cm", "30 cm"]}}}
    refusal = panda.refused("place", off)
    assert refusal.loc == ("region",)
    assert refusal.cause.startswith("no place in the region is on 'table': [1.5, 0.2] m is outside 'table'")
    assert refusal.hint == "`region` is in the world frame; 'table' offers 0.6 m x 0.8 m about its centre"
    half = {**REGION, "region": {"box": {"centre": [0.45, 0.42], "size": ["10 cm", "20 cm"]}}}
    panda.do("place", half)  # its centre is beside the table
    assert panda.body("block").p[1] < 0.4


def test_a_region_in_a_tray_is_not_crowded_by_the_table_under_its_thin_floor(bench: Make) -> None:
    """The table is 5 mm below the block, nearer than the 10 mm beside it, but no wall of the tray is."""
    tray = "  tray: {tray: {size: [0.3, 0.3, 0.02], wall: 5 mm}, rests_on: table, at: [0.5, 0.2], fixed: true}\n"
    panda = held_block(bench, TABLE + tray)
    panda.do("place", {**REGION, "onto": "tray"})
    np.testing.assert_allclose(panda.body("block").p, [0.5, 0.2, 0.2 + 0.005 + 0.025], atol=1e-4)


def test_a_region_needs_a_support_and_no_other_place(bench: Make) -> None:
    arm = bench("panda")
    box = {"box": {"centre": [0.5, 0.2], "size": [0.1, 0.1]}}
    assert arm.problems("place", {"object": "block", "region": box}) == [
        (("region",), "`region` needs a supporting body", "add `onto: BODY`")
    ]
    assert arm.problems("place", {"object": "block", "region": box, "at": [0.5, 0.2], "onto": "table"}) == [
        (("region",), "`region` and `at` both set the place", "remove one of them")
    ]


def test_a_place_is_said_completely_and_consistently(bench: Make) -> None:
    arm = bench()
    assert arm.problems("place", {"object": "cup", "at": [0.7, 0]}) == [
        (("at",), "`at: [x, y]` needs a supporting body", "add `onto: BODY`")
    ]
    assert arm.problems("place", {"object": "cup", "at": [0.7, 0], "onto": "deks"}) == [
        (("onto",), "'deks' is not in the scene", "did you mean 'desk'?")
    ]
    assert arm.problems("place", {"object": "cup", "at": [0.7, 0], "onto": "cup"})[0][1] == (
        "'cup' cannot be placed on itself"
    )
    start = {"object": "cup", "at": "start", "onto": "desk", "yaw": 1.0}
    assert [loc for loc, _, _ in arm.problems("place", start)] == [("onto",), ("yaw",)]
    assert arm.problems("place", {"object": "cup", "onto": "desk", "yaw": 1.0}) == []
    assert arm.problems("pour", {"object": "cup", "into": "cup"})[0][1] == "'cup' cannot be poured into itself"
    assert arm.problems("pour", {"object": "cup", "into": "trey"})[0][2] == "did you mean 'tray'?"


@pytest.mark.slow
def test_bodies_of_every_shape_are_picked_and_placed(bench: Make, tmp_path: Any) -> None:
    """A cylinder, a mesh (an octahedron prism) and a URDF body: each goes 30 cm to the left."""
    corners = [(0.02 * np.cos(a), 0.02 * np.sin(a)) for a in np.arange(8) * np.pi / 4]
    lines = [f"v {x:.6f} {y:.6f} {z}" for z in (0.0, 0.06) for x, y in corners]
    for k in range(8):
        j = (k + 1) % 8
        lines += [f"f {k + 1} {j + 1} {j + 9}", f"f {k + 1} {j + 9} {k + 9}"]
    lines += [f"f 1 {k + 2} {k + 1}" for k in range(1, 7)] + [f"f 9 {k + 9} {k + 10}" for k in range(1, 7)]
    mesh = tmp_path / "prism.obj"
    mesh.write_text("\n".join(lines) + "\n")
    urdf = tmp_path / "bar.urdf"
    urdf.write_text(
        '<robot name="bar"><link name="bar"><inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0"'
        ' iyy="1e-4" iyz="0" izz="1e-4"/></inertial><collision><geometry><box size="0.03 0.08 0.05"/></geometry>'
        "</collision></link></robot>"
    )
    for shape, height in (
        ("cylinder: {radius: 2 cm, height: 6 cm}, mass: 0.1", 0.0),
        (f"mesh: {{file: {mesh}}}, mass: 0.1", 0.0),
        (f"urdf: {{file: {urdf}}}", 0.025),
    ):
        table = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
        panda = bench("panda", table + f"  thing: {{{shape}, rests_on: table, at: [0.5, -0.1]}}\n")
        panda.do("pick", {"object": "thing", "approach": {"from": "top"}})
        panda.do("lift", {"object": "thing"})
        panda.do("place", {"object": "thing", "at": [0.5, 0.2], "onto": "table"})
        np.testing.assert_allclose(panda.body("thing").p, [0.5, 0.2, 0.2 + height], atol=2e-4)


@pytest.mark.slow
def test_what_is_placed_in_an_open_urdf_stands_on_its_floor(bench: Make, tmp_path: Any) -> None:
    """A drawer of five boxes, 4 cm high with a floor of 1 cm: not on the top of the box about it."""
    sides = [f"{x} {y} 0.02, {0.01 if x else 0.2} {0.01 if y else 0.2} 0.04" for x, y in DRAWER_SIDES]
    for name, parts in (("drawer", ["0 0 0.005, 0.2 0.2 0.01", *sides]), ("frame", sides)):
        shapes = "".join(
            f'<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'
            for xyz, size in (part.split(", ") for part in parts)
        )
        (tmp_path / f"{name}.urdf").write_text(f'<robot name="{name}"><link name="{name}">{shapes}</link></robot>')
    scene = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    scene += f"  drawer: {{urdf: {{file: {tmp_path}/drawer.urdf}}, fixed: true, rests_on: table, at: [0.5, 0.2]}}\n"
    scene += f"  frame: {{urdf: {{file: {tmp_path}/frame.urdf}}, fixed: true, pose: {{xyz: [0.5, -0.5, 0.2]}}}}\n"
    scene += "  cube: {box: {size: [3 cm, 3 cm, 3 cm]}, mass: 50 g, rests_on: table, at: [0.5, -0.1]}\n"
    panda = bench("panda", scene)
    panda.do("pick", {"object": "cube", "approach": {"from": "top"}})
    panda.do("lift", {"object": "cube"})
    beside = panda.refused("place", {"object": "cube", "at": [0.5, 0.31], "onto": "drawer"})
    assert "is outside 'drawer'" in beside.cause
    through = panda.refused("place", {"object": "cube", "at": [0.5, -0.5], "onto": "frame"})
    assert "no part of 'frame' is below 'cube'" in through.cause
    assert through.hint == "choose `at` over a part of 'frame'"
    panda.do("place", {"object": "cube", "at": [0.5, 0.2], "onto": "drawer"})
    np.testing.assert_allclose(panda.body("cube").p, [0.5, 0.2, 0.2 + 0.01 + 0.015], atol=3e-4)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-7.0, 7.0])
def test_a_cup_that_turned_in_the_hand_is_put_down_on_its_edge_where_the_arm_would_touch_the_desk(
    story: Story, degrees: float
) -> None:
    """Turned one way the arm behind the hand would come too low; the other way all is free."""
    bench, before = story.bench, story.steps["place"][0]
    cup, ball = (bench.scene.movable.index(bench.scene.body(name)) for name in ("cup", "ball"))
    link = before.carried.link
    X_WL = bench.planner.kinematics.forward(before.position, link)
    turned = bench.body("cup", before) @ Transform.of(rpy=(0.0, np.radians(degrees), 0.0))
    carried = replace(before.carried, X_LO=X_WL.inverse() @ turned)
    bodies = list(before.bodies)
    bodies[ball] = Transform.of(xyz=(0.7, 0.3, 0.42))
    bodies[cup] = turned
    bench.now = replace(before, bodies=tuple(bodies), carried=carried)
    plan = bench.plan("place", {"object": "cup"})
    X_TO = np.linalg.inv(bench.tool(bench.now.position)) @ turned.matrix
    down = bench.tools(bench.now, plan, "lower")[-1] @ X_TO
    assert np.degrees(np.arccos(down[2, 2])) == pytest.approx(LEANING[degrees], abs=0.01)
    angle = np.linspace(0.0, 2 * np.pi, 3600)
    bottom = np.column_stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), np.zeros(3600)]) @ down[:3, :3].T
    assert bottom[:, 2].min() + down[2, 3] == pytest.approx(0.4, abs=2e-4), "the lowest of it is on the desk"
    np.testing.assert_allclose(
        bench.body("cup", plan.end).matrix, story.steps["place"][1].end.bodies[cup].matrix, atol=1e-3
    )


@pytest.mark.parametrize("yaw", [0.0, 30.0, 45.0, 90.0])
@pytest.mark.parametrize("kind", ["cylinder", "box"])
def test_what_leans_stands_on_its_lowest_edge_however_it_is_turned(yaw: float, kind: str) -> None:
    """A box of 4 x 20 x 10 cm, or a cylinder; a hand that points along x."""
    size = np.array([0.04, 0.2, 0.1]) if kind == "box" else np.array([0.08, 0.08, 0.1])
    body = SimpleNamespace(kind=kind, size=size, centre=np.zeros(3))
    X_WG = Transform.of(xyz=(0.5, 0.1, 0.45), rpy=(0.0, 0.0, np.radians(yaw)))
    X_WT = Transform.of(xyz=(0.5, 0.1, 0.45), R=np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]))
    X_OT = X_WG.inverse() @ X_WT
    X_WO = _tilted(cast(Any, body), X_WG, X_OT, np.radians(4.0))
    angle = np.linspace(0.0, 2 * np.pi, 3600)
    rim = np.column_stack([0.04 * np.cos(angle), 0.04 * np.sin(angle), np.full(3600, -0.05)])
    corners = np.array([[x, y, -0.05] for x in (-0.02, 0.02) for y in (-0.1, 0.1)])
    assert X_WO.apply(corners if kind == "box" else rim)[:, 2].min() == pytest.approx(0.4, abs=1e-6)
    assert np.degrees(np.arccos(X_WO.R[2, 2])) == pytest.approx(4.0)
    assert (X_WO @ X_OT).R[2, 2] == pytest.approx(-np.sin(np.radians(4.0))), "the hand points down"


@pytest.mark.slow
def test_what_is_in_the_way_of_a_place_is_told_with_what_a_place_can_do(bench: Make) -> None:
    """A wall of 30 cm on the way; a narrow tray, into which the hand fits when it is turned."""
    table = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    block = "  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.2]}\n"
    wall = "  wall: {box: {size: [0.5, 2 cm, 30 cm]}, rests_on: table, at: [0.55, 0], fixed: true}\n"
    tray = "  tray: {tray: {size: [20 cm, 13 cm, 5 cm]}, rests_on: table, at: [0.5, 0.2], fixed: true}\n"
    over = {"object": "block", "at": [0.5, 0.2], "onto": "table"}
    into = {"object": "block", "at": [0.5, 0.2], "onto": "tray"}
    for thing, lift, spec, told, cure in (
        (wall, 0.14, over, "`clearance: ...`", {"clearance": [0.3, 0.4]}),
        (tray, 0.14, into, "`yaw: ...`", {"yaw": np.pi / 2}),
    ):
        arm = bench("panda", scene=table + block + thing)
        arm.do("pick", {"object": "block", "approach": {"from": "top", "yaw": 0}})
        arm.do("lift", {"object": "block", "by": lift})
        assert told in arm.refused("place", spec).hint
        if thing is wall:
            arm.do("lift", {"object": "block", "by": 0.16})
        arm.do("place", {**spec, **cure})


@pytest.mark.slow
def test_a_hand_that_does_not_fit_where_it_lowers_is_told_to_take_the_object_higher(bench: Make) -> None:
    """A bottle of 20 cm, held at half its height, and a tray with a rim of 8 cm, which the palm meets."""
    desk = "\n  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}\n"
    bottle = "  bottle: {cylinder: {radius: 3 cm, height: 20 cm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}\n"
    bowl = "  bowl: {tray: {size: [0.2, 0.2, 0.08]}, rests_on: desk, at: [0.70, 0.32], fixed: true}\n"
    spec = {"object": "bottle", "at": [0.70, 0.32], "onto": "bowl"}

    def held(height: float) -> Any:
        arm = bench(scene=desk + bottle + bowl)
        arm.do(
            "pick", {"object": "bottle", "approach": {"from": "side"}, "grasp": {"posture": "wrap", "height": height}}
        )
        arm.do("lift", {"object": "bottle", "by": 0.15})
        return arm

    refusal = held(0.1).refused("place", spec)
    assert "'bowl' comes within 4 mm of 'robot/palm'" in refusal.cause
    assert "grasp the object higher, `grasp: {height: ...}`" in refusal.hint
    held(0.13).do("place", spec)
