"""Laws of a peg in a hole: its clearance follows from the shapes, and the spiral of the search misses nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.pressing import PressingReference
from manipcli.core.geometry import Array, Transform
from manipcli.plan.compliance import Pressing
from manipcli.plan.peg_fit import best_yaws, fit, section, upright
from manipcli.plan.spiral import SPEED, pitch_of, spiral
from manipcli.plan.steps.insert import InsertSpec, check
from manipcli.scene.known import Known
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box
from manipcli.spec.known import KnownSpec
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: fits
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
steps: [{{wait: 0.1 s}}]
scene:
  round: {{cylinder: {{radius: 10 mm, height: 8 cm}}, mass: 0.1, rests_on: floor, at: [0.5, 0]}}
  square: {{box: {{size: [3 cm, 2 cm, 8 cm]}}, mass: 0.1, rests_on: floor, at: [0.5, 0.3]}}
  peg: {{urdf: {{file: {ROOT}/tasks/objects/peg.urdf}}, rests_on: floor, at: [0.5, 0.5]}}
  socket: {{cup: {{radius: 30 mm, height: 50 mm, wall: 19.5 mm, segments: 12}}, mass: 1, rests_on: floor, at: [1, 0]}}
  frame: {{tray: {{size: [8 cm, 6 cm, 4 cm], wall: 2 cm}}, fixed: true, rests_on: floor, at: [0.5, 0.9]}}
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    path = tmp_path_factory.mktemp("fits") / "task.yaml"
    path.write_text(HEAD)
    return load_task(path).scene


def inside_a_wall(body: Body, point: Array) -> bool:
    """Whether a point in O is in a box of the body: the oracle knows only its shapes."""
    for geometry in body.geometries:
        if isinstance(geometry.shape, Box):
            local = geometry.X_LS.inverse().apply(point)
            if np.all(np.abs(local) <= np.array(geometry.shape.size) / 2.0):
                return True
    return False


def test_a_round_peg_has_the_clearance_of_the_polygon_that_its_bore_is(scene: Scene) -> None:
    socket = scene.body("socket")
    assert socket.interior is not None
    found = fit(section(scene.body("round"), 0.02), socket.interior)
    assert found.clearance == pytest.approx(0.5e-3, abs=1e-9)
    # In every direction a circle of this clearance more is free of the walls, and of 0.1 mm more it is not.
    ring = [np.array([math.cos(a), math.sin(a), 0.0]) for a in np.linspace(0.0, math.tau, 720, endpoint=False)]
    at = np.array([0.0, 0.0, 0.035])
    assert not any(inside_a_wall(socket, (0.010 + found.clearance - 1e-7) * d + at) for d in ring)
    assert any(inside_a_wall(socket, (0.010 + found.clearance + 1e-4) * d + at) for d in ring)


@pytest.mark.parametrize("yaw", [0.0, 0.2, math.pi / 2.0])
def test_a_box_has_the_clearance_of_its_rotated_outline(scene: Scene, yaw: float) -> None:
    frame = scene.body("frame")
    assert frame.interior is not None
    c, s = abs(math.cos(yaw)), abs(math.sin(yaw))
    x, y = (0.04 - 0.03 * c - 0.02 * s) / 2.0, (0.02 - 0.03 * s - 0.02 * c) / 2.0
    found = fit(section(scene.body("square"), 0.02), frame.interior, yaw)
    assert found.clearance == pytest.approx(min(x, y), abs=1e-9)


def test_a_square_peg_turns_to_the_sides_of_its_hole_and_a_round_one_stays(scene: Scene) -> None:
    frame, socket = scene.body("frame").interior, scene.body("socket").interior
    assert frame is not None and socket is not None
    assert best_yaws(section(scene.body("square"), 0.02), frame, 0.1)[0] == pytest.approx(0.0)
    assert best_yaws(section(scene.body("round"), 0.02), socket, 0.1)[0] == pytest.approx(0.1)


def test_only_the_part_that_enters_counts(scene: Scene) -> None:
    peg = scene.body("peg")
    assert section(peg, 0.03).radii.max() == pytest.approx(0.015)
    assert len(section(peg, 0.03).points) == 1  # the head is above
    corner = np.abs(section(peg, 0.05).points).max()
    assert corner == pytest.approx(0.02)


def test_a_peg_stands_upright_over_the_hole_with_its_middle_on_the_axis(scene: Scene) -> None:
    square = scene.body("square")
    X_WS = Transform.of(xyz=(0.3, -0.2, 0.1))
    X_WO = upright(section(square, 0.02), X_WS, 0.05, 0.7)
    np.testing.assert_allclose(X_WO.apply([0.0, 0.0, -0.04]), [0.3, -0.2, 0.15], atol=1e-12)
    assert X_WO.rpy[2] == pytest.approx(0.7)


@pytest.mark.parametrize("clearance", [0.1e-3, 0.25e-3, 1e-3])
def test_the_spiral_comes_within_the_clearance_of_every_point(clearance: float) -> None:
    radius = 4e-3
    times, points = spiral(pitch_of(clearance), radius)
    path = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in pairwise(points)])
    rng = np.random.default_rng(1)
    far = radius * np.sqrt(rng.random(400))
    angle = math.tau * rng.random(400)
    wanted = far[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    nearest = np.array([np.min(np.linalg.norm(path - point, axis=1)) for point in wanted])
    assert nearest.max() < clearance
    assert np.all(points[0] == 0.0) and np.allclose(points[-1], 0.0, atol=1e-12)
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times)
    assert speed.max() <= 1.05 * SPEED  # the samples lie on chords


def test_what_gives_way_is_followed_at_the_speed_and_not_faster() -> None:
    """s' = min(2 pi b (F - p) / k, speed): a peg that slides with the friction p."""
    pressing = Pressing(np.array([0.0, 0.0, 1.0]), 15.0, 0.01, 0.05, yields=True)
    law, period = PressingReference(pressing, 400.0), 1e-3
    shifts = np.array([law.update(period, 3.0, 0.0) for _ in range(500)])
    np.testing.assert_allclose(np.diff(shifts) / period, 0.01, rtol=1e-9)
    assert law.missed == "" and law.unsteady == ""


def test_a_believed_place_on_a_circle_is_always_off_by_its_radius() -> None:
    known = Known.of(KnownSpec.model_validate({"region": {"circle": "3 mm"}}))
    rng = np.random.default_rng(2)
    errors = np.array([known.error(tuple(rng.random(4)))[0] for _ in range(4000)])
    np.testing.assert_allclose(np.linalg.norm(errors, axis=1), 3e-3)
    # The standard error of the variance is 1.1 % here.
    np.testing.assert_allclose(errors.T @ errors / len(errors), known.covariance[:3, :3], atol=0.05 * 4.5e-6)


@pytest.mark.parametrize(
    ("spec", "code"),
    [
        ({"object": "square", "into": "socket"}, "TASK351"),
        ({"object": "round", "into": "square"}, "TASK350"),
        ({"object": "round", "into": "socket", "depth": "4 cm"}, "TASK352"),
        ({"object": "round", "into": "socket"}, ""),
        ({"object": "peg", "into": "socket"}, "TASK351"),
    ],
)
def test_what_does_not_fit_is_refused(scene: Scene, spec: dict[str, str], code: str) -> None:
    robot = load_task(ROOT / "tasks" / "home.yaml").robot
    assert [problem.code for problem in check(InsertSpec.model_validate(spec), robot, scene)] == (
        [code] if code else []
    )


def test_a_body_whose_shapes_are_not_known_yet_is_not_judged(scene: Scene) -> None:
    bare = replace(scene, bodies=tuple(replace(b, geometries=()) if b.name == "round" else b for b in scene.bodies))
    robot = load_task(ROOT / "tasks" / "home.yaml").robot
    assert check(InsertSpec.model_validate({"object": "round", "into": "socket"}), robot, bare) == ()
