"""Draws the picture of a run from its log: nothing is simulated again.

    manipcli run tasks/pour.yaml
    python docs/make_pictures.py                                                   (writes docs/pour.png)
    python docs/make_pictures.py runs/pick_place.mcap --task tasks/pick_place.yaml --out runs/pick_place.png

The states come from the log, the meshes of the robot from the files that the task names. Nothing needs a GPU or a
window; Pillow writes the captions.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from manipcli.flow.load import Task, load_task
from manipcli.model.scene_file import scene_from_json
from manipcli.model.state import WorldState
from manipcli.plan.steps.move import MoveSpec
from manipcli.record.reading import read_recording
from manipcli.record.recording import Recording
from manipcli.replay.camera import Camera
from manipcli.replay.drawing import draw
from manipcli.replay.picture import Studio
from manipcli.replay.placing import Placing
from manipcli.spec.task import TaskSpec

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = 3
PANEL = (500, 400)
"""Of one picture [pixel]."""
GAP = 6
INK = (30, 36, 44)
HALF_WAY = 0.6
"""A thing that falls is shown when it has this part of its greatest speed."""


@dataclass(frozen=True)
class Moment:
    """What is shown, and when [s]."""

    label: str
    time: float


WORDS = {"pick": "grasped", "lift": "lifted", "pour": "pouring", "place": "placed", "move": "moved", "follow": "moved"}
"""What is to be seen after a step; the other steps change nothing that could be drawn."""


def moments(recording: Recording, task: TaskSpec) -> Iterator[Moment]:
    """The start, and each step when it is done; a pour while something falls."""
    yield Moment("start", 0.0)
    begun = {event.step: event.time for event in recording.events if event.kind == "step_started"}
    named = {step.id: step.body.to for step in task.steps if isinstance(step.body, MoveSpec)}
    for event in recording.events:
        if event.kind == "step_ended" and event.verb in WORDS:
            to = named.get(event.step)
            time = _falling(recording.states, begun[event.step], event.time) if event.verb == "pour" else event.time
            yield Moment(to if isinstance(to, str) else WORDS[event.verb], time)


def _falling(states: WorldState, first: float, last: float) -> float:
    """Half-way down of the body that falls fastest between two times."""
    within = np.flatnonzero((states.time >= first) & (states.time <= last))
    down = -states.body_linear[within, :, 2]
    fastest = down[:, int(down.max(axis=0).argmax())]
    return float(states.time[within[int(np.argmax(fastest >= HALF_WAY * fastest.max()))]])


def sheet(recording: Recording, task: Task, camera: Camera) -> Image.Image:
    """All moments on one sheet, row by row."""
    shown = list(moments(recording, task.spec))
    rows = -(-len(shown) // COLUMNS)
    width, height = (n * (size + GAP) - GAP for n, size in zip((COLUMNS, rows), PANEL, strict=True))
    whole = Image.new("RGB", (width, height), "white")
    scene = scene_from_json(recording.attachments["scene.json"])
    placing = Placing(task.robot, scene)
    with Studio(draw(task.robot, scene), size=PANEL) as studio:
        for number, moment in enumerate(shown):
            tick = min(int(np.searchsorted(recording.states.time, moment.time)), len(recording.states.time) - 1)
            now = recording.states.map(itemgetter(tick))
            poses = placing.at(now.position, now.body_position, now.body_quat_xyzw)
            panel = Image.fromarray(studio.picture(poses, camera))
            _caption(panel, f"{number + 1}  {moment.label}", f"{float(now.time):.2f} s")
            row, column = divmod(number, COLUMNS)
            whole.paste(panel, (column * (PANEL[0] + GAP), row * (PANEL[1] + GAP)))
    return whole


def _caption(panel: Image.Image, left: str, right: str) -> None:
    pen = ImageDraw.Draw(panel)
    pen.text((14, 10), left, fill=INK, font=ImageFont.load_default(21))
    pen.text((PANEL[0] - 14, 12), right, fill=INK, font=ImageFont.load_default(18), anchor="ra")


CAMERA = Camera(eye=(1.72, 1.05, 1.08), target=(0.375, 0.085, 0.51), field=32.0)


def main() -> None:
    """Draw one log."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, nargs="?", default=Path("runs/pour.mcap"))
    parser.add_argument("--task", type=Path, default=ROOT / "tasks" / "pour.yaml", help="names the robot in the log")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pour.png")
    chosen = parser.parse_args()
    sheet(read_recording(chosen.log), load_task(chosen.task), CAMERA).save(chosen.out, optimize=True)


if __name__ == "__main__":
    main()
