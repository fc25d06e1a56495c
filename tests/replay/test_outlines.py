"""Outlines and light of pictures: white is seen before white, and has a form in the shade."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.geometry import Array, frozen
from manipcli.render.drawing import draw
from manipcli.render.placing import Placing
from manipcli.replay.camera import Camera
from manipcli.replay.lighting import brightness, shadow_loss
from manipcli.replay.outlines import DARKNESS, outline_light
from manipcli.replay.renderer import Renderer
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Box, Sphere
from tests.replay.test_frames import body

WHITE = (1.0, 1.0, 1.0, 1.0)
FRONT = Camera(eye=(2.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), field=40.0)
SIZE = (160, 120)


def picture(*shapes: tuple[Box | Sphere, tuple[float, ...]]) -> Array:
    bodies = tuple(body(f"b{k}", shape, WHITE, at) for k, (shape, at) in enumerate(shapes))
    scene = Scene(bodies=bodies, frames=(), gravity=frozen([0.0, 0.0, -9.8]))
    renderer = Renderer(draw(None, scene), size=SIZE, shadows=False)
    return renderer.picture(Placing(None, scene).start(), FRONT).astype(float)[..., 0]


def test_white_before_white_has_an_outline() -> None:
    """A ball before a wall: along its projected circle the picture is darker than on both sides."""
    image = picture((Sphere(0.15), (0.5, 0.0, 0.0)), (Box((0.1, 3.0, 3.0)), (-0.5, 0.0, 0.0)))
    # The tangent cone of a ball of 0.15 m at 1.5 m; 2 m away, 120 pixels are 1.456 m.
    radius = 120.0 / 1.456 * 2.0 * np.tan(np.arcsin(0.15 / 1.5))
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)

    def at(r: float) -> Array:
        return np.array(
            [image[int(60 + r * s), int(80 + r * c)] for s, c in zip(np.sin(angle), np.cos(angle), strict=True)]
        )

    inside, outside = at(radius - 3.0), at(radius + 3.0)
    edge = np.min([at(radius + r) for r in (-1.6, -1.2, -0.8, -0.4, 0.0, 0.4)], axis=0)
    assert (edge < 0.9 * np.minimum(inside, outside)).mean() > 0.95


@pytest.mark.parametrize("slope", [0.0, 1.0, 30.0])
def test_a_plane_has_no_outline_however_flat_it_is_seen(slope: float) -> None:
    """Depth of the plane z = 1 - s x in the optical frame, with u = x / z: z = 1 / (1 + s u)."""
    u = np.tile(np.linspace(0.0, 0.4, 200), (50, 1))
    assert outline_light(1.0 / (1.0 + slope * u)).min() == pytest.approx(1.0, abs=1e-6)


def test_the_nearer_side_of_a_jump_is_dark() -> None:
    depth = np.full((20, 20), 2.0)
    depth[:, 10:] = 1.5
    light = outline_light(depth)
    assert np.flatnonzero(light[10] < 1.0).tolist() == [10, 11, 12]
    np.testing.assert_allclose(light[10, 10:13], 1.0 - DARKNESS, atol=1e-6)
    depth[:, 10:] = np.inf  # before the sky, the left side is the nearer one
    assert np.flatnonzero(outline_light(depth)[10] < 1.0).tolist() == [7, 8, 9]


def test_white_keeps_its_form_in_light_and_shade() -> None:
    image = picture((Sphere(0.5), (0.0, 0.0, 0.0)))
    column = image[25:96, 80]
    assert len(np.unique(column)) > 40
    assert column.max() < 255.0


def test_light_grows_with_the_cosine_and_a_shadow_leaves_some() -> None:
    cosine = np.linspace(-1.0, 1.0, 50)
    assert (np.diff(brightness(cosine)) > 0.0).all()
    assert brightness(cosine)[0] > 0.0 and brightness(cosine)[-1] < 1.0
    left = brightness(cosine) * (1.0 - shadow_loss(cosine))
    assert (shadow_loss(cosine)[cosine <= 0.0] == 0.0).all()
    assert left.min() >= brightness(cosine)[0]
