"""`manipcli replay`: a run in the browser."""

from __future__ import annotations

import time

from manipcli.replay.curves_panel import CurvesPanel
from manipcli.replay.drawing import draw
from manipcli.replay.forces import Forces
from manipcli.replay.ground import floors_of
from manipcli.replay.overlays import ForceArrows, Ghost, ToolPath
from manipcli.replay.panel import LayerSwitches
from manipcli.replay.placing import Poses
from manipcli.replay.playback import Playback
from manipcli.replay.server import LocalServer
from manipcli.replay.stage import Stage
from manipcli.replay.timeline import Clock, Timeline

SLOW = 0.2
"""[s] between two pictures of the curves while the run plays: they are heavier than the rest."""
PANEL = 360.0
"""Width of the panel in pixels."""


class Replay(LocalServer):
    """A page that plays a run. Stops with the `with` block.

    Args:
        playback: the run.
        port: see `LocalServer`.

    Attributes:
        playback: as given.
        clock: the time that is shown.
        missing: what could not be drawn, a line each.
    """

    def __init__(self, playback: Playback, *, port: int | None) -> None:
        drawing = draw(playback.robot, playback.scene)
        self.playback = playback
        self.missing = drawing.missing
        self._poses = playback.poses()
        self._wanted: Poses | None = None
        super().__init__(playback.name, port=port)
        self.clock = Clock(playback.start, playback.end, self._show)
        try:
            self.viser.gui.main_panel.set_width(PANEL)
            self.stage = Stage(self.viser, drawing, self._at(0), floors=floors_of(playback.scene))
            self.timeline = Timeline(self.viser, playback, self.clock)
            self.curves = CurvesPanel(self.viser, playback)
            self._ghost: Ghost | None = None
            if playback.robot is not None and playback.has_reference:
                self._ghost = Ghost(self.viser, drawing, tuple(link.name for link in playback.robot.links))
                self._wanted = playback.reference_poses()
            path = playback.tool_path()
            self._path = ToolPath(self.viser, path) if len(path) > 1 else None
            self._forces = ForceArrows(self.viser, Forces(playback, self._poses))
            self._switches()
        except BaseException:
            self.stop()
            raise
        self._slow_at = 0.0
        self._index = -1
        self.clock.begin()

    def stop(self) -> None:
        """Stop the time, then the server; again does nothing."""
        clock = getattr(self, "clock", None)
        if clock is not None:
            clock.stop()
        super().stop()

    def _switches(self) -> None:
        gui = self.viser.gui
        with gui.add_folder("Run"):
            ghost = gui.add_checkbox(
                "reference",
                False,
                disabled=self._ghost is None,
                hint="Where the robot should be, clear and blue, as far as it is off by more than 2 mm.",
            )
            path = gui.add_checkbox("tool path", True)
            forces = gui.add_checkbox("forces", True, hint="Normal forces on what can move, at the points of contact.")
        ghost.on_update(lambda _: self._show_ghost(ghost.value))
        path.on_update(lambda _: self._path.show(path.value) if self._path is not None else None)
        forces.on_update(lambda _: self._forces.show(forces.value, self.playback.index(self.clock.time)))
        LayerSwitches(self.viser, self.stage)

    def _show_ghost(self, shown: bool) -> None:
        if self._ghost is not None and self._wanted is not None:
            k = self.playback.index(self.clock.time)
            self._ghost.place(_instant(self._wanted, k), self._at(k))
            self._ghost.visible = shown

    def _at(self, k: int) -> Poses:
        return _instant(self._poses, k)

    def _show(self, now: float) -> None:
        """The clock's time changed [s]."""
        k = self.playback.index(now)
        if k != self._index:
            self._index = k
            with self.viser.atomic():
                self.stage.place(self._at(k))
                if self._ghost is not None and self._ghost.visible and self._wanted is not None:
                    self._ghost.place(_instant(self._wanted, k), self._at(k))
                if self._path is not None:
                    self._path.place(k)
                self._forces.place(k)
        self.timeline.show(now)
        real = time.monotonic()
        if not self.clock.playing or real >= self._slow_at:
            self._slow_at = real + SLOW
            self.curves.place(now)


def _instant(poses: Poses, k: int) -> Poses:
    return Poses(poses.position[k], poses.quat_xyzw[k])
