"""Where bodies come to stand, and every fault of a scene that is found before anything runs."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.geometry import Transform
from manipcli.description.packages import Packages
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Box, Cylinder
from manipcli.spec.scene import BodySpec, FrameSpec
from manipcli.spec.task import TaskSpec

DESK: dict[str, Any] = {"box": {"size": [0.6, 1.0, 0.4]}, "pose": {"xyz": [0.85, 0, 0.2]}, "fixed": True}
CUP: dict[str, Any] = {"cup": {"radius": 0.036, "height": 0.11, "wall": 0.004}, "mass": 0.15}
BALL: dict[str, Any] = {"sphere": {"radius": 0.014}, "mass": 0.01}
CUBE: dict[str, Any] = {"box": {"size": [0.1, 0.1, 0.1]}, "mass": 1.0}


def task(scene: dict[str, Any], **more: Any) -> TaskSpec:
    return TaskSpec.model_construct(
        **{
            "task": "t",
            "scene": {name: BodySpec.model_validate(body) for name, body in scene.items()},
            "frames": {name: FrameSpec.model_validate(f) for name, f in more.pop("frames", {}).items()},
            **more,
        }
    )


def built(scene: dict[str, Any], **more: Any) -> Scene:
    return build_scene(task(scene, **more))


def findings(scene: dict[str, Any], **more: Any) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as caught:
        built(scene, **more)
    return caught.value.findings


def only(scene: dict[str, Any], **more: Any) -> Diagnostic:
    (found,) = findings(scene, **more)
    return found


def test_floor_comes_first_and_its_top_is_at_zero() -> None:
    scene = built({"desk": DESK, "cup": CUP | {"rests_on": "desk", "at": [0.75, 0.0]}})
    assert [body.name for body in scene.bodies] == ["floor", "desk", "cup"]
    floor = scene.body("floor")
    assert floor.fixed
    assert floor.X_WO.p[2] + floor.size[2] / 2 == pytest.approx(0.0, abs=1e-15)
    assert [body.name for body in scene.movable] == ["cup"]


def test_a_scene_without_floor_has_none() -> None:
    assert [body.name for body in built({"desk": DESK}, floor=False).bodies] == ["desk"]


@pytest.mark.parametrize(
    ("body", "height"),
    [(CUP, 0.4), (CUBE, 0.45), (BALL, 0.414), ({"cylinder": {"radius": 0.1, "height": 0.2}, "mass": 1.0}, 0.4)],
)
def test_what_rests_on_a_desk_touches_its_top(body: dict[str, Any], height: float) -> None:
    made = built({"desk": DESK, "thing": body | {"rests_on": "desk", "at": [0.7, 0.1], "yaw": 0.3}}).body("thing")
    np.testing.assert_allclose(made.X_WO.p, [0.7, 0.1, height], atol=1e-15)
    np.testing.assert_allclose(made.X_WO.rpy, [0.0, 0.0, 0.3], atol=1e-15)


def test_a_tower_is_built_whatever_its_order() -> None:
    tower = {
        "top": CUBE | {"rests_on": "middle", "at": [0.0, 0.0]},
        "middle": CUBE | {"rests_on": "bottom", "at": [0.0, 0.0]},
        "bottom": {"cylinder": {"radius": 0.2, "height": 0.3}, "mass": 1.0, "rests_on": "floor", "at": [0.0, 0.0]},
    }
    for order in itertools.permutations(tower):
        scene = built({name: tower[name] for name in order})
        assert [body.name for body in scene.bodies] == ["floor", *order]
        heights = [scene.body(name).X_WO.p[2] for name in ("bottom", "middle", "top")]
        np.testing.assert_allclose(heights, [0.0, 0.35, 0.45], atol=1e-15)


def test_what_is_inside_a_cup_lies_on_its_floor() -> None:
    cup = CUP | {"rests_on": "desk", "at": [0.75, 0.0]}
    scene = built({"ball": BALL | {"inside": "cup"}, "desk": DESK, "cup": cup})
    np.testing.assert_allclose(scene.body("ball").X_WO.p, [0.75, 0.0, 0.4 + 0.004 + 0.014], atol=1e-15)


def test_what_is_inside_a_turned_tray_lies_on_its_floor() -> None:
    tray = {"tray": {"size": [0.3, 0.2, 0.05], "wall": 0.01}, "pose": {"xyz": [1, 2, 3], "rpy": [0, 0, 0.5]}, "mass": 1}
    scene = built({"tray": tray, "box": CUBE | {"inside": "tray", "yaw": 0.25}})
    np.testing.assert_allclose(scene.body("box").X_WO.p, [1, 2, 3 + 0.01 + 0.05], atol=1e-12)
    np.testing.assert_allclose(scene.body("box").X_WO.R, Transform.of(rpy=(0, 0, 0.75)).R, atol=1e-12)


@pytest.mark.parametrize(("place", "yaw"), [((0.75, 0.0), 0.0), ((0.7, 0.2), 0.5)])
def test_several_lie_inside_and_go_along_with_it(place: tuple[float, float], yaw: float) -> None:
    cup = CUP | {"rests_on": "desk", "at": place, "yaw": yaw}
    balls = {f"ball_{k}": BALL | {"inside": "cup", "at": [x, 0.0]} for k, x in enumerate((-0.016, 0.016))}
    scene = built({"desk": DESK, "cup": cup} | balls)
    off = 0.016 * np.array([np.cos(yaw), np.sin(yaw)])
    np.testing.assert_allclose(scene.body("ball_0").X_WO.p, [*(place - off), 0.4 + 0.004 + 0.014], atol=1e-12)
    np.testing.assert_allclose(scene.body("ball_1").X_WO.p, [*(place + off), 0.4 + 0.004 + 0.014], atol=1e-12)


def test_two_in_the_middle_are_refused_and_told_the_way() -> None:
    cup = CUP | {"rests_on": "desk", "at": [0.75, 0.0]}
    two = {name: BALL | {"inside": "cup"} for name in ("a", "b")}
    hint = only({"desk": DESK, "cup": cup} | two).hint
    assert hint == "'a' and 'b' are at the centre of 'cup'; move one with `at: [X, Y]`"
    two["a"] |= {"at": [0.01, 0.0]}
    hint = only({"desk": DESK, "cup": cup} | two).hint
    assert hint == "'b' is at the centre of 'cup'; move it with `at: [X, Y]`"


def test_what_would_reach_through_the_wall_is_refused_with_the_excess() -> None:
    """A hollow of 32 mm, a ball of 14 mm: 18 mm off its middle is the most, and in a tray 90 mm."""
    cup = CUP | {"rests_on": "desk", "at": [0.75, 0.0]}
    found = only({"desk": DESK, "cup": cup, "ball": BALL | {"inside": "cup", "at": [0.023, 0.0]}})
    assert found.message == "'ball' is 5 mm outside the interior of 'cup'"
    assert found.hint == "`at` is relative to the centre of 'cup', along its axes"
    assert built({"desk": DESK, "cup": cup, "ball": BALL | {"inside": "cup", "at": [0.018, 0.0]}})  # touches the wall
    found = only({"desk": DESK, "cup": cup, "ball": BALL | {"inside": "cup", "at": [0.01801, 0.0]}})
    assert found.message == "'ball' is 0.01 mm outside the interior of 'cup'"
    tray = {"tray": {"size": [0.3, 0.2, 0.05], "wall": 0.01}, "rests_on": "floor", "at": [0, 0], "mass": 1}
    assert built({"tray": tray, "box": CUBE | {"inside": "tray", "at": [-0.0899, 0.0399]}})
    found = only({"tray": tray, "box": CUBE | {"inside": "tray", "at": [-0.05, 0.047]}})
    assert "7 mm outside the interior of 'tray'" in found.message


@pytest.mark.parametrize("rpy", [[np.pi, 0, 0], [0, np.pi / 2, 0], [0.1, 0, 0]])
def test_nothing_is_put_inside_or_on_what_is_tilted(rpy: list[float]) -> None:
    cup = CUP | {"pose": {"xyz": [0, 0, 1], "rpy": rpy}}
    for placed in ({"inside": "cup"}, {"rests_on": "cup", "at": [0, 0]}):
        found = only({"cup": cup, "ball": BALL | placed})
        assert (found.code, found.hint) == ("TASK224", "use `pose` instead")
        assert found.message.endswith("'cup': it is tilted")


def test_hollow_of_cup_and_tray_end_at_walls_floor_and_rim() -> None:
    tray = {"tray": {"size": [0.3, 0.2, 0.05], "wall": 0.01}, "pose": {"xyz": [2, 0, 0]}, "mass": 1}
    scene = built({"cup": CUP | {"rests_on": "floor", "at": [0.0, 0.0]}, "tray": tray})
    cup, hollow = scene.body("cup").interior, scene.body("tray").interior
    assert cup is not None
    assert hollow is not None
    assert isinstance(cup.shape, Cylinder)
    assert (cup.shape.radius, cup.shape.length) == pytest.approx((0.032, 0.106))
    np.testing.assert_allclose(cup.X_OS.p, [0.0, 0.0, 0.057])
    assert isinstance(hollow.shape, Box)
    assert hollow.shape.size == pytest.approx((0.28, 0.18, 0.04))
    np.testing.assert_allclose(hollow.X_OS.p, [0.0, 0.0, 0.03])


def test_no_wall_of_a_cup_reaches_into_its_hollow_and_no_gap_is_left_between_walls() -> None:
    cup = built({"cup": CUP | {"rests_on": "floor", "at": [0.0, 0.0]}}).body("cup")
    angles = np.linspace(0.0, 2 * np.pi, 721)
    for radius, filled in ((0.03199, False), (0.034, True), (0.0359, True)):
        points = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full_like(angles, 0.05)], axis=-1)
        hit = np.zeros(len(points), dtype=bool)
        for wall in cup.geometries[1:]:
            assert isinstance(wall.shape, Box)
            hit |= np.all(np.abs((points - wall.X_LS.p) @ wall.X_LS.R) <= np.array(wall.shape.size) / 2, axis=-1)
        # Outside the middle of the walls neighbours gape at the outer corners; that is no way through.
        assert np.all(hit == filled) if radius < 0.035 else np.mean(hit) > 0.9


def test_fixed_bodies_weigh_nothing_and_movable_ones_what_is_written() -> None:
    scene = built({"desk": DESK | {"mass": 20.0}, "cube": CUBE | {"rests_on": "desk", "at": [0.7, 0.0]}})
    assert scene.body("desk").mass == 0.0
    assert scene.body("cube").mass == 1.0
    np.testing.assert_allclose(scene.body("cube").inertia, np.eye(3) * (0.01 / 6), rtol=1e-12)


def test_frames_hang_on_world_and_bodies() -> None:
    scene = built({"desk": DESK}, frames={"drop": {"parent": "desk", "pose": {"xyz": [0, 0, 0.3]}}, "view": {}})
    assert [(frame.name, frame.parent) for frame in scene.frames] == [("drop", "desk"), ("view", "world")]
    np.testing.assert_allclose(scene.frames[0].X_PF.p, [0, 0, 0.3])


def test_a_pose_in_a_frame_is_the_product_of_the_poses() -> None:
    """Of a body, a named frame, a part, and a part that every body has; by matrices."""
    turned = DESK | {
        "pose": {"xyz": [0.8, 0.1, 0.2], "rpy": [0, 0, 0.7]},
        "parts": {"edge": {"pose": {"xyz": [0, 0.4, 0.2]}}},
    }
    frames = {"drop": {"parent": "desk", "pose": {"xyz": [0.1, 0, 0.5], "rpy": [0.3, 0, 0]}}}
    own = {"xyz": [0.02, 0.03, 0.9], "rpy": [0.1, 0.2, 0.3]}
    X_WD, X_FO = Transform.of(xyz=(0.8, 0.1, 0.2), rpy=(0, 0, 0.7)).matrix, Transform.of(**own).matrix
    for frame, X_DF in (
        ("desk", Transform.identity()),
        ("drop", Transform.of(xyz=(0.1, 0, 0.5), rpy=(0.3, 0, 0))),
        ("desk/edge", Transform.of(xyz=(0, 0.4, 0.2))),
        ("desk/top", Transform.of(xyz=(0, 0, 0.2))),
    ):
        scene = built({"x": CUBE | {"pose": own, "frame": frame}, "desk": turned}, frames=frames)
        np.testing.assert_allclose(scene.body("x").X_WO.matrix, X_WD @ X_DF.matrix @ X_FO, atol=1e-12)


def test_what_rests_at_a_point_of_a_frame_turns_with_it() -> None:
    turned = DESK | {"pose": {"xyz": [0.8, 0.1, 0.2], "rpy": [0, 0, 0.7]}}
    scene = built({"desk": turned, "x": CUBE | {"rests_on": "desk", "frame": "desk", "at": [0.1, -0.2], "yaw": 0.2}})
    X_WO = scene.body("x").X_WO
    np.testing.assert_allclose(X_WO.p[:2], Transform.of(xyz=(0.8, 0.1, 0), rpy=(0, 0, 0.7)).apply([0.1, -0.2, 0])[:2])
    assert X_WO.rpy[2] == pytest.approx(0.9)


def test_parts_are_frames_of_their_body_and_every_body_has_some() -> None:
    cup = CUP | {
        "rests_on": "floor",
        "at": [0, 0],
        "parts": {"handle": {"pose": {"xyz": [0.04, 0, 0.05]}, "size": [1, 2, 3]}},
    }
    scene = built({"cup": cup, "desk": DESK})
    handle = scene.frame("cup/handle")
    assert handle is not None and handle.parent == "cup" and handle.size is not None
    np.testing.assert_array_equal(handle.X_PF.p, [0.04, 0, 0.05])
    np.testing.assert_array_equal(handle.size, [1, 2, 3])
    assert scene.parts("cup") == ("handle", "top", "bottom", "rim")
    assert scene.parts("desk") == ("top", "bottom")
    assert scene.frame("desk/rim") is None and scene.frame("dusk/top") is None
    assert [frame.name for frame in scene.frames] == ["cup/handle"]  # what a log has: the written ones


@pytest.mark.parametrize(
    ("bodies", "code", "words", "hint"),
    [
        ({"x": {"frame": "dask"}}, "TASK291", "'dask' is not in the scene", "'desk'"),
        ({"x": {"frame": "desk/tpo"}}, "TASK291", "'desk' has no part 'tpo'", "'top'"),
        ({"x": {"frame": "desk/rim"}}, "TASK291", "'desk' has no part 'rim'", "parts of 'desk': top, bottom"),
        ({"x": {"frame": "tool"}}, "TASK291", "'tool' is a frame of the robot", "`world`"),
        ({"x": {"parts": {"a/b": {}}}}, "TASK290", "invalid name of a part: 'a/b'", "without '/'"),
        ({"x": {"frame": "x"}}, "TASK225", "x -> x", ""),
        ({"x": {"frame": "y/top"}, "y": {"frame": "x"}}, "TASK225", "circular placement", ""),
    ],
)
def test_each_fault_of_a_frame_or_a_part_is_found(bodies: dict[str, Any], code: str, words: str, hint: str) -> None:
    found = findings({"desk": DESK, **{name: CUBE | {"pose": {}} | body for name, body in bodies.items()}})
    assert found[0].code == code and words in found[0].message and hint in (found[0].hint or "")


def test_a_tilted_frame_gives_no_place_to_rest() -> None:
    tilted = {"slope": {"parent": "desk", "pose": {"rpy": [0.1, 0, 0]}}}
    found = findings({"desk": DESK, "x": CUBE | {"rests_on": "desk", "frame": "slope", "at": [0, 0]}}, frames=tilted)
    assert [(each.code, each.message) for each in found] == [
        ("TASK292", "'slope' is tilted: its `at: [x, y]` is not level")
    ]


def test_a_finding_carries_its_place() -> None:
    where = {("scene", "ball", "inside"): Place("pour.yaml", 7, 40)}
    spec = task({"desk": DESK, "cup": CUP | {"rests_on": "desk", "at": [0.75, 0]}, "ball": BALL | {"inside": "cop"}})
    with pytest.raises(InvalidInput) as caught:
        build_scene(spec, place=where.get)
    (found,) = caught.value.findings
    assert found.place == Place("pour.yaml", 7, 40)
    assert "'cop' is not in the scene" in found.message
    assert found.hint == "did you mean 'cup'?"


@pytest.mark.parametrize(
    ("scene", "code", "words"),
    [
        ({"x": {"mass": 1, "pose": {}}}, "TASK221", "no shape"),
        ({"x": CUBE | BALL | {"pose": {"xyz": [0, 0, 1]}}}, "TASK221", "2 shapes (box, sphere)"),
        (
            {"x": {"cup": {"radius": 0.03, "height": 0.1, "wall": 0.03}, "mass": 1, "pose": {}}},
            "TASK222",
            "no interior",
        ),
        ({"x": {"tray": {"size": [0.3, 0.01, 0.1]}, "mass": 1, "pose": {}}}, "TASK222", "no interior"),
        ({"x": {"box": {"size": [1, 1, 1]}, "pose": {"xyz": [0, 0, 1]}}}, "TASK223", "no mass"),
        ({"x": CUBE}, "TASK224", "no place"),
        ({"x": CUBE | {"pose": {"xyz": [0, 0, 1]}, "inside": "x"}}, "TASK224", "2 placements (pose, inside)"),
        ({"x": CUBE | {"pose": {"xyz": [0, 0, 1]}, "yaw": 1.0}}, "TASK224", "`pose` and `yaw`"),
        ({"x": CUBE | {"rests_on": "floor"}}, "TASK224", "without `at"),
        ({"x": CUBE | {"pose": {"xyz": [0, 0, 1]}, "at": [0, 0]}}, "TASK224", "`pose` and `at`"),
        ({"desk": DESK, "x": CUBE | {"rests_on": "desk", "at": [0.5, 0]}}, "TASK224", "not above 'desk'"),
        ({"desk": DESK, "x": BALL | {"inside": "desk"}}, "TASK224", "not a container but a box"),
        ({"x": CUBE | {"rests_on": "x", "at": [0, 0]}}, "TASK225", "x -> x"),
        ({"world": CUBE | {"pose": {"xyz": [0, 0, 1]}}}, "TASK220", "invalid name of a body: 'world'"),
        ({"a/b": CUBE | {"pose": {"xyz": [0, 0, 1]}}}, "TASK220", "'/' is not allowed"),
    ],
)
def test_each_fault_is_found(scene: dict[str, Any], code: str, words: str) -> None:
    found = only(scene)
    assert found.code == code
    assert words in found.message


def test_nothing_rests_on_a_container_a_ball_or_a_slope() -> None:
    cup = CUP | {"rests_on": "floor", "at": [0.0, 0.0]}
    assert only({"cup": cup, "x": BALL | {"rests_on": "cup", "at": [0, 0]}}).hint == "write `inside: cup`"
    ball = BALL | {"rests_on": "floor", "at": [0.0, 0.0]}
    assert "no flat top" in only({"ball": ball, "x": CUBE | {"rests_on": "ball", "at": [0, 0]}}).message
    slope = CUBE | {"pose": {"xyz": [0, 0, 1], "rpy": [0.1, 0, 0]}}
    assert "tilted" in only({"slope": slope, "x": CUBE | {"rests_on": "slope", "at": [0, 0]}}).message


def test_what_is_wider_than_the_hollow_is_refused_with_the_excess() -> None:
    cup = CUP | {"rests_on": "floor", "at": [0.0, 0.0]}
    found = only({"cup": cup, "ball": {"sphere": {"radius": 0.034}, "mass": 0.01, "inside": "cup"}})
    assert "2 mm too wide" in found.message
    tray = {"tray": {"size": [0.12, 0.12, 0.05], "wall": 0.005}, "rests_on": "floor", "at": [0, 0], "mass": 1.0}
    assert built({"tray": tray, "cube": CUBE | {"inside": "tray"}})
    found = only({"tray": tray, "cube": CUBE | {"inside": "tray", "yaw": np.pi / 4}})
    assert "15.7 mm too wide" in found.message  # half the diagonal, 70.7 mm, in a hollow of 55 mm to each side


def test_all_faults_of_a_scene_are_told_at_once() -> None:
    codes = [found.code for found in findings({"a": {"mass": 1, "pose": {}}, "b": CUBE, "c": CUBE | {"inside": "z"}})]
    assert sorted(codes) == ["TASK221", "TASK224", "TASK225"]


def test_a_circle_of_bodies_is_told_once() -> None:
    circle = {"a": CUBE | {"rests_on": "b", "at": [0, 0]}, "b": CUBE | {"rests_on": "a", "at": [0, 0]}}
    assert "a -> b -> a" in only(circle).message


def test_a_frame_needs_a_parent_and_a_name_of_its_own() -> None:
    found = only({"desk": DESK}, frames={"drop": {"parent": "dsk"}})
    assert (found.code, found.hint) == ("TASK227", "did you mean 'desk'?")
    assert "already in use" in only({"desk": DESK}, frames={"desk": {}}).message
    assert "already in use" in only({"desk": DESK}, frames={"world": {}, "a": {}}).message  # whose parent is the world
    found = only({"desk": DESK}, frames={"b": {"parent": "desk"}, "a": {"parent": "b"}})
    assert found.message == "parent 'b' is a frame; expected `world` or a body"
    assert found.hint == "use the parent 'desk' and the pose relative to it"


def test_bodies_that_start_inside_each_other_are_refused_and_touching_ones_are_not() -> None:
    def pair(gap: float) -> dict[str, Any]:
        at = {"xyz": [0.1 + gap, 0, 0.05]}
        return {"a": CUBE | {"rests_on": "floor", "at": [0, 0]}, "b": CUBE | {"pose": at}}

    assert built(pair(0.0))
    found = only(pair(-0.02))
    assert (found.code, found.message) == ("TASK226", "'a' and 'b' overlap by 20.0 mm at the start")


def test_bounding_boxes_that_overlap_are_no_fault() -> None:
    # Two balls, one diagonally above the other: their boxes overlap by 10 mm, they are 21 mm apart.
    balls = {
        "a": {"sphere": {"radius": 0.05}, "mass": 1, "pose": {"xyz": [0, 0, 0.05]}},
        "b": {"sphere": {"radius": 0.05}, "mass": 1, "pose": {"xyz": [0.09, 0, 0.14]}},
    }
    assert built(balls)


def test_two_fixed_bodies_may_overlap() -> None:
    assert built(
        {"desk": DESK, "rail": {"box": {"size": [1, 0.1, 0.1]}, "pose": {"xyz": [0.85, 0, 0.4]}, "fixed": True}}
    )


def stl(path: Path, triangles: list[list[tuple[float, float, float]]]) -> None:
    data = bytes(80) + struct.pack("<I", len(triangles))
    for triangle in triangles:
        data += struct.pack("<12fH", 0.0, 0.0, 0.0, *itertools.chain.from_iterable(triangle), 0)
    path.write_bytes(data)


def cuboid(low: tuple[float, float, float], high: tuple[float, float, float]) -> list[list[tuple[float, float, float]]]:
    corners = [tuple((low, high)[(k >> i) & 1][i] for i in range(3)) for k in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return [[corners[i] for i in part] for a, b, c, d in quads for part in ((a, b, c), (a, c, d))]  # type: ignore[misc]


def test_a_mesh_of_a_box_weighs_and_stands_like_the_box(tmp_path: Path) -> None:
    stl(tmp_path / "part.stl", cuboid((0.0, 0.0, 0.0), (100.0, 200.0, 300.0)))
    part = {"mesh": {"file": "part.stl", "scale": 0.001}, "mass": 2.0, "rests_on": "floor", "at": [0, 0]}
    made = build_scene(task({"part": part}), packages=Packages(tmp_path / "task.yaml")).body("part")
    np.testing.assert_allclose(made.X_WO.p, [0, 0, 0], atol=1e-7)
    np.testing.assert_allclose(made.size, [0.1, 0.2, 0.3], rtol=1e-6)
    np.testing.assert_allclose(made.X_OI.p, [0.05, 0.1, 0.15], rtol=1e-6)
    along_body = made.X_OI.R @ made.inertia @ made.X_OI.R.T
    box = 2.0 / 12 * np.diag([0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2])
    np.testing.assert_allclose(along_body, box, rtol=1e-6, atol=1e-9)  # the file's numbers are single precision


@pytest.mark.parametrize("shape", [{"cylinder": {"radius": 20, "height": 80}}, {"box": {"size": [0.1, 10.1, 0.1]}}])
def test_what_can_move_is_not_as_long_as_a_house(shape: dict[str, Any]) -> None:
    body = shape | {"pose": {"xyz": [0, 0, 50]}}
    found = only({"x": body | {"mass": 1}})
    longest = max(next(iter(shape.values())).get("size", [80]))
    assert (found.code, found.message) == ("TASK222", f"body 'x' is {longest} m long; movable bodies are at most 10 m")
    assert found.hint == "in millimetres? write each size with its unit, such as '80 mm'; else `fixed: true`"
    built({"x": body | {"fixed": True}})
    built({"x": {"box": {"size": [10, 10, 10]}, "mass": 1, "pose": {"xyz": [0, 0, 50]}}})


def test_a_mesh_in_millimetres_is_told_its_scale(tmp_path: Path) -> None:
    stl(tmp_path / "part.stl", cuboid((0.0, 0.0, 0.0), (40.0, 40.0, 80.0)))
    mesh = {"file": "part.stl"}
    with pytest.raises(InvalidInput) as caught:
        build_scene(
            task({"x": {"mesh": mesh, "mass": 1, "pose": {}}}, floor=False), packages=Packages(tmp_path / "task.yaml")
        )
    (found,) = caught.value.findings
    assert found.hint == "in millimetres? write `scale: 0.001`; else `fixed: true`"
    scaled = task({"x": {"mesh": mesh | {"scale": 0.001}, "mass": 1, "pose": {}}}, floor=False)
    assert max(build_scene(scaled, packages=Packages(tmp_path / "task.yaml")).body("x").size) == pytest.approx(0.08)


def test_a_mesh_that_is_absent_flat_or_no_mesh_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.stl").write_text("not a mesh")
    (tmp_path / "part.step").write_text("")
    stl(tmp_path / "flat.stl", [[(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0), (0, 1, 0)]])
    for name, words in (
        ("none.stl", "is not found"),
        ("text.stl", "cannot be used"),
        ("part.step", "is not a supported mesh file"),
        ("flat.stl", "cannot be used"),
    ):
        with pytest.raises(InvalidInput) as caught:
            build_scene(
                task({"x": {"mesh": {"file": name}, "mass": 1, "pose": {}}}), packages=Packages(tmp_path / "task.yaml")
            )
        (found,) = caught.value.findings
        assert found.code == "TASK222"
        assert words in found.message


URDF = """<robot name="part">{links}</robot>"""
LINK = """
<link name="{name}">
  <inertial><origin xyz="0.1 0 0"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0.005" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
  <collision><origin xyz="0.1 0 0.2" rpy="0 1.5707963267948966 0"/>
    <geometry><box size="0.1 0.2 0.4"/></geometry></collision>
</link>"""


def test_a_urdf_of_one_link_is_a_body(tmp_path: Path) -> None:
    (tmp_path / "part.urdf").write_text(URDF.format(links=LINK.format(name="part")))
    part = {"urdf": {"file": "part.urdf"}, "rests_on": "floor", "at": [0, 0]}
    made = build_scene(task({"part": part}), packages=Packages(tmp_path / "task.yaml")).body("part")
    assert made.mass == 2.0
    np.testing.assert_allclose(made.size, [0.4, 0.2, 0.1], atol=1e-12)
    np.testing.assert_allclose(made.centre, [0.1, 0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(made.X_WO.p, [0, 0, -0.15], atol=1e-12)
    tensor = np.array([[0.02, 0.005, 0], [0.005, 0.03, 0], [0, 0, 0.04]])
    np.testing.assert_allclose(made.X_OI.R @ made.inertia @ made.X_OI.R.T, tensor, atol=1e-15)
    heavy = build_scene(task({"part": part | {"mass": 4.0}}), packages=Packages(tmp_path / "task.yaml")).body("part")
    np.testing.assert_allclose(heavy.inertia, 2 * made.inertia, rtol=1e-12)


def test_what_rests_on_a_urdf_stands_on_what_it_meets_from_above(tmp_path: Path) -> None:
    """An angle: a floor of 2 cm by 20 cm by 20 cm, and along one edge a wall of 2 cm, 30 cm high."""
    parts = (((0, 0, 0.01), "0.2 0.2 0.02"), ((0.09, 0, 0.15), "0.02 0.2 0.3"))
    shapes = "".join(
        f'<collision><origin xyz="{x} {y} {z}"/><geometry><box size="{size}"/></geometry></collision>'
        for (x, y, z), size in parts
    )
    (tmp_path / "angle.urdf").write_text(URDF.format(links=f'<link name="angle">{shapes}</link>'))
    angle = {"urdf": {"file": "angle.urdf"}, "fixed": True, "pose": {"xyz": [1, 0, 0.5]}}
    for x, z in ((1.0, 0.52), (1.09, 0.8)):
        bodies = {"angle": angle, "x": CUBE | {"rests_on": "angle", "at": [x, 0]}}
        made = build_scene(task(bodies), packages=Packages(tmp_path / "task.yaml")).body("x")
        bottom = made.X_WO.p[2] + made.centre[2] - made.size[2] / 2
        assert bottom == pytest.approx(z, abs=3e-4), x


def test_what_would_fall_through_a_urdf_is_told_where_to_stand(tmp_path: Path) -> None:
    rails = "".join(
        f'<collision><origin xyz="{x} 0 0"/><geometry><box size="0.02 0.2 0.02"/></geometry></collision>'
        for x in (-0.09, 0.09)
    )
    (tmp_path / "rails.urdf").write_text(URDF.format(links=f'<link name="rails">{rails}</link>'))
    bodies = {"rails": {"urdf": {"file": "rails.urdf"}, "fixed": True, "pose": {"xyz": [1, 0, 0.5]}}}
    bodies["x"] = CUBE | {"rests_on": "rails", "at": [1, 0]}
    with pytest.raises(InvalidInput) as caught:
        build_scene(task(bodies), packages=Packages(tmp_path / "task.yaml"))
    (told,) = caught.value.findings
    assert told.message == "'x' at [1, 0] m is not above any part of 'rails'"
    assert told.hint == "choose `at` above a part of 'rails'"


def test_a_urdf_with_errors_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.urdf").write_text(URDF.format(links="<link/>"))
    with pytest.raises(InvalidInput) as caught:
        build_scene(task({"x": {"urdf": {"file": "bad.urdf"}, "pose": {}}}), packages=Packages(tmp_path / "task.yaml"))
    assert caught.value.findings[0].code.startswith("URDF")


def test_links_that_are_fixed_to_each_other_are_one_body(tmp_path: Path) -> None:
    """Two equal links 1 m apart along x: the mass of both, its centre between them, I + m d^2 about it."""
    joint = '<joint name="j" type="fixed"><origin xyz="1 0 0"/><parent link="a"/><child link="b"/></joint>'
    (tmp_path / "two.urdf").write_text(URDF.format(links=LINK.format(name="a") + LINK.format(name="b") + joint))
    (tmp_path / "one.urdf").write_text(URDF.format(links=LINK.format(name="a")))
    at = {"pose": {"xyz": [0, 0, 1]}}
    one, two = (
        build_scene(task({"x": {"urdf": {"file": name}, **at}}), packages=Packages(tmp_path / "task.yaml"))
        for name in ("one.urdf", "two.urdf")
    )
    single, double = one.body("x"), two.body("x")
    assert double.mass == 2 * single.mass and not two.joints
    np.testing.assert_allclose(double.X_OI.p, np.add(single.X_OI.p, [0.5, 0, 0]), atol=1e-12)
    alone, both = (body.X_OI.R @ body.inertia @ body.X_OI.R.T for body in (single, double))
    np.testing.assert_allclose(both, 2 * alone + double.mass * 0.25 * np.diag([0, 1, 1]), atol=1e-12)
    np.testing.assert_allclose(double.size, np.add(single.size, [1, 0, 0]), atol=1e-12)
    part = two.frame("x/b")
    assert part is not None and part.parent == "x" and part.size is not None
    np.testing.assert_allclose(part.size, single.size, atol=1e-12)


def test_a_body_beside_its_support_is_told_where_that_is() -> None:
    desk = {"box": {"size": [0.6, 1.0, 0.4]}, "pose": {"xyz": [0.85, 0.1, 0.2]}, "fixed": True}
    told = only({"desk": desk, "x": CUBE | {"rests_on": "desk", "at": [2.75, 0]}})
    assert told.hint == "the top of 'desk' is 0.6 by 1 m, centred at [0.85, 0.1] m"
