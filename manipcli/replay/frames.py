"""Pictures of a run at given times, with step, time and timeline as captions."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean, shorten
from manipcli.core.units import NUMBER, TIME, UnitError, to_si
from manipcli.render.drawing import draw, floors_of
from manipcli.render.placing import Placing, Poses
from manipcli.replay.camera import FROM, Camera, Vector, framing
from manipcli.replay.caption import caption
from manipcli.replay.force_overlay import draw_forces
from manipcli.replay.forces import Forces
from manipcli.replay.furniture import furniture
from manipcli.replay.ground import ground_of
from manipcli.replay.happening import failed_step
from manipcli.replay.playback import Playback, PlaybackStep
from manipcli.replay.renderer import Image, Renderer

Numbers = npt.NDArray[np.int64]

LOOKED_AT = 60
"""Number of states of a run that are in view."""
LEAST_SIZE, MOST_SIZE = 64, 4096
"""Limits of the width and height of a picture [pixel]."""
FALLING = 0.5
"""Speed of an object that is dropped, not set down [m/s]."""
HALF_WAY = 0.6
"""A falling object is shown at this share of its largest speed."""


class Frames(Renderer):
    """The pictures of a run from one fixed camera.

    Args:
        playback: the run.
        size: width and height [pixel].
        towards: direction from the scene to the camera, which has the whole run in view.
        captions: draw step, time, what happens, and the timeline.
        forces: draw contact forces; None: in steps that failed, since there they often are the reason.

    Attributes:
        camera: the camera.
        colours: unlit colours of the surfaces, 0 to 1.
        missing: parts that cannot be drawn, one line each.
    """

    def __init__(
        self,
        playback: Playback,
        *,
        size: tuple[int, int],
        towards: Vector = FROM,
        captions: bool = True,
        forces: bool | None = None,
    ) -> None:
        self.playback = playback
        self._captions, self._forced = captions, forces
        self._placing = Placing(playback.robot, playback.scene)
        drawing = draw(playback.robot, playback.scene)
        self.missing = drawing.missing
        self.colours = tuple(dict.fromkeys(drawable.rgba[:3] for drawable in drawing.layer("visual")))
        count = len(playback.times)
        some = np.unique(np.linspace(0, count - 1, min(count, LOOKED_AT)).round().astype(int))
        poses = self._poses(some)
        large = furniture(playback.scene, self._placing, poses)
        self.camera: Camera = framing(drawing, poses, aspect=size[0] / size[1], leave_out=large, towards=towards)
        super().__init__(
            drawing,
            size=size,
            still=self._placing.still,
            ground=ground_of(drawing, self._poses(0), playback.scene),
            hidden=floors_of(playback.scene),
        )

    def at(self, time: float) -> Image:
        """The picture at the recorded time nearest to `time` [s]."""
        k = self.playback.index(time)
        image, now = self.picture(self._poses(k), self.camera), float(self.playback.times[k])
        if self._forced or (self._forced is None and failed_step(self.playback, now) is not None):
            image = draw_forces(image, self.camera, self._forces, k)
        return caption(image, self.playback, now) if self._captions else image

    def between(self, start: float, end: float, tint: tuple[int, int, int]) -> tuple[Image, Array]:
        """The picture at `start` [s] with a ghost of the state at `end`, without captions; and its depth (h, w) [m]."""
        first, last = (self._poses(self.playback.index(time)) for time in (start, end))
        return self.with_ghost(first, last, self.camera, tint)

    @cached_property
    def _forces(self) -> Forces:
        return Forces(self.playback, self.playback.poses())

    def _poses(self, k: int | Numbers) -> Poses:
        run = self.playback
        return self._placing.at(run.stance[k], run.body_position[k], run.body_quat_xyzw[k])


def moment(playback: Playback, text: str) -> float:
    """Time [s] of a user's text: seconds, a time with its unit, `start`, `end`, or a step id, see `clearest_time`.

    Raises:
        InvalidArgument: the text is none of these, or outside the run.
    """
    for step in playback.steps:
        if step.id == text:
            return clearest_time(playback, step)
    if text in ("start", "end"):
        return playback.start if text == "start" else playback.end
    try:
        time = to_si(text, NUMBER, TIME)
    except UnitError:
        hint = did_you_mean(text, [*(step.id for step in playback.steps), "start", "end"], kind="steps")
        message = f"'{shorten(text)}' is not a time or step of this run"
        raise InvalidArgument("REPLAY011", message, hint=hint) from None
    # The end of the run is shown in centiseconds.
    if not playback.start - 0.005 <= time <= playback.end + 0.005:
        raise InvalidArgument("REPLAY012", f"{time:g} s is outside the run: {playback.start:g} to {playback.end:g} s")
    return time


def clearest_time(playback: Playback, step: PlaybackStep) -> float:
    """Time [s] that shows a step best: its end, before the next step starts; during the fall if an object falls."""
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
        InvalidArgument: the text is not a size, or out of range.
    """
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.isdecimal() and LEAST_SIZE <= int(part) <= MOST_SIZE for part in parts):
        hint = f"WIDTHxHEIGHT in pixels, such as 960x540, from {LEAST_SIZE} to {MOST_SIZE} each"
        raise InvalidArgument("REPLAY013", f"'{shorten(text)}' is not a picture size", hint=hint)
    return int(parts[0]), int(parts[1])
