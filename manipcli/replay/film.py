"""A film of a run: MP4 with the extra `manipcli[video]`, else animated WebP or GIF."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from manipcli.core.errors import InvalidArgument
from manipcli.core.whole_file import whole_file
from manipcli.replay.caption import CAPTION_COLOURS
from manipcli.replay.image import Image
from manipcli.replay.playback import Playback
from manipcli.replay.shots import Shots

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage

Kind = Literal["mp4", "webp", "gif"]
KINDS: tuple[Kind, ...] = get_args(Kind)

SIZE = (640, 360)
MAX_FPS = 100.0
"""Above, GIF and WebP have no delays, and the clock in the picture would stand still."""
MAX_FRAMES = 50_000
QUALITY = 80
"""Of WebP, 0 to 100."""
RATE_FACTOR = "20"
"""Of H.264: the lower the better; 18 looks like the original, 23 is the usual."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Film:
    """Which moments are shown, and how fast: `speed` seconds of the run in one of the film."""

    times: tuple[float, ...]
    fps: float

    @property
    def duration(self) -> float:
        """[s]"""
        return len(self.times) / self.fps

    def delays(self, step: int = 1) -> list[int]:
        """[ms] How long each frame stays, in multiples of `step`; together as long as the film."""
        ends = np.round(np.arange(len(self.times) + 1) * 1000.0 / self.fps / step).astype(int) * step
        return [int(delay) for delay in np.diff(ends)]


def cutting(playback: Playback, *, fps: float, speed: float = 1.0) -> Film:
    """The moments of a film from the first to the last.

    Raises:
        InvalidArgument: see `check_pace`; or there would be too many frames.
    """
    check_pace(fps, speed)
    count = (playback.end - playback.start) * fps / speed
    if count > MAX_FRAMES:
        hint = "take fewer frames a second or a higher speed"
        raise InvalidArgument("REPLAY014", f"the film would have {count:.0f} frames; {MAX_FRAMES} are made", hint=hint)
    frames = math.floor(count + 1e-6) + 1
    return Film(tuple(playback.start + k * speed / fps for k in range(frames)), fps)


def check_pace(fps: float, speed: float) -> None:
    """
    Raises:
        InvalidArgument: a number that makes no film.
    """
    if not (math.isfinite(fps) and 0.0 < fps <= MAX_FPS):
        raise InvalidArgument("REPLAY014", f"{fps:g} frames a second are not in 0 to {MAX_FPS:g}")
    if not (math.isfinite(speed) and speed > 0.0):
        raise InvalidArgument("REPLAY014", f"a speed of {speed:g} makes no film")


def kind_of(path: Path) -> Kind:
    """What a file is to be, by its ending.

    Raises:
        InvalidArgument: another ending, or what is needed for it is not installed.
    """
    kind = next((known for known in KINDS if path.suffix.lower() == f".{known}"), None)
    if kind is None:
        raise InvalidArgument("REPLAY015", f"'{path}': a film is one of {', '.join(f'.{one}' for one in KINDS)}")
    if kind == "mp4":
        try:
            import av  # noqa: F401 (whether it is there)
        except ImportError as error:
            hint = "pip install 'manipcli[video]', or write a .webp or .gif, which needs nothing"
            raise InvalidArgument("REPLAY016", f"'{path}': .mp4 needs the extra 'video'", hint=hint) from error
    return kind


def write_film(path: Path, shots: Shots, film: Film, *, progress: Progress | None = None) -> None:
    """Draws every frame and writes the film; the file is there when it is complete.

    Args:
        path: of the file; its ending says what it is; replaced.
        shots: the run before its camera.
        film: which moments.
        progress: told of frames that are done, and of how many there are.

    Raises:
        InvalidArgument: see `kind_of`.
        OSError: it cannot be written.
    """
    kind = kind_of(path)

    def frames() -> Iterator[Image]:
        for k, time in enumerate(film.times):
            yield shots.at(time)
            if progress is not None:
                progress(k + 1, len(film.times))

    with whole_file(path) as partial:
        if kind == "mp4":
            _mp4(partial, frames(), film)
        else:
            _animation(partial, frames(), film, kind, shots.colours)


def _animation(
    path: Path, frames: Iterator[Image], film: Film, kind: Kind, colours: Sequence[tuple[float, float, float]]
) -> None:
    from PIL import Image as Images

    images = (Images.fromarray(frame) for frame in frames)
    first = next(images)
    if kind == "gif":
        # One palette for all frames, or colours would flicker; no dithering, or what stands still would.
        palette = _palette(first, colours)
        flat = (image.quantize(palette=palette, dither=Images.Dither.NONE) for image in images)
        first = first.quantize(palette=palette, dither=Images.Dither.NONE)
        first.save(path, "GIF", save_all=True, append_images=flat, duration=film.delays(10), loop=0, disposal=1)
    else:
        first.save(
            path, "WEBP", save_all=True, append_images=images, duration=film.delays(), loop=0, quality=QUALITY, method=2
        )


def _palette(first: PillowImage, colours: Sequence[tuple[float, float, float]]) -> PillowImage:
    """Those of the first frame, and of what may come into sight later, in light and in shade."""
    from PIL import Image

    later = [tuple(round(255 * shade * part) for part in rgb) for rgb in colours[:24] for shade in (0.65, 0.85, 1.0)]
    swatches = list(dict.fromkeys([*CAPTION_COLOURS, *later]))
    room = 256 - len(swatches)
    found = first.quantize(room, method=Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*found[: 3 * room], *(part for swatch in swatches for part in swatch)])
    return palette


def _mp4(path: Path, frames: Iterator[Image], film: Film) -> None:
    import av

    with av.open(str(path), "w", format="mp4") as container:
        stream = None
        for frame in frames:
            # H.264 with colours at half the size wants even sides.
            even = frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2]
            if stream is None:
                stream = container.add_stream("libx264", rate=Fraction(film.fps).limit_denominator(1000))
                stream.height, stream.width = even.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": RATE_FACTOR, "preset": "veryfast"}
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
            container.mux(stream.encode(picture))
        if stream is not None:
            container.mux(stream.encode())
