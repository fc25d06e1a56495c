"""Noise of depth: its standard deviation by distance and angle of incidence, and what is not measured."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.simulate.depth_noise import CameraLimits, CameraNoise, DepthMeasurement

SHAPE = 300, 400
KINECT = {"white": 1.2e-3, "quadratic": 1.9e-3, "offset": 0.4, "grazing": 1e-4}


def measured(noise: dict[str, object], z: float, angle: float, limits: CameraLimits | None = None) -> Array:
    measurement = DepthMeasurement(CameraNoise.model_validate(noise), limits or CameraLimits(), SHAPE, 0.04)
    draw = measurement.draw(np.random.default_rng(1))
    return measurement.measure(np.full(SHAPE, z), np.full(SHAPE, np.cos(angle)), draw).astype(np.float64)


@pytest.mark.parametrize(("z", "angle"), [(0.5, 0.0), (2.0, 0.0), (0.8, 1.2), (3.0, 1.4)])
def test_standard_deviation_grows_as_measured_for_a_kinect(z: float, angle: float) -> None:
    found = measured({"depth": KINECT}, z, angle)
    sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / np.sqrt(z) * angle**2 / (np.pi / 2.0 - angle) ** 2
    assert found.std() == pytest.approx(sigma, rel=0.01)
    assert found.mean() == pytest.approx(z, abs=sigma / 50.0)


def test_lost_far_and_grazing_pixels_have_no_depth() -> None:
    assert np.isnan(measured({"dropout": 0.1}, 1.0, 0.0)).mean() == pytest.approx(0.1, abs=0.005)
    limits = CameraLimits.model_validate({"depth": {"least": "40 cm", "most": "4 m"}, "incidence": "80 deg"})
    for z, angle, lost in ((0.3, 0.0, 1.0), (4.1, 0.0, 1.0), (1.0, 1.45, 1.0), (1.0, 1.35, 0.0)):
        assert np.isnan(measured({}, z, angle, limits)).mean() == lost


def test_depth_is_quantised_and_has_an_offset_that_walks() -> None:
    steps = measured({"depth": {"white": 0.01, "quantisation": 0.005}}, 1.0, 0.0) / 0.005
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    noise = CameraNoise.model_validate({"depth": {"bias": 1e-3, "walk": 0.1}})
    rng, ends = np.random.default_rng(0), []
    for _ in range(400):
        measurement = DepthMeasurement(noise, CameraLimits(), (1, 1), 0.04)
        offsets = [measurement.draw(rng).offset for _ in range(26)]
        ends.append((offsets[0], offsets[25] - offsets[0]))
    assert np.std([first for first, _ in ends]) == pytest.approx(1e-3, rel=0.15)
    assert np.std([walked for _, walked in ends]) == pytest.approx(0.1, rel=0.15), "after 25 intervals, 1 s"
