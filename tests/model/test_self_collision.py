"""Self-collision matrix: a planar arm in closed form, brute force, proofs that hold, a cache that is not trusted."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.activity import announced_to
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.model import self_collision as module
from manipcli.model.collision import CollisionChecker
from manipcli.model.configuration import with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import LinkPair, checked_pairs, lasting_overlaps, sampled_matrix
from manipcli.model.self_collision_cache import self_collision_matrix
from manipcli.scene.scene import Scene
from manipcli.shapes.proximity import coal_shape, overlap
from manipcli.task.load_view import load_sight

HERE = Path(__file__).parents[2]


def arm(folder: Path, ranges: list[tuple[float, float]], *, middle: str = "", length: float = 0.5) -> RobotModel:
    """A planar arm of bars 2 cm thick, each turning about z at the end of the last; `middle`: more shapes of link 1."""
    box = f'<geometry><box size="{length - 0.1} 0.02 0.02"/></geometry>'
    bar = f'<collision><origin xyz="{length / 2} 0 0"/>{box}</collision>'
    links = [f'<link name="l{k}">{bar}{middle if k == 1 else ""}</link>' for k in range(len(ranges) + 1)]
    joints = [
        f'<joint name="j{k}" type="revolute"><origin xyz="{length} 0 0"/><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<axis xyz="0 0 1"/><limit lower="{low}" upper="{high}" effort="1" velocity="1"/></joint>'
        for k, (low, high) in enumerate(ranges)
    ]
    (folder / "arm.urdf").write_text(f'<robot name="arm">{"".join(links)}{"".join(joints)}</robot>')
    return load_sight(folder / "arm.urdf").robot


def pair(matrix: module.SelfCollisionMatrix, a: str, b: str) -> LinkPair:
    (found,) = [each for each in matrix.pairs if (each.a, each.b) == (a, b)]
    return found


def test_a_folding_arm_in_closed_form(tmp_path: Path) -> None:
    # l2 meets l0 where both joints fold it back onto l0: for j0 = pi - t, small t, l1 lies along l0 and l2 crosses it.
    robot = arm(tmp_path, [(-3.0, 3.0), (-3.0, 3.0)])
    matrix = sampled_matrix(robot, samples=4000)
    assert pair(matrix, "l0", "l1").kind == pair(matrix, "l1", "l2").kind == "adjacent"
    assert pair(matrix, "l0", "l2").kind == "sometimes"
    # The middle lines of l2, from 0.05 to 0.45 beyond its joint, against that of l0: segments in the plane.
    rng = np.random.default_rng(5)
    q = rng.uniform(-3.0, 3.0, (20_000, 2))
    elbow = np.stack([0.5 + 0.5 * np.cos(q[:, 0]), 0.5 * np.sin(q[:, 0])], axis=1)
    along = np.stack([np.cos(q.sum(axis=1)), np.sin(q.sum(axis=1))], axis=1)
    points = elbow[:, None] + np.linspace(0.05, 0.45, 200)[None, :, None] * along[:, None]
    dx = np.maximum(np.abs(points[..., 0] - 0.25) - 0.2, 0.0)
    near = np.hypot(dx, points[..., 1]).min(axis=1)
    share = pair(matrix, "l0", "l2").share or 0.0
    assert np.mean(near < 0.018) - 0.02 < share < np.mean(near < 0.032) + 0.02


def test_what_the_limits_keep_apart_is_proven_and_what_they_do_not_is_not(tmp_path: Path) -> None:
    free = sampled_matrix(arm(tmp_path, [(-1.0, 1.0), (-1.0, 1.0)]), samples=500)
    assert pair(free, "l0", "l2") == LinkPair("l0", "l2", "never", 0.0, proven=True)
    # At 120 deg each, l3 comes back onto l0: one corner of the joint range. 40 deg less each, and it stays above l0.
    for less, proven in ((0.0, False), (0.7, True)):
        robot = arm(tmp_path, [(0.0, math.radians(120.0) - less)] * 3)
        assert module._Links(Kinematics(robot), *module._ranges(robot)).apart("l0", "l3") == proven


def test_no_proven_pair_overlaps_in_many_more_samples_or_at_the_ends(tmp_path: Path) -> None:
    robot = load_sight(HERE / "robots/panda/robot.yaml").robot
    matrix = sampled_matrix(robot, samples=200)
    proven = [(each.a, each.b) for each in matrix.pairs if each.proven]
    assert len(proven) >= 5
    lower, upper = module._ranges(robot)
    rng = np.random.default_rng(9)
    ends = np.where(rng.integers(0, 2, (1000, len(lower))) == 0, lower, upper)
    assert not brute_force(robot, proven, np.concatenate([ends, rng.uniform(lower, upper, (1000, len(lower)))])).any()


def link_poses(robot: RobotModel, q: Array) -> dict[str, Transform]:
    """X_WL of every link, joint by joint."""
    values = dict(zip(robot.joint_names, q, strict=True))
    found = {robot.root: robot.X_WB}
    for joint in robot.joints:
        value, X = values.get(joint.name, 0.0), joint.X_PJ
        if joint.moves and joint.type == "prismatic":
            X = X @ Transform.of(xyz=value * joint.axis)
        elif joint.moves:
            X = X @ Transform.of(R=matrix_from_axis_angle(joint.axis, value))
        found[joint.child] = found[joint.parent] @ X
    return found


def brute_force(robot: RobotModel, pairs: list[tuple[str, str]], configurations: Array) -> Array:
    """(T, k) whether each pair overlaps: shape by shape, with poses from another implementation of the kinematics."""
    shapes = {name: [(each.X_LS, coal_shape(each.shape)) for each in robot.link(name).collisions]
              for names in pairs for name in names}  # fmt: skip
    found = []
    for q in with_mimics(robot, configurations):
        poses = link_poses(robot, q)
        found.append(
            [
                any(
                    overlap(one, poses[a] @ X_a, other, poses[b] @ X_b)
                    for X_a, one in shapes[a]
                    for X_b, other in shapes[b]
                )
                for a, b in pairs
            ]
        )
    return np.array(found)


def test_the_samples_are_those_of_brute_force(tmp_path: Path) -> None:
    robot = load_sight(HERE / "robots/panda/robot.yaml").robot
    matrix = sampled_matrix(robot, samples=150, seed=3)
    lower, upper = module._ranges(robot)
    q = np.random.default_rng(3).uniform(lower, upper, (150, len(lower)))
    pairs = [(each.a, each.b) for each in matrix.pairs if each.share is not None]
    shares = [each.share for each in matrix.pairs if each.share is not None]
    np.testing.assert_allclose(brute_force(robot, pairs, q).mean(axis=0), shares, atol=1e-12)


def test_links_modelled_into_each_other_are_not_checked_but_a_pose_of_zero_in_collision_is(tmp_path: Path) -> None:
    # l0 and l2 overlap at zero: once through a ball around both, once because l1 is short and l2 begins inside l0.
    ball = '<collision><origin xyz="0.5 0 0"/><geometry><sphere radius="0.7"/></geometry></collision>'
    around = arm(tmp_path, [(-3.0, 3.0)] * 3, middle=ball)
    assert lasting_overlaps(around, {("l1", "l3"): -0.1}) == {("l1", "l3")}
    kinds = {each.kind for each in sampled_matrix(around, samples=300).pairs if {each.a, each.b} == {"l1", "l3"}}
    assert kinds == {"always"} or kinds == {"default"}
    panda = load_sight(HERE / "robots/panda/robot.yaml").robot
    assert lasting_overlaps(panda, {("panda_hand", "panda_link5"): -0.04}) == set()
    fingers = ("panda_leftfinger", "panda_rightfinger")  # they only touch, closed
    assert lasting_overlaps(panda, {fingers: -2e-4}) == {fingers}


@pytest.mark.parametrize("name", ["panda", "arm7_hand3", "four_bar_finger"])
def test_the_checked_pairs_are_those_of_the_planner(name: str) -> None:
    robot = load_sight(HERE / "robots" / name / "robot.yaml").robot
    query = CollisionChecker(Kinematics(robot), Scene((), (), np.zeros(3))).at()
    geometry, names = query.shapes
    planned = {tuple(sorted((names[pair.first], names[pair.second]))) for pair in geometry.collisionPairs}
    assert planned == {(f"robot/{a}", f"robot/{b}") for a, b in checked_pairs(robot)}
    matrix = sampled_matrix(robot, samples=50)
    assert checked_pairs(robot) == tuple((each.a, each.b) for each in matrix.pairs if each.checked)


def test_the_confidence_is_that_of_no_hit_in_n_samples() -> None:
    matrix = module.SelfCollisionMatrix((), 1000)
    assert (1.0 - matrix.rarest) ** 1000 == pytest.approx(1.0 - module.CONFIDENCE)
    assert matrix.rarest == pytest.approx(3.0 / 1000, rel=5e-3)  # the rule of three


def test_the_matrix_is_kept_by_what_it_depends_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    heard: list[str] = []
    with announced_to(heard.append):
        first = self_collision_matrix(arm(tmp_path, [(-3.0, 3.0)] * 2), samples=100)
        assert self_collision_matrix(arm(tmp_path, [(-3.0, 3.0)] * 2), samples=100) == first and len(heard) == 1
        (file,) = (tmp_path / "manipcli" / "self_collision").iterdir()
        whole = file.read_bytes()
        for damaged in (b"", whole[:-2], whole.replace(b"sometimes", b"never"), b"{}"):
            file.write_bytes(damaged)
            assert self_collision_matrix(arm(tmp_path, [(-3.0, 3.0)] * 2), samples=100) == first
        assert len(heard) == 5 and file.read_bytes() == whole
        assert self_collision_matrix(arm(tmp_path, [(-1.0, 1.0)] * 2), samples=100) != first
        monkeypatch.setenv("XDG_CACHE_HOME", "/proc/none")
        assert self_collision_matrix(arm(tmp_path, [(-3.0, 3.0)] * 2), samples=100) == first
    assert len(heard) == 7


def test_a_transform_of_the_base_changes_nothing(tmp_path: Path) -> None:
    import dataclasses

    robot = arm(tmp_path, [(-3.0, 3.0)] * 3)
    moved = dataclasses.replace(robot, X_WB=Transform.of(xyz=(1.0, 2.0, 3.0), rpy=(0.3, 0.2, math.pi)))
    assert sampled_matrix(robot, samples=200) == sampled_matrix(moved, samples=200)
