"""`manipcli export LOG`: a recorded run for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.cli import console
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import number_of

if TYPE_CHECKING:
    from manipcli.replay.playback import Playback

MOST_RATE = 1e5
"""Above the rate of every log: all ticks [Hz]."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LogExports:
    """The options of `export` for a log; None where an option is not given. `rate`: of --rerun [Hz]."""

    foxglove: Path | None
    rerun: Path | None
    rosbag2: Path | None
    glb: Path | None
    files: Path | None
    rate: float | None = None

    def write(self, log: Path, *, package_path: Sequence[Path], allow_outside: bool) -> ExitCode:
        """Writes what is asked for.

        Raises:
            InvalidInput: a path cannot be written, or the log cannot be read.
        """
        check_outputs(("--rerun", self.rerun), ("--glb", self.glb), reads=(log,))
        _check_ending("--glb", self.glb, ".glb")
        _check_ending("--rerun", self.rerun, ".rrd")
        _check_rate(self.rate, self.rerun)
        if self.rerun is not None:
            from manipcli.replay.rerun import installed

            installed.check_installed("--rerun")
        if self.rosbag2 is not None:
            from manipcli.record.foreign.bag import write_bag

            topics = write_bag(log, self.rosbag2)
            console.talk(f"{number_of(len(topics.all), 'topic')}, {number_of(topics.count, 'message')}")
            console.result(str(self.rosbag2))
        if self.files is not None:
            _write_files(log, self.files, package_path=package_path, allow_outside=allow_outside)
        if self.foxglove is not None:
            from manipcli.logs.foxglove import layout

            layout.check_installed()
        if any(path is not None for path in (self.foxglove, self.glb, self.rerun)):
            from manipcli.logs.replay import open_playback
            from manipcli.replay.playback import RATE

            opened = partial(open_playback, log, package_path=package_path, allow_outside=allow_outside)
            playback = opened()
            if playback.lost is not None:
                console.talk(f"the log is incomplete: {playback.lost}")
            for note in playback.notes:
                console.talk(f"note: {note}")
            if self.foxglove is not None:
                from manipcli.logs.foxglove.folder import write_folder

                console.not_drawn(write_folder(self.foxglove, log, playback))
                console.result(str(self.foxglove))
            if self.glb is not None:
                _write_glb(playback, self.glb)
            if self.rerun is not None:
                rate = RATE if self.rate is None else min(self.rate, MOST_RATE)
                _write_rerun(log, playback if rate == RATE else opened(rate=rate), self.rerun, rate=rate)
        return ExitCode.PASSED


def _check_ending(option: str, path: Path | None, ending: str) -> None:
    """
    Raises:
        InvalidInput: the file has another ending.
    """
    if path is not None and path.suffix.lower() != ending:
        raise InvalidInput([Diagnostic("USE098", f"{option} '{path}' is not a {ending} file")])


def _write_files(log: Path, folder: Path, *, package_path: Sequence[Path], allow_outside: bool) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.logs.task_files import README, readme, task_files
    from manipcli.record.read.reading import open_recording

    made = task_files(open_recording(log), log, package_path=package_path, allow_outside=allow_outside)
    for name, data in {**made.files, README: readme(made, log)}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, data)
    for note in made.notes:
        console.talk(f"note: {note}")
    console.talk(f"run it with `{made.command(folder)}`")
    console.result(str(folder))


def _write_glb(playback: Playback, path: Path) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.replay.gltf.run import run_glb

    data, missing = run_glb(playback)
    console.not_drawn(missing)
    write_whole(path, data)
    console.result(str(path))


def _write_rerun(log: Path, playback: Playback, path: Path, *, rate: float) -> None:
    from manipcli.logs.rerun import write_rerun

    notes = write_rerun(path, log, playback, rate=rate)
    console.not_drawn(notes)
    console.result(str(path))
    console.talk(f"{path.stat().st_size / 1e6:.1f} MB; open it with `rerun {path}`")


def _check_rate(rate: float | None, rerun: Path | None) -> None:
    """
    Raises:
        InvalidInput: the rate is not positive, or nothing is sampled with it.
    """
    if rate is not None and rerun is None:
        raise InvalidInput([Diagnostic("USE062", "--rate has no effect without --rerun", hint="add --rerun FILE.rrd")])
    if rate is not None and not rate > 0.0:
        raise InvalidInput([Diagnostic("USE099", f"--rate {rate:g} is not a positive number of samples per second")])
