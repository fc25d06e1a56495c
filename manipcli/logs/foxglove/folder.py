"""The folder of `export LOG --foxglove DIR`: a log that Foxglove draws without packages, and a layout."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from manipcli.core.whole_file import write_whole
from manipcli.logs.foxglove.layout import check_installed, layout_json
from manipcli.logs.foxglove.models import models
from manipcli.record.foreign.join import join
from manipcli.record.foreign.topics import open_topics
from manipcli.render.drawing import draw
from manipcli.replay.playback import Playback

LAYOUT: Final = "layout.json"
README: Final = """\
Open {log} in Foxglove (Open local file, or drag it into the window); no account of a robot or server is needed.
Import the layout: layout menu, Import from file, layout.json. It shows scene, steps, curves, cause and events.
The topic /scene has the shapes of robot and bodies with their meshes; all other topics are those of the log.
"""


def write_folder(folder: Path, log: Path, playback: Playback) -> tuple[str, ...]:
    """Writes log, layout and README.

    Args:
        folder: created if missing.
        log: the log.
        playback: of the log.

    Returns:
        What is not drawn, one line each.

    Raises:
        InvalidInput: foxglove-sdk is not installed, or the log cannot be read.
        RecordingFailed: writing the log failed.
        OSError: another file cannot be written.
    """
    check_installed()
    topics = open_topics(log)
    drawing = draw(playback.robot, playback.scene)
    layout = layout_json(playback, topics)
    folder.mkdir(parents=True, exist_ok=True)
    copy = folder / f"{log.name.partition('.mcap')[0]}.mcap"
    join([log], copy, added=models(drawing, playback.scene, ns=topics.start))
    write_whole(folder / LAYOUT, layout.encode())
    write_whole(folder / "README.md", README.format(log=copy.name).encode())
    return drawing.missing
