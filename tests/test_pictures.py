"""The picture of the README is what `replay --sheet` draws of the task that it shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[1]
SIZE = "500x400"


def test_the_picture_of_the_readme_is_there_and_small() -> None:
    picture = ROOT / "docs" / "pictures" / "pour.png"
    assert "](docs/pictures/pour.png)" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size < 400_000


@pytest.mark.slow
def test_the_pour_is_drawn_from_its_log_as_the_readme_shows_it(pour_run, call_cli, tmp_path: Path) -> None:
    drawn = tmp_path / "pour.png"
    ran = call_cli("replay", pour_run.log, "--sheet", drawn, "--size", SIZE, cwd=ROOT)
    assert (ran.code, ran.err) == (0, "")
    with Image.open(drawn) as picture, Image.open(ROOT / "docs" / "pictures" / "pour.png") as shown:
        assert picture.size == shown.size
        # Six tiles, each with a pale green cup and a white arm somewhere.
        pixels = np.asarray(picture.convert("RGB"), dtype=int)
    half = len(pixels) // 2
    red, green, blue = (pixels[..., k] for k in range(3))
    cup = (green > red + 10) & (green > blue + 10) & (green > 100)
    arm = (pixels.min(axis=-1) > 215) & (pixels.min(axis=-1) < 254)  # the paper between the tiles is 255
    for seen, least in ((cup, 200), (arm, 1000)):
        for row in (seen[:half], seen[half:]):
            assert all(tile.sum() > least for tile in np.array_split(row, 3, axis=1))
