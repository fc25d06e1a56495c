"""A run as a recording of Rerun, one `.rrd` file with its layout."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from manipcli.core.whole_file import whole_file
from manipcli.render.drawing import draw, floors_of
from manipcli.render.placing import Poses
from manipcli.replay.camera import framing
from manipcli.replay.forces import Forces
from manipcli.replay.playback import Playback
from manipcli.replay.rerun.bodies import log_bodies
from manipcli.replay.rerun.curves import log_curves
from manipcli.replay.rerun.forces import log_forces
from manipcli.replay.rerun.layout import Contents, layout
from manipcli.replay.rerun.measured import Measured
from manipcli.replay.rerun.sensors import log_sensors
from manipcli.replay.rerun.story import log_story
from manipcli.replay.rerun.timelines import Timelines

NOTHING = Measured(pictures=iter(()))


def write_recording(path: Path, playback: Playback, measured: Measured = NOTHING) -> tuple[str, ...]:
    """Writes a run.

    Args:
        path: the file, replaced when it is complete.
        playback: the run.
        measured: what its sensors measured.

    Returns:
        What is not drawn, one line each.

    Raises:
        OSError: the file cannot be written.
    """
    import rerun as rr

    drawing = draw(playback.robot, playback.scene)
    poses = playback.poses()
    floors = floors_of(playback.scene)
    lines = Timelines(playback.period)
    start = Poses(poses.position[0], poses.quat_xyzw[0])
    bodies = playback.scene.bodies if playback.scene is not None else ()
    fixed = frozenset(body.name for body in bodies if body.fixed)
    # What moves, if there is anything: a desk would push the robot into the distance.
    moving = playback.robot is not None or len(fixed) < len(bodies)
    camera = framing(drawing, start, leave_out=fixed if moving else floors)
    # No properties: they would hold the time of the export.
    stream = rr.RecordingStream("manipcli", recording_id=_identity(playback), send_properties=False)
    with whole_file(path) as partial, stream as to:
        to.set_log_time_enabled(False)
        to.set_log_tick_enabled(False)
        to.save(partial)
        to.send_recording_name(playback.name)
        log_bodies(to, playback, drawing, poses, lines, floors)
        log_forces(to, playback, Forces(playback, poses), lines)
        charts, joints = log_curves(to, playback, measured.numbers, lines)
        views = log_sensors(to, measured, lines)
        log_story(to, playback, lines)
        contents = Contents(camera=camera, charts=charts, joints=joints, views=views, has_steps=bool(playback.steps))
        to.send_blueprint(layout(contents), make_active=True, make_default=True)
        to.disconnect()  # writes what is still waiting
    return drawing.missing


def _identity(playback: Playback) -> str:
    """An id of the contents: the viewer takes recordings of one id for parts of the same."""
    contents = hashlib.sha256(playback.name.encode())
    for values in (playback.times, playback.position, playback.body_position):
        contents.update(np.ascontiguousarray(values).tobytes())
    return contents.hexdigest()
