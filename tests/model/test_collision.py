from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.collision import Carried, CollisionChecker, CollisionQuery, pairs
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Mesh, Shape, Sphere

RADIUS = 0.1
ROD = 1.0  # from one joint to the next, and to the ball at the tip


def link(name: str, *shapes: tuple[tuple[float, float, float], Shape]) -> Link:
    return Link(name, None, (), tuple(Geometry(Transform.of(xyz=xyz), shape) for xyz, shape in shapes))


def joint(k: int, parent: str, child: str, x: float) -> Joint:
    limits = JointLimits(-np.pi, np.pi, 1.0, 1.0, 1.0)
    return Joint(f"j{k}", "revolute", parent, child, Transform.of(xyz=(x, 0, 0)), frozen((0, 0, 1)), limits)


def robot() -> RobotModel:
    """A planar arm, three joints about z, a ball of 0.1 m one metre out on every link: all distances are known."""
    ball = (ROD, 0.0, 0.0), Sphere(RADIUS)
    return RobotModel(
        name="planar",
        root="base",
        links=(link("base", ((0.0, 0.0, 0.0), Sphere(RADIUS))), link("a", ball), link("b", ball), link("c", ball)),
        joints=(joint(1, "base", "a", 0.0), joint(2, "a", "b", ROD), joint(3, "b", "c", ROD)),
        groups=(), poses=(), transmissions=(), X_WB=Transform.identity(), urdf="",
    )  # fmt: skip


def body(name: str, shape: Shape, xyz: tuple[float, float, float], *, fixed: bool = True) -> Body:
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape),), mass=0.0 if fixed else 1.0,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.of(xyz=xyz), interior=None,
        size=frozen((1, 1, 1)), centre=frozen((0, 0, 0)),
    )  # fmt: skip


def scene(*bodies: Body) -> Scene:
    return Scene(bodies=bodies, frames=(), gravity=frozen((0, 0, -9.81)))


def balls(q: Array) -> Array:
    """Centres (4, 2) of the base's ball and the three others, from the angles alone."""
    angles = np.cumsum(q)
    steps = np.column_stack((np.cos(angles), np.sin(angles))) * ROD
    return np.vstack((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


def test_agrees_with_the_distances_between_balls() -> None:
    """Brute force: pairs that only one joint separates do not count; neither does the base against the wall."""
    post = np.array([1.2, 0.9])
    checker = CollisionChecker(Kinematics(robot()), scene(body("post", Sphere(0.2), (*post, 0.0))))
    situation = checker.at()
    hits = 0
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (400, 3)):
        p = balls(q)
        gaps = {
            ("post", f"robot/{name}"): np.linalg.norm(p[k] - post) - 0.3 for k, name in ((1, "a"), (2, "b"), (3, "c"))
        }
        for i, j, names in ((0, 2, ("b", "base")), (0, 3, ("base", "c")), (1, 3, ("a", "c"))):
            gaps[f"robot/{names[0]}", f"robot/{names[1]}"] = np.linalg.norm(p[i] - p[j]) - 0.2
        expected = {pair: gap for pair, gap in gaps.items() if gap < 0.0}
        assert situation.touches(q) == bool(expected)
        found = {(hit.a, hit.b): hit.distance for hit in situation.every(q)}
        assert found == pytest.approx(expected, abs=1e-6)
        hit = situation.check(q)
        if expected:
            hits += 1
            assert hit is not None
            assert (hit.a, hit.b) == min(expected, key=lambda pair: expected[pair])
        else:
            assert hit is None
    assert hits > 50


@pytest.mark.parametrize(("margin", "hit"), [(-0.02, False), (0.0, True)])
def test_a_negative_margin_forgives_overlap(margin: float, hit: bool) -> None:
    """The last ball, at x = 3, overlaps the post by 1 cm."""
    checker = CollisionChecker(Kinematics(robot()), scene(body("post", Sphere(0.2), (3.29, 0.0, 0.0))))
    query = checker.at(margin=margin)
    assert query.touches(np.zeros(3)) is hit
    assert (query.check(np.zeros(3)) is not None) is hit


def test_a_margin_makes_near_things_touch() -> None:
    checker = CollisionChecker(Kinematics(robot()), scene(body("post", Sphere(0.2), (3.31, 0.0, 0.0))))
    assert checker.at().check(np.zeros(3)) is None
    hit = checker.at(margin=0.02).check(np.zeros(3))
    assert hit is not None
    assert hit.distance == pytest.approx(0.01, abs=1e-6)
    assert checker.at(margin=0.02).touches(np.zeros(3))
    assert str(hit) == "post and robot/c have a clearance of 10.0 mm"


def test_allowed_contacts_are_allowed_in_either_order() -> None:
    checker = CollisionChecker(Kinematics(robot()), scene(body("post", Sphere(0.2), (3.2, 0.0, 0.0))))
    q = np.zeros(3)
    assert checker.at(ignore=pairs(("c",), "post")).check(q) is None
    assert checker.at(ignore=[("post", "robot/c")]).check(q) is None
    assert checker.at(ignore=pairs(("b",), "post")).check(q) is not None
    folded = np.array([0.0, 0.0, np.pi])
    assert checker.at().check(folded) is not None
    silent = CollisionChecker(Kinematics(robot()), scene(), ignore=[("c", "a")])
    assert silent.at().check(folded) is None


def test_bodies_stand_where_they_are_put() -> None:
    checker = CollisionChecker(Kinematics(robot()), scene(body("can", Sphere(0.2), (9.0, 0.0, 0.0), fixed=False)))
    assert checker.at().check(np.zeros(3)) is None
    assert checker.at([Transform.of(xyz=(3.2, 0.0, 0.0))]).check(np.zeros(3)) is not None


def test_a_carried_body_is_part_of_the_robot() -> None:
    """Held 0.4 m beyond the tip, it meets a wall that the arm alone does not, and the arm's own base when folded."""
    can, wall = (
        body("can", Sphere(0.1), (9.0, 0.0, 0.0), fixed=False),
        body("wall", Box((0.1, 4.0, 4.0)), (3.5, 0.0, 0.0)),
    )
    checker = CollisionChecker(Kinematics(robot()), scene(can, wall))
    held = Carried("can", link="c", X_LO=Transform.of(xyz=(ROD + 0.4, 0.0, 0.0)))
    assert checker.at().check(np.zeros(3)) is None
    hit = checker.at(carried=held).check(np.zeros(3))
    assert hit is not None
    assert (hit.a, hit.b) == ("can", "wall")
    assert hit.distance == pytest.approx(-0.05, abs=1e-6)
    # A triangle whose third side is 1.4 m: the can comes back to the base, the ball of the tip does not.
    bend = 2 * np.arccos(0.7)  # |e1 + e2| = 2 cos(bend / 2)
    q = np.array([0.0, bend, np.pi - bend / 2])
    assert np.linalg.norm(balls(q)[2]) == pytest.approx(1.4)
    folded = checker.at(carried=held).check(q)
    assert folded is not None
    assert (folded.a, folded.b) == ("can", "robot/base")


def test_a_body_carried_by_the_base_is_checked_against_the_scene() -> None:
    can, floor = (
        body("can", Sphere(0.1), (0.0, 5.0, 0.0), fixed=False),
        body("floor", Box((9.0, 1.0, 1.0)), (0.0, 4.42, 0.0)),
    )
    checker = CollisionChecker(Kinematics(robot()), scene(can, floor))
    assert checker.at().check(np.zeros(3)) is None
    hit = checker.at(carried=Carried("can", "base", can.X_WO)).check(np.zeros(3))
    assert hit is not None
    assert hit.distance == pytest.approx(-0.02, abs=1e-6)


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_carried_body_meets_those_before_and_after_it_in_the_file(place: int) -> None:
    can = body("can", Sphere(RADIUS), (9.0, 9.0, 0.0), fixed=False)
    bodies = [body("left", Sphere(RADIUS), (3.0, 0.15, 0.0)), body("right", Sphere(RADIUS), (3.0, -0.15, 0.0))]
    bodies.insert(place, can)
    checker = CollisionChecker(Kinematics(robot()), scene(*bodies))
    held = Carried("can", "c", Transform.of(xyz=(ROD, 0.0, 0.0)))
    query = checker.at(carried=held, ignore=pairs(["c"], "left", "right"))
    assert [(hit.a, hit.b) for hit in query.every(np.zeros(3))] == [("can", "left"), ("can", "right")]


def test_a_trajectory_is_stopped_at_the_first_touch() -> None:
    """The last joint sweeps from 0 to pi in a second; the ball of the tip first meets a post at 90 degrees."""
    checker = CollisionChecker(Kinematics(robot()), scene(body("post", Sphere(0.2), (2.0, 1.0, 0.0))))
    times = np.arange(1001) * 1e-3
    hit = checker.at().check_trajectory([2], np.zeros(3), times, np.pi * times[:, None])
    assert hit is not None
    # Chord 0.3 between two points of the unit circle about the last joint: angle 2 asin(0.15) before 90 degrees.
    first = (np.pi / 2 - 2 * np.arcsin(0.15)) / np.pi
    assert first <= hit.time <= first + 0.01 / np.pi + 2e-3
    assert checker.at().check_trajectory([2], np.zeros(3), times, 0.5 * times[:, None]) is None


def test_the_last_point_of_a_trajectory_is_checked() -> None:
    checker = CollisionChecker(Kinematics(robot()), scene(body("post", Sphere(0.2), (2.0, 1.0, 0.0))))
    positions = np.array([[0.0], [0.002], [np.pi / 2]])
    assert checker.at().check_trajectory([2], np.zeros(3), np.arange(3.0), positions) is not None
    still = np.full((3, 1), np.pi / 2)
    assert checker.at().check_trajectory([2], np.zeros(3), np.arange(3.0), still) is not None


@pytest.mark.parametrize(("edge", "modelled"), [(3.0, True), (0.3, False)])
def test_links_modelled_into_each_other_are_not_checked(edge: float, modelled: bool) -> None:
    """A plate on link b that reaches the base in the stretched arm, and in most configurations or in few."""
    plate = link("b", ((ROD, 0.0, 0.0), Sphere(RADIUS)), ((-ROD, 0.0, 0.0), Box((edge, edge, 0.3))))
    made = robot()
    made = RobotModel(
        made.name, made.root, (*made.links[:2], plate, made.links[3]), made.joints, (), (), (), made.X_WB, ""
    )
    hits = CollisionChecker(Kinematics(made), scene()).at().every(np.zeros(3))
    assert (("robot/b", "robot/base") in [(hit.a, hit.b) for hit in hits]) != modelled


def test_a_mesh_counts_as_its_convex_hull(tmp_path: Path) -> None:
    path = tmp_path / "tetrahedron.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    # Scaled by 0.5, its corners are half a metre from its corner at (3, 0.15, 0): the ball reaches 0.1 of 0.15 m.
    mesh = Mesh(str(path), path, (0.5, 0.5, 0.5))
    apart = CollisionChecker(Kinematics(robot()), scene(body("rock", mesh, (3.0, 0.15, 0.0))))
    assert apart.at().check(np.zeros(3)) is None
    hit = CollisionChecker(Kinematics(robot()), scene(body("rock", mesh, (3.0, 0.07, 0.0)))).at().check(np.zeros(3))
    assert hit is not None
    assert hit.distance == pytest.approx(-0.03, abs=1e-4)


def test_what_is_absent_or_not_asked_for_is_not_hit() -> None:
    """The last ball meets a post, the one before it a can."""
    post, can = body("post", Sphere(0.2), (3.2, 0.0, 0.0)), body("can", Sphere(0.2), (2.0, 0.2, 0.0), fixed=False)
    checker = CollisionChecker(Kinematics(robot()), scene(post, can))

    def hits(query: CollisionQuery) -> list[tuple[str, str]]:
        return [(hit.a, hit.b) for hit in query.every(np.zeros(3))]

    assert hits(checker.at()) == [("can", "robot/b"), ("post", "robot/c")]
    assert hits(checker.at(absent=("can",))) == [("post", "robot/c")]
    assert hits(checker.at(only="can")) == [("can", "robot/b")]
    assert hits(checker.at(only="robot/c")) == [("post", "robot/c")]
