"""The picture of the README is drawn from a log by a script that still works."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]


def test_the_picture_of_the_readme_is_there_and_small() -> None:
    picture = ROOT / "docs" / "pour.png"
    assert "](docs/pour.png)" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size < 400_000


@pytest.mark.slow
def test_the_script_draws_the_pour_from_its_log(pour_run, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    drawn = tmp_path / "pour.png"
    words = [sys.executable, ROOT / "docs" / "make_pictures.py", pour_run.log, "--out", drawn]
    subprocess.run(words, check=True, capture_output=True, cwd=ROOT)
    with image.open(drawn) as picture, image.open(ROOT / "docs" / "pour.png") as shown:
        assert picture.size == shown.size
        # Six panels, each with a pale green cup and a white arm somewhere.
        pixels = np.asarray(picture.convert("RGB"), dtype=int).reshape(2, -1, *np.asarray(picture).shape[1:])
    red, green, blue = (pixels[..., k] for k in range(3))
    cup = (green > red + 10) & (green > blue + 10)
    arm = (pixels.min(axis=-1) > 225) & (pixels.min(axis=-1) < 254)  # the gaps between panels are 255
    for seen, least in ((cup, 200), (arm, 1000)):
        for row in seen:
            assert all(panel.sum() > least for panel in np.array_split(row, 3, axis=1))
