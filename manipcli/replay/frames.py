"""Pictures of a run: what stood where at a moment, with the step's name, the time and the run's timeline drawn in."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.text import did_you_mean, shorten
from manipcli.core.units import NUMBER, TIME, UnitError, to_si
from manipcli.replay.camera import FROM, Camera, Vector, framing
from manipcli.replay.caption import caption
from manipcli.replay.drawing import FLOOR, draw
from manipcli.replay.placing import Placing, Poses
from manipcli.replay.playback import Playback, PlaybackStep
from manipcli.replay.renderer import Image, Renderer

Numbers = npt.NDArray[np.int64]

LOOKED_AT = 60
"""StateWindow of a run that are all to be in view."""
LARGE = 0.6
"""A body that stands still and has this part of the extent of robot and things is what they stand on."""
LEAST_SIZE, MOST_SIZE = 64, 4096
"""Of a picture [pixel]."""
FALLING = 0.5
"""[m/s] A thing that is let go of, and not set down, is faster than this."""
HALF_WAY = 0.6
"""A thing that falls is shown when it has this part of its greatest speed."""


class Frames(Renderer):
    """The pictures of a run, from one camera that does not move.

    Args:
        playback: the run.
        size: width and height [pixel].
        towards: from what is shown to the eye; the camera has all of the run in view.
        captions: whether step, time and timeline are drawn in.

    Attributes:
        camera: where it stands.
        colours: of what is shown, 0 to 1, before light falls on it.
        missing: what could not be drawn, a line each.
    """

    def __init__(
        self, playback: Playback, *, size: tuple[int, int], towards: Vector = FROM, captions: bool = True
    ) -> None:
        self.playback = playback
        self._captions = captions
        self._placing = Placing(playback.robot, playback.scene)
        drawing = draw(playback.robot, playback.scene)
        self.missing = drawing.missing
        self.colours = tuple(dict.fromkeys(one.rgba[:3] for one in drawing.layer("visual")))
        count = len(playback.times)
        some = np.unique(np.linspace(0, count - 1, min(count, LOOKED_AT)).round().astype(int))
        self.camera: Camera = framing(
            drawing, self._poses(some), aspect=size[0] / size[1], leave_out=self._furniture(some), towards=towards
        )
        super().__init__(drawing, size=size, still=self._placing.still)

    def at(self, time: float) -> Image:
        """The picture at the recorded moment nearest to `time` [s]."""
        k = self.playback.index(time)
        image = self.picture(self._poses(k), self.camera)
        return caption(image, self.playback, float(self.playback.times[k])) if self._captions else image

    def _poses(self, k: int | Numbers) -> Poses:
        run = self.playback
        return self._placing.at(run.stance[k], run.body_position[k], run.body_quat_xyzw[k])

    def _furniture(self, some: Numbers) -> frozenset[str]:
        """Bodies that need not be in view as a whole: the floor, and what stands still and is as large as the rest."""
        scene = self.playback.scene
        fixed = [body for body in scene.bodies if body.fixed] if scene is not None else []
        poses = self._poses(some)
        names = [body.name for body in scene.bodies] if scene is not None else []
        links = poses.position.shape[-2] - len(names)
        moving = [k for k in range(1, links + len(names)) if k < links or names[k - links] not in self._placing.still]
        points = poses.position[:, moving].reshape(-1, 3)
        extent = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else np.inf
        return frozenset(
            body.name for body in fixed if body.kind == FLOOR or float(np.linalg.norm(body.size)) > LARGE * extent
        )


def moment(playback: Playback, text: str) -> float:
    """[s] What a user calls a moment: seconds, a time with its unit, `start`, `end`, or a step, which is shown at its
    most telling moment.

    Raises:
        InvalidArgument: it is none of these, or outside of the run.
    """
    for step in playback.steps:
        if step.id == text:
            return telling(playback, step)
    if text in ("start", "end"):
        return playback.start if text == "start" else playback.end
    try:
        time = to_si(text, NUMBER, TIME)
    except UnitError:
        hint = did_you_mean(text, [*(step.id for step in playback.steps), "start", "end"], kind="steps")
        message = f"'{shorten(text)}' is neither a time nor a step of this run"
        raise InvalidArgument("REPLAY011", message, hint=hint) from None
    # To the centisecond, as the run's end is shown.
    if not playback.start - 0.005 <= time <= playback.end + 0.005:
        raise InvalidArgument(
            "REPLAY012", f"{time:g} s lies outside of the run: {playback.start:g} to {playback.end:g} s"
        )
    return time


def telling(playback: Playback, step: PlaybackStep) -> float:
    """[s] When a step is best seen: at its end, before the next begins; while something falls, where something does."""
    within = np.flatnonzero((playback.times >= step.start) & (playback.times < step.end))
    if len(within) > 2 and playback.body_position.shape[1]:
        heights, times = playback.body_position[within, :, 2], playback.times[within]
        down = -np.gradient(heights, times, axis=0)
        fastest = down[:, int(down.max(axis=0).argmax())]
        if fastest.max() > FALLING:
            return float(times[int(np.argmax(fastest >= HALF_WAY * fastest.max()))])
    return float(playback.times[within[-1]]) if len(within) else step.end


def parse_size(text: str) -> tuple[int, int]:
    """Width and height of `640x360`.

    Raises:
        InvalidArgument: it is no size, or beyond what is drawn.
    """
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.isdecimal() and LEAST_SIZE <= int(part) <= MOST_SIZE for part in parts):
        hint = f"WIDTHxHEIGHT in pixels, as 960x540, from {LEAST_SIZE} to {MOST_SIZE} each"
        raise InvalidArgument("REPLAY013", f"'{shorten(text)}' is no size of a picture", hint=hint)
    return int(parts[0]), int(parts[1])
