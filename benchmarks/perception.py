"""python -m benchmarks.perception [--poses N]: error and time of finding bodies in depth pictures.

Random poses within +-5 cm and at any rotation (a box: +-90 deg) on a desk; a camera 0.4 to 0.8 m away, 25 to 70 deg
above it, 320x240 pixels with the noise of examples/15_camera, lateral noise, grazing angles and limit of incidence
included, without its least depth of 0.4 m. The depth measured is that of the whole scene, so no pixel is known to be
the body's. A rotation is hidden where the covariance says that it is uncertain by more than 5 deg.

With small_gicp (pip install small_gicp) the same bodies are also found by its registration: point-to-plane steps from
the same starts, to model points that the camera sees at each of them; the result is projected on what the prior allows,
and the best one chosen by the same comparison of pictures as ours. Processor times of the process.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array, Transform, wrapped
from manipcli.perception.fit import Fit
from manipcli.perception.localise import DepthView, NotSeen, Prior, localise
from manipcli.perception.picture import cut
from manipcli.perception.seen_surface import looks_same, seen_surface
from manipcli.render.lens import Lens
from manipcli.render.raster import Raster
from manipcli.render.surface import Surface, box_surface
from manipcli.scene import body_shapes
from manipcli.scene.body_shapes import BodyShape
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Geometry, Rgba
from manipcli.simulate.depth_noise import DepthMeasurement
from manipcli.simulate.sensors.camera import CameraSpec
from manipcli.spec.scene import BoxSpec, CupSpec, SphereSpec
from manipcli.task.load_task import load_task

EXAMPLE: Final = Path(__file__).parents[1] / "examples/15_camera/task.yaml"
REGION: Final = 0.05
NEAREST, FARTHEST, LOWEST, HIGHEST = 0.4, 0.8, math.radians(25.0), math.radians(70.0)
HIDDEN: Final = math.radians(5.0)
UP: Final = (0.0, 0.0, 1.0)
GREY: Final[Rgba] = (0.5, 0.5, 0.5, 1.0)
DESK: Final = box_surface(Box((0.6, 1.0, 0.4))).moved(Transform.of(xyz=(0.0, 0.0, -0.2)))
Method = Callable[[DepthView, Prior, Array], tuple[Transform, float]]


class Wanted(NamedTuple):
    """A body, the height of its origin on the desk [m], and its largest rotation [rad]."""

    body: Body
    height: float
    rotation: float


class Trial(NamedTuple):
    """Errors of position [m] and rotation [rad] (nan: not seen), whether the rotation is hidden, and the time [s]."""

    position: float
    rotation: float
    hidden: bool
    time: float


def wanted() -> dict[str, Wanted]:
    """The bodies."""

    def body(shape: BodyShape, *more: Geometry) -> Body:
        X = Transform.identity()
        return Body("it", "it", (*shape.geometries, *more), 0.2, X, np.eye(3), 0.5, 0.0, 0.0, 0.0, False, X,
                    shape.interior, shape.size, shape.centre)  # fmt: skip

    cup = body_shapes.cup(CupSpec(radius=0.036, height=0.11, wall=0.004), GREY)
    handle = [
        Geometry(Transform.of(xyz=(0.05, 0.0, 0.08)), Box((0.03, 0.012, 0.01)), GREY),
        Geometry(Transform.of(xyz=(0.05, 0.0, 0.035)), Box((0.03, 0.012, 0.01)), GREY),
        Geometry(Transform.of(xyz=(0.06, 0.0, 0.0575)), Box((0.01, 0.012, 0.055)), GREY),
    ]
    return {
        "cup": Wanted(body(cup), 0.0, math.pi),
        "cup with a handle": Wanted(body(cup, *handle), 0.0, math.pi),
        "box": Wanted(body(body_shapes.box(BoxSpec(size=(0.06, 0.1, 0.05)), GREY)), 0.025, math.pi / 2.0),
        "sphere": Wanted(body(body_shapes.sphere(SphereSpec(radius=0.04), GREY)), 0.04, math.pi),
    }


def camera() -> CameraSpec:
    """That of the example, which also sees what is near."""
    found = load_task(EXAMPLE).sensors["kinect"]
    assert isinstance(found, CameraSpec)
    depth = found.limits.depth.model_copy(update={"least": 0.0})
    return found.model_copy(update={"limits": found.limits.model_copy(update={"depth": depth})})


def shot(lens: Lens, X_WC: Transform, *placed: tuple[Surface, Transform]) -> tuple[Array, Array]:
    """(h, w) exact depth [m] and cosine of the angle of incidence."""
    X_CW = X_WC.inverse()
    poses = [X_CW @ X for _, X in placed]
    raster = Raster([each for each, _ in placed], lens, 0.01)
    seen = raster.see(np.array([X.R for X in poses]), np.array([X.p for X in poses]), np.array([0.0, 0.0, -1.0]))
    return seen.depth.copy(), seen.slope / np.sqrt(1.0 + lens.columns**2 + lens.rows[:, None] ** 2)


def looking(rng: np.random.Generator) -> Transform:
    """X_WC of a camera that looks at the middle of the region."""
    distance, up, around = rng.uniform(NEAREST, FARTHEST), rng.uniform(LOWEST, HIGHEST), rng.uniform(0.0, 2.0 * math.pi)
    z = -np.array([math.cos(up) * math.cos(around), math.cos(up) * math.sin(around), math.sin(up)])
    x = np.cross(z, UP)
    x /= np.linalg.norm(x)
    return Transform.of(xyz=np.array([0.0, 0.0, 0.04]) - distance * z, R=np.stack([x, np.cross(z, x), z], axis=1))


def trial(of: Wanted, spec: CameraSpec, seed: int, method: Method) -> Trial:
    """One random pose."""
    rng, lens, noise = np.random.default_rng(seed), spec.lens, spec.noise.depth
    yaw = rng.uniform(-of.rotation, of.rotation)
    true = Transform.of(xyz=(*rng.uniform(-REGION, REGION, 2), of.height), rpy=(0.0, 0.0, yaw))
    X_WC = looking(rng)
    expected, _ = shot(lens, X_WC, (DESK, Transform.identity()))
    exact = shot(lens, X_WC, (DESK, Transform.identity()), (seen_surface(of.body.geometries), true))
    measurement = DepthMeasurement(spec.noise, spec.limits, expected.shape, 0.04)
    depth = measurement.measure(*exact, measurement.draw(rng)).astype(np.float64)
    view = DepthView(lens, X_WC, depth, noise.white + noise.quadratic * np.square(depth - noise.offset))
    prior = Prior(of.body, Transform.of(xyz=(0.0, 0.0, of.height)), np.array([REGION, REGION, 0.0]), of.rotation)
    began = time.process_time()
    try:
        X_WO, deviation = method(view, prior, expected)
    except NotSeen:
        return Trial(math.nan, math.nan, False, time.process_time() - began)
    taken = time.process_time() - began
    turn = true.R.T @ X_WO.R
    off = abs(math.atan2(turn[1, 0], turn[0, 0]))
    return Trial(float(np.linalg.norm(X_WO.p - true.p)), off, deviation > HIDDEN, taken)


def ours(view: DepthView, prior: Prior, expected: Array) -> tuple[Transform, float]:
    found = localise(view, prior, expected)
    return found.X_WO, 0.0 if found.free is not None else math.sqrt(found.covariance[5, 5])


def by_small_gicp(view: DepthView, prior: Prior, expected: Array) -> tuple[Transform, float]:
    """The registration of small_gicp from starts every 20 deg."""
    import small_gicp

    shown = seen_surface(prior.body.geometries)
    reach = np.append(prior.region[:2] + 0.08, 0.15)
    low, high = prior.X_WO.p - reach, prior.X_WO.p + reach
    picture = cut(view.lens, view.X_WC, view.depth, view.noise, expected, low, high)
    if picture is None or picture.near.sum() < 30:
        raise NotSeen("few pixels")
    source = view.X_WC.apply((picture.rays * picture.depth[..., None])[picture.near])
    free = looks_same(prior.body.geometries, UP)
    starts = 1 if free else math.ceil(2.0 * prior.rotation / math.radians(20.0))
    fit = Fit(picture, shown, prior.X_WO, np.append(prior.region, prior.rotation))
    found: list[tuple[float, float, Transform]] = []
    for k in range(starts):
        R = Transform.of(rpy=(0.0, 0.0, -prior.rotation + 2.0 * prior.rotation * k / starts)).R @ prior.X_WO.R
        X = Transform.of(xyz=prior.X_WO.p, R=R)
        for _ in range(2):  # what is seen of the model, moved onto the middle of what was measured
            depth, _ = shot(picture.lens, view.X_WC, (shown, X))
            hit = np.isfinite(depth)
            model = view.X_WC.apply(picture.rays[hit] * depth[hit][:, None])
            if len(model) < 30:
                break
            shift = (source.mean(axis=0) - model.mean(axis=0)) * np.array([1.0, 1.0, 0.0])
            X = Transform.of(xyz=X.p + shift, R=X.R)
            model = model + shift
        if len(model) < 30:
            continue
        target, tree = small_gicp.preprocess_points(model, 2e-3, 10, 1)
        cloud, _ = small_gicp.preprocess_points(source, 2e-3, 10, 1)
        result = small_gicp.align(
            target, cloud, tree, registration_type="PLANE_ICP", max_correspondence_distance=0.02, num_threads=1,
            max_iterations=30, translation_epsilon=1e-5, rotation_epsilon=1e-4,
        )  # fmt: skip
        move = np.linalg.inv(result.T_target_source) @ X.matrix
        yaw = math.atan2(move[1, 0], move[0, 0]) - math.atan2(prior.X_WO.R[1, 0], prior.X_WO.R[0, 0])
        state = np.append(np.clip(move[:3, 3] - prior.X_WO.p, -prior.region, prior.region), yaw)
        found.append((fit.compare(state).cost, abs(float(wrapped(np.array(yaw)))), fit.pose(state)))
    if not found:
        raise NotSeen("no start")
    return min(found, key=lambda each: each[:2])[2], 0.0


def row(name: str, of: Wanted, trials: list[Trial]) -> str:
    """A line of the table."""
    error = 1e3 * np.array([each.position for each in trials])
    seen = np.isfinite(error)
    turns = not looks_same(of.body.geometries, UP)
    clear = np.degrees([each.rotation for each in trials if math.isfinite(each.rotation) and not each.hidden])
    if of.rotation < math.pi:  # a box looks the same after half a turn
        clear = np.minimum(clear, 180.0 - clear)
    hidden = [math.degrees(each.rotation) for each in trials if each.hidden]
    angles = (
        f"{np.median(clear):.2f}, {np.percentile(clear, 95):.2f}, {clear.max():.2f}" if turns and len(clear) else ""
    )
    cells = [
        name,
        f"{seen.sum()} of {len(trials)}",
        f"{np.nanmedian(error):.2f}, {np.nanpercentile(error, 95):.2f}, {np.nanmax(error):.2f}", angles,
        f"{len(hidden)}, {max(hidden):.0f}" if hidden else ("0" if turns else ""),
        f"{1e3 * np.median([each.time for each in trials]):.0f}",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Print one row per body and method."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.perception", description=__doc__)
    parser.add_argument("--poses", type=int, default=200, help="of every body [default: 200]")
    poses, spec = parser.parse_args().poses, camera()
    methods: dict[str, Method] = {"": ours}
    if importlib.util.find_spec("small_gicp"):
        methods[", small_gicp"] = by_small_gicp
    print("Errors: median, 95 %, largest. Hidden: number of hidden rotations, largest error of them [deg].\n")
    print("| body | found | position [mm] | rotation [deg] | hidden | ms |\n|---|---|---|---|---|---|")
    for name, of in wanted().items():
        for suffix, method in methods.items():
            print(row(name + suffix, of, [trial(of, spec, seed, method) for seed in range(poses)]), flush=True)


if __name__ == "__main__":
    main()
