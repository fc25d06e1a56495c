"""The viewer of Rerun on a file: a program of its own, which comes with rerun-sdk."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from manipcli.core.errors import InvalidArgument

_LOCAL = ("--bind", "127.0.0.1", "--port", "auto")
"""The viewer also listens for recordings: by default on all networks, and on a port that a second viewer shares."""

_START = "import sys; from rerun_cli.__main__ import main; sys.exit(main())"
"""`python -m rerun_cli` does not return the exit code of the viewer (0.41)."""


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
    # -P: no module of the working directory; RUST_LOG: the viewer logs its start in ten lines.
    viewer = subprocess.Popen(
        [sys.executable, "-P", "-c", _START, *_LOCAL, str(path)], env={"RUST_LOG": "error", **os.environ}
    )
    try:
        code = viewer.wait()
    except KeyboardInterrupt:
        viewer.terminate()
        viewer.wait()
        raise
    if code != 0:
        hint = "write a file with `manipcli export LOG --rerun FILE.rrd`, and open it with `rerun FILE.rrd`"
        raise InvalidArgument("REPLAY019", f"--rerun: the viewer of Rerun ended with code {code}", hint=hint)
