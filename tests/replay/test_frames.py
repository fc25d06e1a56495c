"""Pictures, sheets and videos of a run: what is seen where, what is written in, how many and how long."""

from __future__ import annotations

import io
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Transform, frozen
from manipcli.judge.verdict import StepOutcome, Verdict
from manipcli.render.drawing import draw
from manipcli.render.placing import Placing, Poses
from manipcli.replay import contact_sheet as sheets
from manipcli.replay import video as videos
from manipcli.replay.camera import VIEWS, Camera, direction
from manipcli.replay.caption import NOW
from manipcli.replay.frames import Frames, clearest_time, moment, parse_size
from manipcli.replay.playback import Playback, PlaybackStep
from manipcli.replay.renderer import Renderer, png_bytes
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Sphere

SIZE = (192, 144)


def body(
    name: str, shape: Box | Sphere, rgba: tuple[float, ...], at: tuple[float, ...], *, fixed: bool = False
) -> Body:
    size = shape.size if isinstance(shape, Box) else (2 * shape.radius,) * 3
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape, rgba),), mass=1.0,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen(size), centre=frozen([0.0, 0.0, 0.0]),
    )  # fmt: skip


RED, GREEN = (0.95, 0.05, 0.05, 1.0), (0.05, 0.6, 0.1, 1.0)
SCENE = Scene(
    bodies=(
        body("table", Box((0.8, 0.8, 0.05)), (0.5, 0.5, 0.5, 1.0), (0.0, 0.0, -0.2), fixed=True),
        body("ball", Sphere(0.06), RED, (0.0, -0.3, 0.3)),
        body("cube", Box((0.1, 0.1, 0.1)), GREEN, (0.0, -0.15, 0.0)),
    ),
    frames=(),
    gravity=frozen([0.0, 0.0, -9.8]),
)
STEPS = (
    PlaybackStep("carry_1", "carry", "carry_1", 0.0, 1.0, "done"),
    PlaybackStep("drop_1", "drop", "drop_1", 1.0, 2.0, "failed", "it fell"),
)
OUTCOMES = (
    StepOutcome("carry_1", "carry", "done", 0.0, 1.0, 1.0),
    StepOutcome("drop_1", "drop", "failed", 1.0, 2.0, 1.0, "it fell"),
    StepOutcome("rest_1", "rest", "not_run", None, None, 1.0),
)


def run(**changes: object) -> Playback:
    """Two seconds at 50 Hz: the ball goes from left to right, then falls freely from rest."""
    times = np.arange(101) / 50.0
    first, fall = np.minimum(times, 1.0), np.maximum(times - 1.5, 0.0)
    position = np.zeros((101, 2, 3))
    position[:, 0] = np.stack([0.0 * times, -0.3 + 0.6 * first, 0.3 - 0.5 * 9.81 * fall**2 / 4.0], axis=1)
    position[:, 1] = (0.0, -0.15, 0.0)
    quat = np.zeros((101, 2, 4))
    quat[..., 3] = 1.0
    none = np.zeros((101, 0))
    verdict = Verdict("demo", "failed", 1, "kinematic", 2.0, OUTCOMES, (), text="step 'drop_1' failed: it fell")
    made = Playback(
        name="demo", robot=None, scene=SCENE, joint_names=(), times=times, position=none, velocity=none, effort=none,
        reference=none, body_position=position, body_quat_xyzw=quat, contacts=((),) * 101,
        contact_times=((),) * 101, steps=STEPS, verdict=verdict,
    )  # fmt: skip
    return replace(made, **changes)


def seen_at(camera: Camera, point: tuple[float, ...], size: tuple[int, int]) -> tuple[float, float]:
    """Where a pinhole camera sees a point: written down once more, from nothing but what a camera says it is."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    z = (target - eye) / math.dist(target, eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    a, b, c = np.array([x, y, z]) @ (np.array(point) - eye)
    focal = size[1] / (2.0 * math.tan(math.radians(camera.field) / 2.0))
    return size[0] / 2.0 + focal * a / c, size[1] / 2.0 + focal * b / c


def middle_of(image: np.ndarray, channel: int) -> tuple[float, float]:
    """The middle of all pixels in which one colour is much stronger than the others."""
    strong = image[..., channel].astype(int) - np.delete(image, channel, axis=2).max(axis=2) > 60
    rows, columns = np.nonzero(strong)
    assert len(rows) > 10
    return float(columns.mean()) + 0.5, float(rows.mean()) + 0.5


def test_things_are_where_the_camera_says() -> None:
    playback = run()
    frames = Frames(playback, size=SIZE, captions=False)
    for time in (0.0, 0.5, 1.0, 1.7, 2.0):
        k = playback.index(time)
        expected = seen_at(frames.camera, tuple(playback.body_position[k, 0]), SIZE)
        assert middle_of(frames.at(time), 0) == pytest.approx(expected, abs=1.5)
        expected = seen_at(frames.camera, (0.0, -0.15, 0.0), SIZE)
        assert middle_of(frames.at(time), 1) == pytest.approx(expected, abs=2.5)
    points = playback.body_position[::10, 0]
    x, y, depth = frames.camera.project(points, SIZE)
    for k, point in enumerate(points):
        assert (x[k], y[k]) == pytest.approx(seen_at(frames.camera, tuple(point), SIZE))
    assert (depth > 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("view", [*VIEWS, "90,0", "-45,60", "10,-20", "0,90"])
def test_all_of_the_run_is_in_view_from_everywhere(view: str) -> None:
    playback = run()
    frames = Frames(playback, size=SIZE, towards=direction(view))
    x, y, depth = frames.camera.project(playback.body_position.reshape(-1, 3), SIZE)
    assert x.min() > 0.0 and x.max() < SIZE[0] and y.min() > 0.0 and y.max() < SIZE[1] and depth.min() > 0.0
    backward = np.subtract(frames.camera.eye, frames.camera.target)
    assert np.cross(backward, direction(view)) == pytest.approx(np.zeros(3), abs=1e-6)


def test_azimuth_turns_from_the_front_to_the_left() -> None:
    assert direction("0,0") == pytest.approx((1.0, 0.0, 0.0))
    assert direction("90,0") == pytest.approx((0.0, 1.0, 0.0))
    assert direction("0,90") == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)


@pytest.mark.slow
def test_what_stands_still_is_drawn_once_and_looks_the_same() -> None:
    playback = run()
    placing, drawing = Placing(None, SCENE), draw(None, SCENE)
    assert placing.still == {"world", "table"}
    poses = placing.at(playback.position, playback.body_position, playback.body_quat_xyzw)
    camera = Camera((1.6, 0.5, 0.5), (0.0, 0.1, 0.0))
    near = Camera((0.2, -0.15, 0.05), (0.0, -0.15, 0.0))  # its near plane is in the cube
    away = Camera((1.6, 0.5, 0.5), (3.0, 0.5, 0.5))
    whole = Renderer(drawing, size=SIZE, shadows=False)
    parts = Renderer(drawing, size=SIZE, still=placing.still, shadows=False)
    for one in (camera, near, away, camera):
        for k in (0, 50, 100):
            now = Poses(poses.position[k], poses.quat_xyzw[k])
            difference = np.abs(whole.picture(now, one).astype(int) - parts.picture(now, one))
            assert difference.max() <= 2


def test_step_time_and_timeline_are_written_in() -> None:
    playback = run()
    frames = Frames(playback, size=(320, 240))
    bare = Frames(playback, size=(320, 240), captions=False)
    drawn = {time: frames.at(time) for time in (0.5, 1.5, 2.0)}
    plain = {time: bare.at(time) for time in drawn}
    changed = {time: np.any(drawn[time] != plain[time], axis=2) for time in drawn}
    for image in changed.values():
        assert image[:24, :100].sum() > 60  # the step
        assert image[:24, -60:].sum() > 60  # the clock
        assert not image[40:-20].any()
    # Another step has another name.
    assert np.any(drawn[0.5][:24, :100] != drawn[1.5][:24, :100])
    # The bar is filled up to now; the second step failed, and its part is red.
    bar = {time: image[-12:] for time, image in drawn.items()}
    blue = {time: np.all(image == NOW, axis=2).any(axis=0).sum() for time, image in bar.items()}
    assert blue[0.5] == pytest.approx(0.25 * 306, abs=3)
    assert blue[1.5] == blue[2.0] == pytest.approx(0.5 * 306, abs=3)


@pytest.mark.slow
def test_a_long_name_is_cut_and_a_tiny_picture_is_drawn() -> None:
    steps = (replace(STEPS[0], label="x" * 500 + "\x1b"),)
    for size in ((64, 64), (320, 240)):
        frames = Frames(run(steps=steps), size=size)
        assert frames.at(0.0).shape == (size[1], size[0], 3)


def test_a_sheet_has_one_tile_a_step_at_its_moment() -> None:
    playback = run()
    image = sheets.contact_sheet(playback, size=SIZE)
    shown = sheets.tiles(playback)
    assert [tile.label for tile in shown] == ["carry_1", "drop_1", "rest_1"]
    assert image.shape[1] == 3 * (SIZE[0] + sheets.GAP) + sheets.GAP
    top = image.shape[0] - sheets.GAP - SIZE[1] - round(2.1 * 9)
    frames = Frames(playback, size=SIZE, captions=False)
    for k, tile in enumerate(shown):
        left = sheets.GAP + k * (SIZE[0] + sheets.GAP)
        part = image[top : top + SIZE[1], left : left + SIZE[0]]
        label = image[top + SIZE[1] : top + SIZE[1] + 18, left : left + SIZE[0]]
        assert (label < 128).any()
        if tile.time is None:
            assert (part.reshape(-1, 3) == (240, 242, 245)).all(axis=1).mean() > 0.8
        else:
            assert np.array_equal(part, frames.at(tile.time))


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (2, 2), (3, 3), (4, 4), (6, 3), (9, 3), (10, 4), (30, 4)])
def test_a_sheet_is_about_as_wide_as_a_page(count: int, columns: int) -> None:
    assert sheets.columns_of(count) == columns


def test_a_run_without_steps_is_shown_by_moments() -> None:
    shown = sheets.tiles(run(steps=(), verdict=None))
    assert [tile.time for tile in shown] == pytest.approx(np.linspace(0.0, 2.0, sheets.MOMENTS))
    assert sheets.contact_sheet(run(steps=(), verdict=None), size=SIZE).ndim == 3


def test_a_step_is_shown_at_its_end_or_while_something_falls() -> None:
    playback = run()
    assert clearest_time(playback, STEPS[0]) == pytest.approx(0.98)
    # g / 4: it reaches 60 % of its last speed after 60 % of its fall of 0.5 s.
    assert clearest_time(playback, STEPS[1]) == pytest.approx(1.5 + 0.6 * 0.5, abs=0.03)
    assert moment(playback, "drop_1") == clearest_time(playback, STEPS[1])
    assert [moment(playback, text) for text in ("start", "end", "1.25", "300 ms")] == [0.0, 2.0, 1.25, 0.3]


@pytest.mark.parametrize(
    ("text", "says"), [("drop", "is not a time or step"), ("9", "outside the run"), ("2 kg", "is not a time or step")]
)
def test_what_is_no_moment_is_told(text: str, says: str) -> None:
    with pytest.raises(InvalidArgument, match=says):
        moment(run(), text)


@pytest.mark.parametrize("text", ["640", "640x", "x", "1x1", "99999x99", "640x360x2", "-640x360"])
def test_what_is_no_size_is_told(text: str) -> None:
    assert parse_size("640X360") == (640, 360)
    with pytest.raises(InvalidArgument, match="not a picture size"):
        parse_size(text)


@pytest.mark.parametrize("text", ["nowhere", "1", "1,2,3", "nan,0", "0,91"])
def test_what_is_no_view_is_told(text: str) -> None:
    with pytest.raises(InvalidArgument, match="not a view"):
        direction(text)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["webp", "gif"])
@pytest.mark.parametrize(("fps", "speed"), [(10.0, 1.0), (15.0, 4.0), (12.5, 0.5)])
def test_a_film_has_its_frames_and_lasts_as_long_as_the_run(
    tmp_path: Path, ending: str, fps: float, speed: float
) -> None:
    playback = run()
    video = videos.Video.of(playback, fps=fps, speed=speed)
    count = math.floor(2.0 * fps / speed) + 1
    assert len(video.times) == count
    assert np.diff(video.times) == pytest.approx(speed / fps)
    path, told = tmp_path / f"a.{ending}", []
    path.write_bytes(b"old")
    frames = Frames(playback, size=(96, 72))
    videos.write_video(path, frames, video, progress=lambda done, total: told.append((done, total)))
    assert told == [(k + 1, count) for k in range(count)]
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    with Image.open(path) as image:
        assert (image.n_frames, image.size) == (count, (96, 72))  # type: ignore[attr-defined]
        lasted = 0
        for k in range(count):
            image.seek(k)
            image.load()
            lasted += image.info["duration"]
        assert lasted == pytest.approx(1000.0 * count / fps, abs=10)


def test_the_frames_of_a_film_show_the_run(tmp_path: Path) -> None:
    playback = run()
    for ending in ("webp", "gif"):
        path = tmp_path / f"a.{ending}"
        frames = Frames(playback, size=SIZE, captions=False)
        # Without its clock the video would have equal frames, which are written as one.
        video = videos.Video((0.0, 0.5, 1.0, 1.8), 4.0)
        videos.write_video(path, frames, video)
        with Image.open(path) as image:
            for k, time in enumerate(video.times):
                image.seek(k)
                frame = np.asarray(image.convert("RGB"))
                assert np.abs(frame.astype(int) - frames.at(time)).mean() < 4.0
                assert middle_of(frame, 0) == pytest.approx(middle_of(frames.at(time), 0), abs=1.5)


def test_an_mp4_has_its_frames_too(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    playback, path = run(), tmp_path / "a.mp4"
    frames = Frames(playback, size=(97, 73))
    videos.write_video(path, frames, videos.Video.of(playback, fps=10.0))
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (96, 72)
        assert float(stream.duration * stream.time_base) == pytest.approx(2.1)
        assert sum(1 for _ in container.decode(video=0)) == 21


def test_without_the_extra_an_mp4_is_refused_with_the_way_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(InvalidArgument, match=r"\.mp4 needs the extra 'video'") as told:
        videos.check_ending(Path("a.mp4"))
    assert "pip install 'manipcli[video]'" in (told.value.findings[0].hint or "")


def test_a_film_that_breaks_off_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.webp"
    path.write_bytes(b"old")

    def stop(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    frames = Frames(run(), size=(96, 72))
    with pytest.raises(KeyboardInterrupt):
        videos.write_video(path, frames, videos.Video.of(run(), fps=10.0), progress=stop)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("fps", "speed"),
    [(0.0, 1.0), (-1.0, 1.0), (math.nan, 1.0), (500.0, 1.0), (25.0, 0.0), (25.0, math.inf), (25, 1e-6)],
)
def test_what_makes_no_film_is_told(fps: float, speed: float) -> None:
    with pytest.raises(InvalidArgument, match=r"REPLAY014"):
        videos.Video.of(run(), fps=fps, speed=speed)


def test_the_same_picture_is_the_same_bytes() -> None:
    made = []
    for _ in range(2):
        frames = Frames(run(), size=SIZE)
        made.append(png_bytes(frames.at(1.8)))
    assert made[0] == made[1]
    with Image.open(io.BytesIO(made[0])) as image:
        assert image.size == SIZE
