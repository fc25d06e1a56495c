"""Pictures: what stands where in them, and the same bytes every time."""

from __future__ import annotations

import io
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PillowImage

from manipcli.core.geometry import Transform, frozen
from manipcli.render.drawing import draw
from manipcli.render.placing import Placing
from manipcli.render.shading import TO_LIGHT
from manipcli.replay.camera import Camera, framing
from manipcli.replay.renderer import Renderer, png_bytes, sky
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Sphere


def _body(name: str, shape: Box | Sphere, rgba: tuple[float, float, float, float], at: tuple[float, ...]) -> Body:
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape, rgba),), mass=1.0,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=False, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen([1.0, 1.0, 1.0]), centre=frozen([0.0, 0.0, 0.0]),
    )  # fmt: skip


RED, BLUE = (0.9, 0.1, 0.1, 1.0), (0.1, 0.1, 0.9, 1.0)
SCENE = Scene(
    bodies=(_body("left", Box((0.2, 0.2, 0.2)), RED, (0.0, -0.3, 0.0)), _body("right", Sphere(0.1), BLUE, (0, 0.3, 0))),
    frames=(),
    gravity=frozen([0.0, 0.0, -9.8]),
)
FRONT = Camera(eye=(2.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), field=40.0)


def test_a_png_file_holds_the_image() -> None:
    image = np.random.default_rng(1).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    assert np.array_equal(np.asarray(PillowImage.open(io.BytesIO(png_bytes(image)))), image)


def test_bodies_are_where_the_camera_sees_them_in_their_colours() -> None:
    renderer = Renderer(draw(None, SCENE), size=(160, 120))
    image = renderer.picture(Placing(None, SCENE).start(), FRONT)
    assert image.shape == (120, 160, 3)
    # 2 m away, 40 deg from top to bottom: 120 pixels are 1.456 m, so y = 0.3 is 25 pixels to the right of the middle.
    assert image[60, 80 - 25].argmax() == 0  # seen from +x with z up, -y is to the left
    assert image[60, 80 + 25].argmax() == 2
    assert np.array_equal(image[0, 0], sky(120)[0, 0])
    assert np.abs(image[60, 80].astype(int) - sky(120)[60, 0]).max() <= 1  # between the two
    is_blue = image[..., 2].astype(int) - image[..., 0] > 30  # its outline is darker; the sky has 21
    # The outline of the ball: a circle of radius 0.1 / 2 m.
    assert is_blue.sum() == pytest.approx(math.pi * (0.1 / 1.456 * 120) ** 2, rel=0.05)


def test_a_body_that_moved_is_drawn_where_it_is_now() -> None:
    placing = Placing(None, SCENE)
    swapped = placing.at(
        np.zeros(0), np.array([[0.0, 0.3, 0.0], [0.0, -0.3, 0.0]]), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    )
    renderer = Renderer(draw(None, SCENE), size=(160, 120))
    image = renderer.picture(swapped, FRONT)
    assert image[60, 80 + 25].argmax() == 0
    assert image[60, 80 - 25].argmax() == 2


def test_the_framing_has_everything_in_view_and_not_much_more(tmp_path: Path) -> None:
    for scale in (0.01, 1.0, 100.0):
        bodies = tuple(
            replace(body, geometries=(replace(body.geometries[0], shape=Sphere(0.1 * scale)),), X_WO=X)
            for body in SCENE.bodies
            for X in [Transform.of(xyz=scale * body.X_WO.p)]
        )
        scene = replace(SCENE, bodies=bodies)
        drawing, poses = draw(None, scene), Placing(None, scene).start()
        camera = framing(drawing, poses)
        # Its distance is at least 0.1 m, so that the smallest things do not fill the picture.
        if scale >= 1.0:
            renderer = Renderer(drawing, size=(160, 120))
            image = renderer.picture(poses, camera)
            strange = np.abs(image.astype(int) - sky(120)).max(axis=2) > 20
            rows, columns = np.flatnonzero(strange.any(axis=1)), np.flatnonzero(strange.any(axis=0))
            assert rows[0] > 1 and rows[-1] < 118 and columns[0] > 1 and columns[-1] < 158
            assert max((rows[-1] - rows[0]) / 120, (columns[-1] - columns[0]) / 160) > 0.75


def test_the_same_picture_is_the_same_bytes() -> None:
    drawn = []
    for _ in range(2):
        renderer = Renderer(draw(None, SCENE), size=(80, 60))
        drawn.append(png_bytes(renderer.picture(Placing(None, SCENE).start(), FRONT)))
    assert drawn[0] == drawn[1]


@pytest.mark.parametrize("ground", [None, 0.0])
def test_a_shadow_is_where_the_light_cannot_reach(ground: float | None) -> None:
    """A plate above a floor or the ground, seen from above; oracle: the plate moved along the light to the floor."""
    floor = replace(_body("floor", Box((4.0, 4.0, 0.1)), (0.8, 0.8, 0.8, 1.0), (0.0, 0.0, -0.05)), fixed=True)
    plate = _body("plate", Box((0.4, 0.4, 0.01)), RED, (-0.2, 0.1, 0.5))
    scene = Scene(bodies=(floor, plate) if ground is None else (plate,), frames=(), gravity=frozen([0.0, 0.0, -9.8]))
    camera, placing, size = Camera(eye=(0.0, 0.0, 3.0), target=(0.0, 0.0, 0.0), field=40.0), Placing(None, scene), 200
    drawing, poses = draw(None, scene), placing.start()
    bright, dark = (
        Renderer(drawing, size=(size, size), still=placing.still, shadows=shadows, ground=ground)
        .picture(poses, camera)
        .astype(int)
        for shadows in (False, True)
    )
    darker = (bright - dark).max(axis=2) > 20
    assert np.all(dark <= bright)
    v, u = np.nonzero(darker)
    focal = size / 2.0 / math.tan(math.radians(20.0))
    # Seen from above with x up: x is up and -y to the right; 3 m from the camera.
    x, y = (size / 2.0 - v - 0.5) * 3.0 / focal, (size / 2.0 - u - 0.5) * 3.0 / focal
    dx, dy = 0.5 * TO_LIGHT[:2] / TO_LIGHT[2]
    # 5 mm in the picture from the light, 11 mm a pixel; the plate hides a part of its shadow.
    assert np.all((np.abs(x + 0.2 + dx) < 0.22) & (np.abs(y - 0.1 + dy) < 0.22))
    assert [x.min(), x.max()] == pytest.approx([-0.4 - dx, -dx], abs=0.03)
    assert y.min() == pytest.approx(-0.1 - dy, abs=0.03)


def test_no_physics_library_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("pybullet", "mujoco"):
        monkeypatch.setitem(sys.modules, name, None)
    placing = Placing(None, SCENE)
    image = Renderer(draw(None, SCENE), size=(80, 60), still=placing.still).picture(placing.start(), FRONT)
    assert np.ptp(image) > 100
