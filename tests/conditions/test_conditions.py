"""Conditions on where things are: their margins by hand on good and spoilt states, and the same for any cut."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from manipcli.conditions.condition import CheckContext, Condition, World
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, JointType, Link
from manipcli.model.robot import Group, NamedPose, RobotModel, Tool
from manipcli.model.state import WorldState
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.spec.scene import BodySpec, FrameSpec
from manipcli.spec.task import TaskSpec

BODIES: dict[str, Any] = {
    "cup": {"cup": {"radius": 0.04, "height": 0.11, "wall": 0.01}, "mass": 0.15, "pose": {"xyz": [1, 0, 0.4]}},
    "ball": {"sphere": {"radius": 0.014}, "mass": 0.01, "inside": "cup"},
    "tray": {"tray": {"size": [0.3, 0.2, 0.05], "wall": 0.01}, "pose": {"xyz": [0.5, 0.5, 0]}, "fixed": True},
    "dish": {"cup": {"radius": 0.1, "height": 0.06, "wall": 0.01}, "pose": {"xyz": [-1, 0, 0]}, "fixed": True},
    "stick": {"cylinder": {"radius": 0.01, "height": 0.2}, "mass": 0.1, "pose": {"xyz": [0, -1, 0.5]}},
}
FRAMES = {"drop": {"pose": {"xyz": [0, 0, 1]}}, "rim": {"parent": "cup", "pose": {"xyz": [0, 0, 0.11]}}}


def joint(name: str, kind: JointType, parent: str, child: str) -> Joint:
    return Joint(name, kind, parent, child, Transform.identity(), frozen([0, 0, 1]), JointLimits())


def arm() -> RobotModel:
    return RobotModel(
        name="arm",
        root="base",
        links=tuple(Link(name, None, (), ()) for name in ("base", "one", "two", "finger")),
        joints=(
            joint("j1", "revolute", "base", "one"),
            joint("j2", "revolute", "one", "two"),
            joint("slide", "prismatic", "two", "finger"),
        ),
        groups=(Group("arm", ("j1", "j2")), Group("hand", ("slide",))),
        poses=(
            NamedPose("home", ("j1", "j2"), (0.5, -1.0)),
            NamedPose("all", ("j1", "j2", "slide"), (0.5, -1.0, 0.0)),
            NamedPose("out", ("slide",), (0.1,)),
        ),
        transmissions=(),
        X_WB=Transform.identity(),
        urdf="",
    )


def scene() -> Scene:
    spec = TaskSpec.model_construct(
        task="t",
        floor=False,
        scene={name: BodySpec.model_validate(body) for name, body in BODIES.items()},
        frames={name: FrameSpec.model_validate(frame) for name, frame in FRAMES.items()},
    )
    return build_scene(spec)


ROBOT, SCENE = arm(), scene()


def state(
    position: npt.ArrayLike = (0.0, 0.0, 0.0), poses: dict[str, Transform] | None = None, *, time: float = 0.0
) -> WorldState:
    """The start, with some bodies elsewhere."""
    where = [(poses or {}).get(body.name, body.X_WO) for body in SCENE.movable]
    return WorldState(
        time=np.array(time),
        position=np.array(position, dtype=float),
        velocity=np.zeros(3),
        effort=np.zeros(3),
        body_position=np.array([X.p for X in where]),
        body_quat_xyzw=np.array([X.quat_xyzw for X in where]),
        body_linear=np.full((len(where), 3), np.nan),
        body_angular=np.full((len(where), 3), np.nan),
    )


def window(*states: WorldState) -> StateWindow:
    """Successive states, of which the first is that before the first tick where there are several."""
    shown = states[1:] or states
    joined = WorldState(
        *(np.stack([getattr(one, name) for one in shown]) for name in WorldState.__slots__)  # type: ignore[attr-defined]
    )
    return StateWindow(joined, states[0] if len(states) > 1 else None, (), (), ())


WORLD = World(robot=ROBOT, scene=SCENE, start=state())


def opened(name: str, **written: Any) -> Any:
    condition: Condition[Any] = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    assert condition.check(spec, CheckContext(ROBOT, SCENE)) == ()
    assert condition.absent(spec, WORLD) is None
    return condition.open(spec, WORLD)


def read(name: str, *states: WorldState, **written: Any) -> Robustness:
    found: Robustness = opened(name, **written)(window(*states))
    return found


def margin(name: str, now: WorldState, **written: Any) -> float:
    found = read(name, now, **written)
    (value,) = found.margins
    told = found.found(0)
    assert (told.margin, told.at) == (value, now.time)
    assert told.unit in CONDITIONS[name].units
    assert np.sign(found.relative[0]) == np.sign(value)
    return float(value)


def ball_at(x: float, y: float, z: float) -> WorldState:
    return state(poses={"ball": Transform.of(xyz=(x, y, z))})


@pytest.mark.parametrize(
    ("p", "expected"),
    [
        # the tray's hollow: x 0.36..0.64, y 0.41..0.59, z 0.01..0.05
        ((0.5, 0.5, 0.024), 0.014),  # lying in the middle: its centre is a radius above the floor
        ((0.5, 0.5, 0.04), 0.01),  # nearer to the rim
        ((0.5, 0.585, 0.03), 0.005),  # near a wall
        ((0.5, 0.5, 0.06), -0.01),  # above the rim
        ((0.67, 0.63, 0.03), -0.05),  # off a corner: 3, 4, 5
        ((0.67, 0.5, 0.09), -0.05),  # beyond a wall and above the rim
    ],
)
def test_inside_a_box_hollow_is_the_depth_of_the_centre(p: tuple[float, float, float], expected: float) -> None:
    assert margin("inside", ball_at(*p), object="ball", of="tray") == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("p", "expected"),
    [
        # the cup's hollow: radius 0.03 about (1, 0), z 0.41..0.51
        ((1.0, 0.0, 0.46), 0.03),
        ((1.0 + 0.012, 0.016, 0.46), 0.01),
        ((1.0, 0.0, 0.52), -0.01),
        ((1.0, 0.06, 0.55), -0.05),
    ],
)
def test_inside_a_round_hollow_is_the_depth_of_the_centre(p: tuple[float, float, float], expected: float) -> None:
    assert margin("inside", ball_at(*p), object="ball", of="cup") == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("of", "p", "where"),
    [
        ("tray", (0.5, 0.5, 0.04), "10 mm deep in 'tray', its"),
        ("tray", (0.5, 0.5, 0.06), "10 mm outside 'tray', above its rim, its"),
        ("tray", (0.67, 0.5, 0.09), "50 mm outside 'tray', its"),
        ("tray", (0.5, 0.5, 0.0), "10 mm outside 'tray', its"),
        ("cup", (1.0, 0.02, 0.52), "10 mm outside 'cup', above its rim, its"),
        ("cup", (1.0, 0.06, 0.55), "50 mm outside 'cup', its"),
    ],
)
def test_what_stands_out_of_a_hollow_is_said_to_be_above_its_rim(
    of: str, p: tuple[float, float, float], where: str
) -> None:
    assert read("inside", ball_at(*p), object="ball", of=of).found(0).text.startswith(f"'ball' is {where} centre at")


@pytest.mark.parametrize(
    ("of", "deepest"), [("tray", (0.5, 0.5, 0.03)), ("cup", (1.0, 0.0, 0.46)), ("dish", (-1.0, 0.0, 0.035))]
)
def test_at_the_greatest_depth_of_a_hollow_the_relative_margin_is_one(of: str, deepest: tuple[float, ...]) -> None:
    x, y, z = deepest
    assert read("inside", ball_at(x, y, z), object="ball", of=of).relative == pytest.approx([1.0])
    assert read("outside", ball_at(x, y, z), object="ball", of=of).relative == pytest.approx([-1.0])


def test_inside_follows_a_container_that_is_carried_and_tilted() -> None:
    X_WC = Transform.of(xyz=(2.0, 1.0, 0.7), rpy=(0.3, 1.2, -0.4))
    held = X_WC.apply([0.012, 0.016, 0.05])
    now = state(poses={"cup": X_WC, "ball": Transform.of(xyz=held, rpy=(1, 2, 3))})
    assert margin("inside", now, object="ball", of="cup") == pytest.approx(0.01, abs=1e-12)


def test_inside_takes_the_middle_of_what_stands_on_its_origin() -> None:
    # The stick's frame is at its bottom; lying along y its middle is 0.1 m away from there.
    lying = Transform.of(xyz=(0.5, 0.6, 0.03), rpy=(np.pi / 2, 0, 0))
    assert margin("inside", state(poses={"stick": lying}), object="stick", of="tray") == pytest.approx(0.02, abs=1e-12)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0.6, -0.8, 0)])
@pytest.mark.parametrize("tilt", [0.0, 1e-9, 0.05, 0.2, 1.7, np.pi])
def test_upright_is_what_is_left_of_the_tilt(axis: tuple[float, float, float], tilt: float) -> None:
    quat = np.array([*(np.array(axis) * np.sin(tilt / 2)), np.cos(tilt / 2)])
    spun = Transform.of(quat_xyzw=quat) @ Transform.of(xyz=(3, 2, 1), rpy=(0, 0, 0.7))
    assert margin("upright", state(poses={"cup": spun}), object="cup", within=0.1) == pytest.approx(
        0.1 - tilt, abs=1e-12
    )


def test_a_tilt_just_beyond_is_told_with_digits_that_differ() -> None:
    tilt = np.radians(30.0) + 2e-5
    leaning = state(poses={"cup": Transform.of(rpy=(tilt, 0, 0))})
    found = read("upright", leaning, object="cup", within=np.radians(30.0)).found(0)
    assert found.margin == pytest.approx(-2e-5)
    assert found.text == "'cup' is tilted 30.001 deg; within 30 deg"


@pytest.mark.parametrize(
    ("to", "expected"),
    [
        ("start", 0.1 - 0.05),  # moved by (0.03, 0, 0.04)
        ((1.03, 0.0, 0.5), 0.1 - 0.06),
        ("drop", 0.1 - np.sqrt(1.03**2 + 0.56**2)),
        ("stick", 0.1 - np.sqrt(1.03**2 + 1 + 0.06**2)),
        ("tray", 0.1 - np.sqrt(0.53**2 + 0.5**2 + 0.44**2)),
    ],
)
def test_near_is_what_is_left_of_the_distance(to: Any, expected: float) -> None:
    moved = state(poses={"cup": Transform.of(xyz=(1.03, 0.0, 0.44))})
    assert margin("near", moved, object="cup", to=to, within=0.1) == pytest.approx(expected, abs=1e-12)


def test_near_a_frame_follows_the_body_that_it_hangs_on() -> None:
    tipped = Transform.of(xyz=(2.0, 0.0, 0.0), rpy=(0.0, np.pi / 2, 0.0))  # the rim is now 0.11 m along x
    now = state(poses={"cup": tipped, "ball": Transform.of(xyz=(2.11, 0.02, 0.0))})
    assert margin("near", now, object="ball", to="rim", within=0.05) == pytest.approx(0.03, abs=1e-12)


def test_near_compares_a_part_with_a_point_in_a_frame() -> None:
    """Both turn with their bodies; by products of poses."""
    X_WC = Transform.of(xyz=(0.3, 0.2, 0.5), rpy=(0.4, -0.2, 1.0))
    X_WS = Transform.of(xyz=(0.1, -0.4, 0.7), rpy=(1.0, 0.3, -2.0))
    now = state(poses={"cup": X_WC, "stick": X_WS})
    apart = float(np.linalg.norm(X_WC.apply([0, 0, 0.11]) - X_WS.apply([0.1, 0.2, 0.3])))
    written = {"object": "cup/rim", "to": [0.1, 0.2, 0.3], "frame": "stick"}
    assert margin("near", now, **written, within=2.0) == pytest.approx(2.0 - apart, abs=1e-12)
    assert margin("near", now, object="cup/top", to="stick/bottom", within=2.0) == pytest.approx(
        2.0 - float(np.linalg.norm(X_WC.apply([0, 0, 0.11]) - X_WS.p)), abs=1e-12
    )


def test_near_knows_links_and_refuses_what_is_fixed_to_nothing() -> None:
    now = state(position=(0.5, 0.0, 0.0))
    assert margin("near", now, object="robot/two", to="base", within=0.1) == pytest.approx(0.1, abs=1e-12)

    def problems(**written: Any) -> list[tuple[object, ...]]:
        condition: Condition[Any] = CONDITIONS["near"]
        spec = condition.spec.model_validate({"within": 0.1, **written})
        return [(p.loc, p.message) for p in condition.check(spec, CheckContext(ROBOT, SCENE))]

    assert problems(object="tool", to="cup") == [(("object",), "robot 'arm' has no tool frame")]
    assert problems(object="cup/rin", to="start") == [(("object",), "'cup' has no part 'rin'")]
    assert problems(object="cup", to="robot/tow") == [(("to",), "'tow' is not a link of robot 'arm'")]
    assert problems(object="cup", to="start", frame="stick") == [
        (("frame",), "`frame` applies to a point `to: [x, y, z]`, not to a name")
    ]
    assert problems(object="cup", to=[0, 0, 0], frame="stik") == [(("frame",), "unknown frame 'stik'")]


def test_outside_is_the_opposite_of_inside() -> None:
    for p in ((0.5, 0.5, 0.024), (0.67, 0.63, 0.03)):
        inside = margin("inside", ball_at(*p), object="ball", of="tray")
        assert margin("outside", ball_at(*p), object="ball", of="tray") == -inside


def after(dt: float, **poses: Transform) -> tuple[WorldState, WorldState]:
    """The start, and `dt` later."""
    return state(), state(poses=poses, time=dt)


def moved_by(name: str, xyz: tuple[float, float, float], rpy: tuple[float, float, float] = (0, 0, 0)) -> Transform:
    start = SCENE.body(name).X_WO
    return Transform.of(xyz=start.p + np.array(xyz), R=Transform.of(rpy=rpy).R @ start.R)


def test_at_rest_is_what_is_left_of_the_speed_of_the_middle() -> None:
    assert margin("at_rest", state(), object="ball") == 0.001
    still = read("at_rest", *after(0.001), object="ball")
    assert still.margins == pytest.approx([0.001])
    moving = read("at_rest", *after(0.001, ball=moved_by("ball", (3e-6, 0, 4e-6))), object="ball")
    assert moving.margins == pytest.approx([-0.004])
    # The stick turns about its middle, 0.1 m above its origin: the origin moves, the middle does not.
    angle = 1e-3
    turned = moved_by("stick", (-0.1 * np.sin(angle), 0.0, 0.1 * (1 - np.cos(angle))), (0.0, angle, 0.0))
    spinning = read("at_rest", *after(0.001, stick=turned), object="stick", below=0.01)
    assert spinning.margins == pytest.approx([0.01], abs=1e-4)  # a chord is shorter than its arc by angle^2 / 24
    assert read("at_rest", *after(0.001), object="tray", below=0.01).margins == [0.01]


@pytest.mark.parametrize(
    ("pose", "by", "expected", "text"),
    [
        # The tray's top is at 0.05, its edges at x 0.35..0.65, y 0.4..0.6; the cup is 0.11 high and 0.08 wide.
        (Transform.of(xyz=(0.5, 0.5, 0.12)), 0.0, 0.07, "'cup' is 70 mm above the top of 'tray'"),
        (Transform.of(xyz=(0.5, 0.5, 0.12)), 0.1, -0.03, "'cup' is 70 mm above the top of 'tray'; at least 100 mm"),
        (Transform.of(xyz=(0.5, 0.5, 0.04)), 0.0, -0.01, "'cup' is 10 mm below the top of 'tray'"),
        (Transform.of(xyz=(0.62, 0.5, 1.0)), 0.0, 0.03, "the centre of 'cup' is 30 mm inside the edge of 'tray'"),
        (Transform.of(xyz=(0.5, 0.65, 1.0)), 0.0, -0.05, "the centre of 'cup' is 50 mm beyond the edge of 'tray'"),
    ],
)
def test_above_is_the_gap_or_the_way_to_the_edge(pose: Transform, by: float, expected: float, text: str) -> None:
    found = read("above", state(poses={"cup": pose}), object="cup", of="tray", by=by)
    assert found.margins == pytest.approx([expected], abs=1e-12)
    assert found.found(0).text == text


@pytest.mark.parametrize("z", [0.01, 0.15, 0.9])
def test_above_is_compared_to_half_of_the_lesser_side(z: float) -> None:
    """Of a tray of 0.3 m by 0.2 m: with the centre over its middle, that far above is the most there is, 1."""
    found = read("above", state(poses={"cup": Transform.of(xyz=(0.5, 0.5, 0.05 + z))}), object="cup", of="tray")
    assert found.relative == pytest.approx([min(z / 0.1, 1.0)])


def test_above_looks_at_what_is_lowest_of_what_lies() -> None:
    # The stick is 0.02 thick and 0.2 long; from its bottom it leans by 30 degrees towards x.
    leaning = Transform.of(xyz=(0.5, 0.5, 0.2), rpy=(0, np.pi / 6, 0))
    found = read("above", state(poses={"stick": leaning}), object="stick", of="tray", by=0.1)
    assert found.margins == pytest.approx([0.05 - 0.01 * np.sin(np.pi / 6)])


def test_moved_and_unmoved_count_from_the_first_tick_that_is_shown() -> None:
    poses = [moved_by("cup", (0.01 * k, 0, 0)) for k in range(5)]
    states = [state(poses={"cup": X}, time=0.1 * k) for k, X in enumerate(poses)]
    moved = opened("moved", object="cup", by=0.025)
    both = [moved(window(states[1], states[1], states[2])), moved(window(*states[2:]))]
    assert np.concatenate([one.margins for one in both]) == pytest.approx([-0.025, -0.015, -0.005, 0.005])
    unmoved = read("unmoved", states[0], *states[2:], object="cup", within=0.015)
    assert unmoved.margins == pytest.approx([0.015, 0.005, -0.005])
    assert unmoved.found(2).text == "'cup' moved by 20 mm; at most 15 mm"


def test_a_turn_is_a_motion_too_and_the_lesser_share_decides() -> None:
    states = [state(time=0.1), state(time=0.2), state(poses={"cup": moved_by("cup", (0, 0, 0), (0, 0, 0.3))}, time=0.3)]
    turned = read("unmoved", *states, object="cup", within=0.01, rotation=0.2)
    # Both turn about the cup's middle: 1 of 1 of the way is left, but of the turn less than nothing.
    worst = turned.found(1)
    assert (worst.margin, worst.unit, worst.at) == (pytest.approx(-0.1), "rad", 0.3)
    assert worst.text == "'cup' rotated by 17.2 deg; at most 11.5 deg"
    assert read("moved", *states, object="cup", rotation=0.2).margins[-1] == pytest.approx(0.1)
    both = read("moved", *states, object="cup", rotation=0.2, by=0.05).found(1)
    assert (both.margin, both.unit) == (pytest.approx(-0.05), "m")


def test_at_pose_is_what_is_left_of_the_worst_joint() -> None:
    now = state(position=(0.51, -1.03, 0.2))
    assert margin("at_pose", now, pose="home", within=0.05) == pytest.approx(0.02)
    assert margin("at_pose", now, pose="all", group="arm", within=0.02) == pytest.approx(-0.01)
    assert margin("at_pose", now, pose="all", within=0.05) == pytest.approx(0.02), "fingers do not count"
    assert margin("at_pose", now, pose="out", slide=0.15) == pytest.approx(0.05)
    both = read("at_pose", now, pose="all", within=0.05, slide=0.15).found(0)
    assert (both.margin, both.unit) == (pytest.approx(-0.05), "m")


def test_at_pose_counts_what_slides_and_carries_the_tool() -> None:
    scara = replace(ROBOT, tool=Tool("finger", Transform.identity()))
    look = CONDITIONS["at_pose"].open(CONDITIONS["at_pose"].spec(pose="all"), replace(WORLD, robot=scara))
    near, far = (state(position=(0.5, -1.0, slide)) for slide in (0.001, 0.006))
    found = look(window(far, near, far))
    assert found.margins == pytest.approx([0.004, -0.001])
    assert found.found(1).text == "joint 'slide' is 6 mm from pose 'all'; within 5 mm"


def test_at_pose_takes_a_joint_without_limits_the_short_way_round() -> None:
    first, *others = ROBOT.joints
    endless = replace(ROBOT, joints=(replace(first, type="continuous"), *others))
    look = CONDITIONS["at_pose"].open(CONDITIONS["at_pose"].spec(pose="home"), replace(WORLD, robot=endless))
    around = state(position=(0.51 + 2 * np.pi, -1.0, 0.0))
    assert look(window(around)).margins == pytest.approx([0.01])


SPECS: list[tuple[str, dict[str, Any]]] = [
    ("inside", {"object": "ball", "of": "tray"}),
    ("inside", {"object": "ball", "of": "cup"}),
    ("inside", {"object": "tray", "of": "cup"}),
    ("upright", {"object": "cup", "within": 0.1}),
    ("upright", {"object": "tray", "within": 0.1}),
    ("near", {"object": "cup", "to": "start", "within": 0.1}),
    ("near", {"object": "cup", "to": "rim", "within": 0.1}),
    ("near", {"object": "tray", "to": "drop", "within": 0.1}),
    ("near", {"object": "ball", "to": [0, 0, 0], "within": 0.1}),
    ("at_rest", {"object": "stick"}),
    ("outside", {"object": "stick", "of": "cup"}),
    ("above", {"object": "stick", "of": "cup", "by": 0.1}),
    ("above", {"object": "cup", "of": "tray"}),
    ("moved", {"object": "cup", "by": 0.1, "rotation": 0.1}),
    ("unmoved", {"object": "cup", "within": 0.1}),
    ("at_rest", {"object": "tray"}),
    ("at_pose", {"pose": "home"}),
]


@pytest.mark.parametrize(("name", "written"), SPECS)
@pytest.mark.parametrize("cuts", [(1,), (1, 2, 3), (5,)])
def test_all_ticks_at_once_give_what_pieces_of_them_give(
    name: str, written: dict[str, Any], cuts: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(1)
    m, T = len(SCENE.movable), 7
    quats = rng.normal(size=(T, m, 4))
    nothing = np.full((T, m, 3), np.nan)
    many = WorldState(
        time=np.arange(T) * 0.1,
        position=rng.normal(size=(T, 3)),
        velocity=rng.normal(size=(T, 3)),
        effort=rng.normal(size=(T, 3)),
        body_position=rng.normal(size=(T, m, 3)),
        body_quat_xyzw=quats / np.linalg.norm(quats, axis=-1, keepdims=True),
        body_linear=nothing,
        body_angular=nothing,
    )
    whole = StateWindow(many, None, (), (), ())
    together = opened(name, **written)(whole)
    assert together.margins.shape == (T,)
    monitor = opened(name, **written)
    pieces = [monitor(whole.part(a, b)) for a, b in pairwise((0, *cuts, T))]
    np.testing.assert_array_equal(np.concatenate([one.margins for one in pieces]), together.margins)
    assert [pieces[0].found(0), pieces[-1].found(-1)] == [together.found(0), together.found(T - 1)]


@pytest.mark.parametrize(
    ("name", "written", "loc", "hint"),
    [
        ("inside", {"object": "bal", "of": "cup"}, ("object",), "did you mean 'ball'?"),
        ("inside", {"object": "ball", "of": "cop"}, ("of",), "did you mean 'cup'?"),
        ("inside", {"object": "ball", "of": "stick"}, ("of",), None),
        ("inside", {"object": "cup", "of": "cup"}, ("of",), None),
        ("upright", {"object": "cp", "within": 0.1}, ("object",), "did you mean 'cup'?"),
        ("near", {"object": "cup", "to": "stat", "within": 0.1}, ("to",), "did you mean 'start'?"),
        ("near", {"object": "cup", "to": "drp", "within": 0.1}, ("to",), "did you mean 'drop'?"),
        ("near", {"object": "cup", "to": "cup", "within": 0.1}, ("to",), "use `to: start` for its position at time 0"),
        ("at_rest", {"object": "trai"}, ("object",), "did you mean 'tray'?"),
        ("outside", {"object": "ball", "of": "stick"}, ("of",), None),
        ("above", {"object": "cup", "of": "try"}, ("of",), "did you mean 'tray'?"),
        ("above", {"object": "cup", "of": "cup"}, ("of",), None),
        ("moved", {"object": "cop", "by": 0.1}, ("object",), "did you mean 'cup'?"),
        ("unmoved", {"object": "tray", "within": 0.1}, ("object",), None),
        ("at_pose", {"pose": "hom"}, ("pose",), "did you mean 'home'?"),
        ("at_pose", {"pose": "home", "group": "ram"}, ("group",), None),
        ("at_pose", {"pose": "home", "group": "hand"}, ("group",), None),
        ("at_pose", {"pose": "all", "group": "hand"}, ("group",), None),
        ("at_pose", {"pose": "out"}, ("pose",), None),
    ],
)
def test_what_robot_and_scene_do_not_know_is_told(
    name: str, written: dict[str, Any], loc: tuple[str, ...], hint: str | None
) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    (problem,) = condition.check(condition.spec.model_validate(written), CheckContext(ROBOT, SCENE))
    assert problem.loc == loc
    assert hint is None or problem.hint == hint


@pytest.mark.parametrize(
    ("name", "written", "needed"),
    [
        ("inside", {"object": "ball", "of": "tray"}, True),
        ("near", {"object": "tray", "to": "drop", "within": 1}, False),
        ("near", {"object": "tray", "to": "rim", "within": 1}, True),
        ("upright", {"object": "tray", "within": 1}, False),
        ("at_pose", {"pose": "home"}, False),
    ],
)
def test_physics_is_needed_where_a_movable_body_matters(name: str, written: dict[str, Any], needed: bool) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    still = replace(WORLD, physics=False)
    reason = condition.absent(condition.spec.model_validate(written), still)
    assert (reason is not None) is needed
    assert reason is None or "has no physics" in reason


def test_what_a_log_leaves_out_is_not_judged() -> None:
    world = replace(WORLD, unrecorded={"bodies": "no poses"})
    condition: Condition[Any] = CONDITIONS["upright"]
    assert condition.absent(condition.spec(object="cup", within=1), world) == "no poses"
    assert condition.absent(condition.spec(object="tray", within=1), world) is None
