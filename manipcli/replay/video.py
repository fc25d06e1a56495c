"""A video of a run: MP4 with the extra `manipcli[video]`, else animated WebP or GIF."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from manipcli.core.errors import InvalidArgument
from manipcli.core.whole_file import whole_file
from manipcli.replay.caption import CAPTION_COLOURS
from manipcli.replay.frames import Frames
from manipcli.replay.playback import Playback
from manipcli.replay.renderer import Image

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage

ENDINGS = (".mp4", ".webp", ".gif")
SIZE = (640, 360)
MAX_FPS = 100.0
"""Largest frame rate: GIF and WebP have no shorter delays."""
MAX_FRAMES = 50_000
QUALITY = 80
"""Quality of WebP, 0 to 100."""
RATE_FACTOR = "20"
"""H.264 constant rate factor: lower is better; 18 looks like the original, 23 is the default."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Video:
    """The times [s] of the frames, at `fps` frames per second."""

    times: tuple[float, ...]
    fps: float

    @classmethod
    def of(cls, playback: Playback, *, fps: float, speed: float = 1.0) -> Self:
        """The whole run, with `speed` seconds of the run per second of the video.

        Raises:
            InvalidArgument: see `check_pace`; or too many frames.
        """
        check_pace(fps, speed)
        count = (playback.end - playback.start) * fps / speed
        if count > MAX_FRAMES:
            message = f"{count:.0f} frames exceed the limit of {MAX_FRAMES} for a video"
            raise InvalidArgument("REPLAY014", message, hint="use fewer frames per second or a higher speed")
        frames = math.floor(count + 1e-6) + 1
        return cls(tuple(playback.start + k * speed / fps for k in range(frames)), fps)

    @property
    def duration(self) -> float:
        """Duration of the video [s]."""
        return len(self.times) / self.fps

    def delays(self, step: int = 1) -> list[int]:
        """Display time of each frame [ms], in multiples of `step`; their sum is the duration of the video."""
        ends = np.round(np.arange(len(self.times) + 1) * 1000.0 / self.fps / step).astype(int) * step
        return [int(delay) for delay in np.diff(ends)]


def check_pace(fps: float, speed: float) -> None:
    """Check the frame rate and the speed of a video.

    Raises:
        InvalidArgument: a number is out of range.
    """
    if not (math.isfinite(fps) and 0.0 < fps <= MAX_FPS):
        raise InvalidArgument("REPLAY014", f"{fps:g} frames per second are outside 0 to {MAX_FPS:g}")
    if not (math.isfinite(speed) and speed > 0.0):
        raise InvalidArgument("REPLAY014", f"speed {speed:g} is not a positive number")


def check_ending(path: Path) -> None:
    """Check that a video of this file ending can be written.

    Raises:
        InvalidArgument: unknown file ending, or its extra is not installed.
    """
    if path.suffix.lower() not in ENDINGS:
        raise InvalidArgument("REPLAY015", f"'{path}' is not a video: use {', '.join(ENDINGS)}")
    if path.suffix.lower() == ".mp4":
        try:
            import av  # noqa: F401 (whether it is installed)
        except ImportError as error:
            hint = "run `pip install 'manipcli[video]'`, or write .webp or .gif, which need no extra"
            raise InvalidArgument("REPLAY016", f"'{path}': .mp4 needs the extra 'video'", hint=hint) from error


def write_video(path: Path, frames: Frames, video: Video, *, progress: Progress | None = None) -> None:
    """Draw every frame and write the video; the file is replaced when it is complete.

    Args:
        path: video file; its ending selects the format.
        frames: pictures of the run.
        video: times of the frames.
        progress: called with the number of drawn frames and the number of all frames.

    Raises:
        InvalidArgument: see `check_ending`.
        OSError: the file cannot be written.
    """
    check_ending(path)

    def images() -> Iterator[Image]:
        for k, time in enumerate(video.times):
            yield frames.at(time)
            if progress is not None:
                progress(k + 1, len(video.times))

    with whole_file(path) as partial:
        match path.suffix.lower():
            case ".mp4":
                _mp4(partial, images(), video.fps)
            case ".gif":
                _gif(partial, images(), video, frames.colours)
            case _:
                _webp(partial, images(), video)


def _webp(path: Path, frames: Iterator[Image], video: Video) -> None:
    from PIL import Image as Images

    images = map(Images.fromarray, frames)
    next(images).save(
        path, "WEBP", save_all=True, append_images=images, duration=video.delays(), loop=0, quality=QUALITY, method=2
    )


def _gif(path: Path, frames: Iterator[Image], video: Video, colours: Sequence[tuple[float, float, float]]) -> None:
    from PIL import Image as Images

    start = next(frames)
    # One palette for all frames prevents flicker of colours; no dithering prevents flicker of still parts.
    palette = _palette(Images.fromarray(start), colours)

    def flat(frame: Image) -> PillowImage:
        return Images.fromarray(frame).quantize(palette=palette, dither=Images.Dither.NONE)

    flat(start).save(
        path, "GIF", save_all=True, append_images=map(flat, frames), duration=video.delays(10), loop=0, disposal=1
    )


def _palette(first: PillowImage, colours: Sequence[tuple[float, float, float]]) -> PillowImage:
    """The colours of the first frame, and lit and shaded colours that can appear later."""
    from PIL import Image as Images

    later = [tuple(round(255 * shade * part) for part in rgb) for rgb in colours[:24] for shade in (0.65, 0.85, 1.0)]
    swatches = list(dict.fromkeys([*CAPTION_COLOURS, *later]))
    room = 256 - len(swatches)
    found = first.quantize(room, method=Images.Quantize.MEDIANCUT).getpalette() or []
    palette = Images.new("P", (1, 1))
    palette.putpalette([*found[: 3 * room], *(part for swatch in swatches for part in swatch)])
    return palette


def _mp4(path: Path, frames: Iterator[Image], fps: float) -> None:
    import av

    with av.open(str(path), "w", format="mp4") as container:
        stream = None
        for frame in frames:
            # H.264 with chroma subsampling needs even sizes.
            even = frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2]
            if stream is None:
                stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1000))
                stream.height, stream.width = even.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": RATE_FACTOR, "preset": "veryfast"}
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
            container.mux(stream.encode(picture))
        if stream is not None:
            container.mux(stream.encode())
