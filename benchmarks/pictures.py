"""What it takes to look at a log: to open it, to draw pictures, videos and figures of it.

manipcli run tasks/pour.yaml
python -m benchmarks.pictures [LOG]
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from manipcli.logs.plot import open_chart
from manipcli.logs.replay import open_playback
from manipcli.replay import figure
from manipcli.replay.contact_sheet import contact_sheet
from manipcli.replay.frames import Frames
from manipcli.replay.player import player_page
from manipcli.replay.video import SIZE, Video, write_video

ROUNDS = 3
JOINT = "joint_states.position[joint_1]"


def seconds(work: Callable[[], object]) -> float:
    """The median of `ROUNDS` after one that does not count."""
    found = []
    for _ in range(ROUNDS + 1):
        began = time.perf_counter()
        work()
        found.append(time.perf_counter() - began)
    return statistics.median(found[1:])


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, nargs="?", default=Path("runs/pour.mcap"))
    log = parser.parse_args().log
    playback = open_playback(log)
    video = Video.of(playback, fps=10.0)
    rows = [
        ("open the log for pictures", f"{seconds(lambda: open_playback(log)):.2f} s"),
        ("read one joint at the full rate", f"{1000.0 * seconds(lambda: open_chart([log], [JOINT])):.0f} ms"),
        ("page that plays offline", f"{seconds(lambda: player_page(playback)):.2f} s"),
        ("sheet of all steps", f"{seconds(lambda: contact_sheet(playback)):.2f} s"),
    ]
    chart = open_chart([log], [])
    rows += [
        (f"overview as {kind}", f"{seconds(lambda k=kind: figure.render(chart, k)):.2f} s") for kind in figure.KINDS
    ]
    with tempfile.TemporaryDirectory() as folder, Frames(playback, size=SIZE) as frames:
        for ending in ("webp", "gif", "mp4"):
            path = Path(folder) / f"video.{ending}"
            took = seconds(lambda path=path: write_video(path, frames, video))
            rows.append((f"video, {SIZE[0]}x{SIZE[1]}, {ending}", f"{len(video.times) / took:.1f} frames/s"))
    print("| of a log | takes |\n|---|---|")
    for row in rows:
        print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
