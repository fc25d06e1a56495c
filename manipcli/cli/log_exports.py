"""`manipcli export LOG`: a recorded run for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.cli import console
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import number_of

if TYPE_CHECKING:
    from manipcli.replay.playback import Playback


@dataclass(frozen=True, kw_only=True, slots=True)
class LogExports:
    """The options of `export` for a log; None where an option is not given."""

    foxglove: Path | None
    rerun: Path | None
    rosbag2: Path | None
    glb: Path | None
    files: Path | None

    def write(self, log: Path, *, package_path: Sequence[Path], allow_outside: bool) -> ExitCode:
        """Writes what is asked for.

        Raises:
            InvalidInput: a path cannot be written, or the log cannot be read.
        """
        check_outputs(("--rerun", self.rerun), ("--glb", self.glb), reads=(log,))
        _check_ending("--glb", self.glb, ".glb")
        _check_ending("--rerun", self.rerun, ".rrd")
        if self.rosbag2 is not None:
            from manipcli.record.foreign.bag import write_bag

            topics = write_bag(log, self.rosbag2)
            console.talk(f"{number_of(len(topics.all), 'topic')}, {number_of(topics.count, 'message')}")
            console.result(str(self.rosbag2))
        if self.glb is not None or self.rerun is not None:
            from manipcli.logs.replay import open_playback

            playback = open_playback(log, package_path=package_path, allow_outside=allow_outside)
            if playback.lost is not None:
                console.talk(f"the log is incomplete: {playback.lost}")
            for note in playback.notes:
                console.talk(f"note: {note}")
            if self.glb is not None:
                _write_glb(playback, self.glb)
            if self.rerun is not None:
                _rerun(playback, self.rerun)
        return ExitCode.PASSED


def _check_ending(option: str, path: Path | None, ending: str) -> None:
    """
    Raises:
        InvalidInput: the file has another ending.
    """
    if path is not None and path.suffix.lower() != ending:
        raise InvalidInput([Diagnostic("USE098", f"{option} '{path}' is not a {ending} file")])


def _write_glb(playback: Playback, path: Path) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.replay.gltf.run import run_glb

    data, missing = run_glb(playback)
    console.not_drawn(missing)
    write_whole(path, data)
    console.result(str(path))


def _rerun(playback: Playback, path: Path) -> None:
    message = f"--rerun '{path}': this version does not write recordings for Rerun"
    raise InvalidInput([Diagnostic("USE098", message)])
