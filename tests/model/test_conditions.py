"""Each condition: its margin by hand on good and spoilt states, and the same value live and over time."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.model.build_scene import build_scene
from manipcli.model.condition import Condition, World, needs_physics
from manipcli.model.conditions import CONDITIONS
from manipcli.model.robot import Group, Joint, JointLimits, JointType, Link, NamedPose, RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.spec.task import BodySpec, FrameSpec, TaskSpec

BODIES: dict[str, Any] = {
    "cup": {"cup": {"radius": 0.04, "height": 0.11, "wall": 0.01}, "mass": 0.15, "pose": {"xyz": [1, 0, 0.4]}},
    "ball": {"sphere": {"radius": 0.014}, "mass": 0.01, "inside": "cup"},
    "tray": {"tray": {"size": [0.3, 0.2, 0.05], "wall": 0.01}, "pose": {"xyz": [0.5, 0.5, 0]}, "fixed": True},
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
        poses=(NamedPose("home", ("j1", "j2"), (0.5, -1.0)), NamedPose("all", ("j1", "j2", "slide"), (0.5, -1.0, 0.0))),
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
    position: npt.ArrayLike = (0.0, 0.0, 0.0),
    poses: dict[str, Transform] | None = None,
    linear: dict[str, tuple[float, float, float]] | None = None,
    angular: dict[str, tuple[float, float, float]] | None = None,
) -> WorldState:
    """The start, with some bodies elsewhere or moving."""
    where = [(poses or {}).get(body.name, body.X_WO) for body in SCENE.movable]
    names = [body.name for body in SCENE.movable]
    return WorldState(
        time=np.array(0.0),
        position=np.array(position, dtype=float),
        velocity=np.zeros(3),
        effort=np.zeros(3),
        body_position=np.array([X.p for X in where]),
        body_quat_xyzw=np.array([X.quat_xyzw for X in where]),
        body_linear=np.array([(linear or {}).get(name, (0, 0, 0)) for name in names], dtype=float),
        body_angular=np.array([(angular or {}).get(name, (0, 0, 0)) for name in names], dtype=float),
    )


WORLD = World(robot=ROBOT, scene=SCENE, start=state())


def margin(name: str, now: WorldState, **written: Any) -> float:
    condition = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    assert condition.check(spec, ROBOT, SCENE) == ()
    value = condition.margin(spec, WORLD, now)
    assert value.shape == ()
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


def test_at_rest_is_what_is_left_of_the_speed_of_the_middle() -> None:
    assert margin("at_rest", state(), object="ball") == 0.001
    moving = state(linear={"ball": (0.003, 0.0, 0.004)})
    assert margin("at_rest", moving, object="ball") == pytest.approx(-0.004)
    # The stick spins about its middle, 0.1 m above its origin: the origin moves, the middle does not.
    spinning = state(linear={"stick": (-0.1, 0.0, 0.0)}, angular={"stick": (0.0, 1.0, 0.0)})
    assert margin("at_rest", spinning, object="stick", below=0.01) == pytest.approx(0.01)
    assert margin("at_rest", spinning, object="tray", below=0.01) == 0.01


def test_at_pose_is_what_is_left_of_the_worst_joint() -> None:
    now = state(position=(0.51, -1.03, 0.2))
    assert margin("at_pose", now, pose="home", within=0.05) == pytest.approx(0.02)
    assert margin("at_pose", now, pose="all", group="arm", within=0.02) == pytest.approx(-0.01)


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
    ("at_rest", {"object": "tray"}),
    ("at_pose", {"pose": "home"}),
]


@pytest.mark.parametrize(("name", "written"), SPECS)
@pytest.mark.parametrize("lead", [(7,), (2, 3), (0,)])
def test_many_states_at_once_give_what_each_gives_alone(
    name: str, written: dict[str, Any], lead: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(1)
    m = len(SCENE.movable)
    quats = rng.normal(size=(*lead, m, 4))
    many = WorldState(
        time=rng.normal(size=lead),
        position=rng.normal(size=(*lead, 3)),
        velocity=rng.normal(size=(*lead, 3)),
        effort=rng.normal(size=(*lead, 3)),
        body_position=rng.normal(size=(*lead, m, 3)),
        body_quat_xyzw=quats / np.linalg.norm(quats, axis=-1, keepdims=True),
        body_linear=rng.normal(size=(*lead, m, 3)),
        body_angular=rng.normal(size=(*lead, m, 3)),
    )
    condition = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    together = condition.margin(spec, WORLD, many)
    assert together.shape == lead
    for index in np.ndindex(lead):
        one = WorldState(**{field: getattr(many, field)[index] for field in WorldState.__slots__})
        np.testing.assert_allclose(together[index], condition.margin(spec, WORLD, one), rtol=0, atol=1e-12)


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
        ("at_rest", {"object": "trai"}, ("object",), "did you mean 'tray'?"),
        ("at_pose", {"pose": "hom"}, ("pose",), "did you mean 'home'?"),
        ("at_pose", {"pose": "home", "group": "ram"}, ("group",), None),
        ("at_pose", {"pose": "home", "group": "hand"}, ("group",), None),
        ("at_pose", {"pose": "all"}, ("pose",), "name a `group` without it"),
    ],
)
def test_what_robot_and_scene_do_not_know_is_told(
    name: str, written: dict[str, Any], loc: tuple[str, ...], hint: str | None
) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    (problem,) = condition.check(condition.spec.model_validate(written), ROBOT, SCENE)
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
    assert needs_physics(condition, condition.spec.model_validate(written), SCENE) is needed
