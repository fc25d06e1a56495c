"""The viewer of Rerun on a file: a program of its own, which comes with rerun-sdk."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from manipcli.core.errors import InvalidArgument

_LOCAL = ("--bind", "127.0.0.1", "--port", "auto")
"""The viewer also listens for recordings: by default on all networks, and on a port that a second viewer shares."""


def check_display() -> None:
    """
    Raises:
        InvalidArgument: there is no screen for a window.
    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        hint = "write a file with `manipcli export LOG --rerun FILE.rrd`, and open it where there is a screen"
        raise InvalidArgument("REPLAY018", "--rerun: no screen (DISPLAY and WAYLAND_DISPLAY are not set)", hint=hint)


def show(path: Path) -> None:
    """Opens a recording, and returns when its window is closed.

    Raises:
        InvalidArgument: the viewer failed.
        KeyboardInterrupt: Ctrl-C; the viewer is closed.
    """
    # -P: no module of the working directory; errors only, as the viewer logs its start in ten lines.
    command = [sys.executable, "-P", "-m", "rerun_cli", *_LOCAL, str(path)]
    viewer = subprocess.Popen(command, env={"RUST_LOG": "error", **os.environ})
    try:
        code = viewer.wait()
    except KeyboardInterrupt:
        viewer.terminate()
        viewer.wait()
        raise
    if code != 0:
        hint = "write a file with `manipcli export LOG --rerun FILE.rrd`, and open it with `rerun FILE.rrd`"
        raise InvalidArgument("REPLAY019", f"--rerun: the viewer of Rerun ended with code {code}", hint=hint)
