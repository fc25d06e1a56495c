"""The journal of a sweep: one JSON object per line, as results come.

The first line has what the results depend on: the files of the task with defaults written out, the description, the
hashes of the meshes, versions, seed and design. The others are results in the order in which they came. A last line
without its end is a write that was cut off, and is ignored.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Final, Self

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.lock import Taken, lock
from manipcli.core.text import escape, number_of, shorten
from manipcli.core.version import __version__
from manipcli.run.run_log import mesh_files
from manipcli.simulate.engines import ENGINES
from manipcli.spec.resolved import plain_data
from manipcli.sweep.results import SampleResult
from manipcli.task.load_task import WrittenTask

FORMAT: Final = 1
"""Version of the format."""
SYNC_PERIOD: Final = 2.0
"""[s] of wall time between two writes to the disk itself."""
MOST_NAMED: Final = 4
"""Number of changes shown of a changed task."""
URDF: Final = "URDF of the robot"
VERSION: Final = "manipcli"
Identity = Mapping[str, str]


def identity(written: WrittenTask) -> dict[str, str]:
    """What the results of a sweep depend on, by name."""
    task = written.task
    simulation = task.spec.simulation
    engine = ENGINES[simulation.engine]
    found = {
        VERSION: __version__,
        f"version of {engine.name}": engine.version(),
        "design": str(written.design),
        URDF: hashlib.sha256(task.robot.urdf.encode()).hexdigest(),
    }
    for uri, path in mesh_files(task).items():
        found[f"mesh {uri}"] = hashlib.sha256(path.read_bytes()).hexdigest()
    for prefix, spec in (("", task.spec), ("robot.", task.robot_file.spec), ("", task.controllers)):
        _flatten(prefix, plain_data(spec), found)
    return found


def _flatten(prefix: str, value: object, into: dict[str, str]) -> None:
    if isinstance(value, dict) and value:
        for key, child in value.items():
            _flatten(f"{prefix}{key}.", child, into)
    elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        for k, child in enumerate(value):
            _flatten(f"{prefix}{k}.", child, into)
    else:
        into[prefix.rstrip(".")] = json.dumps(value)


class Journal:
    """An open journal; a context manager.

    Attributes:
        path: of the file.
        results: by number.
    """

    def __init__(self, path: Path, whose: Identity, *, resume: bool, force: bool = False) -> None:
        """Opens a journal, with the results of an earlier sweep if `resume`.

        Args:
            path: of the file, which is created with its folder.
            whose: what the results depend on.
            resume: go on with an existing one; without one, begin.
            force: replace an unfinished one.

        Raises:
            InvalidInput: `resume`, and the file is of another task or version, or is not a journal; or there is an
                unfinished journal, without `resume` and `force`; or another sweep is writing it.
            OSError: it cannot be written.
        """
        self.path = path
        self.results: dict[int, SampleResult] = {}
        self._synced = time.monotonic()
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file: IO[bytes] = path.open("a+b")
        try:
            length = self._begun(whose, resume=resume, force=force)
            self._file.truncate(length)
        except BaseException:
            self._file.close()
            raise
        if not length:
            self._write({"journal": FORMAT, "task": dict(whose)})

    def _begun(self, whose: Identity, *, resume: bool, force: bool) -> int:
        """Reads the results of an earlier sweep; returns the number of bytes that stay.

        Raises:
            InvalidInput: see `__init__`.
        """
        try:
            lock(self._file.fileno())
        except Taken:
            message = f"another sweep is writing '{self.path}'"
            raise InvalidInput([Diagnostic("USE194", message, hint="wait for its end, or add --folder DIR")]) from None
        if force and not resume:
            return 0
        read, length = read_journal(self.path)
        if resume:
            _refuse_changed(self.path, read.whose, whose)
            self.results = {result.number: result for result in read.results}
            return length
        if read.results and not read.complete:
            message = f"'{self.path}' has {number_of(len(read.results), 'result')} of an unfinished sweep"
            raise InvalidInput([Diagnostic("USE183", message, hint="add --resume, or --force to start over")])
        return 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._file.close()

    def add(self, result: SampleResult) -> None:
        """Writes a result; it can be read from now on.

        Raises:
            OSError: the disk is full.
        """
        self.results[result.number] = result
        self._write(result.to_json())

    def finish(self) -> None:
        """Notes that all samples are there, so that a new sweep may replace it."""
        self._write({"complete": True})
        os.fsync(self._file.fileno())

    def _write(self, line: Mapping[str, object]) -> None:
        try:
            self._file.write(f"{json.dumps(line)}\n".encode())
            self._file.flush()
            if time.monotonic() > self._synced + SYNC_PERIOD:
                os.fsync(self._file.fileno())
                self._synced = time.monotonic()
        except OSError as error:
            error.filename = str(self.path)
            raise


class Read:
    """What a journal holds: the task, the results, and whether they are all that were asked for."""

    def __init__(self, whose: Identity, results: Sequence[SampleResult], *, complete: bool) -> None:
        self.whose, self.results, self.complete = whose, results, complete


def read_journal(path: Path) -> tuple[Read, int]:
    """A journal, and the number of bytes of its whole lines.

    Raises:
        InvalidInput: the file is not a journal.
    """
    data = path.read_bytes()
    length = data.rfind(b"\n") + 1
    whose: dict[str, str] = {}
    results: list[SampleResult] = []
    complete = False
    number = 0
    try:
        for number, line in enumerate(data[:length].splitlines(), 1):
            read = json.loads(line)
            if number == 1:
                if read["journal"] != FORMAT:
                    raise ValueError("another format")
                whose = {str(key): str(value) for key, value in read["task"].items()}
            elif "complete" in read:
                complete = True
            else:
                results.append(SampleResult.from_json(read))
                complete = False
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        message = f"'{path}' is not a journal of a sweep: line {number} is not one of its objects"
        raise InvalidInput([Diagnostic("USE184", message, hint="name another folder with --folder")]) from None
    return Read(whose, results, complete=complete), length


def _refuse_changed(path: Path, before: Identity, now: Identity) -> None:
    """
    Raises:
        InvalidInput: they differ; says in what.
    """
    if before and (found := changes(before, now)):
        message = f"the task has changed since '{path}': {found}"
        raise InvalidInput([Diagnostic("USE182", message, hint="undo the change, or start over without --resume")])


def changes(before: Identity, now: Identity) -> str:
    """What differs between two identities: the first few, in words; "" if nothing does."""
    found = []
    for key in dict.fromkeys((*before, *now)):
        if before.get(key) == now.get(key):
            continue
        if key == URDF or key.startswith("mesh "):
            found.append(f"{escape(key)} has another content")
            continue
        a, b = (shorten(escape(value[key]), width=30) if key in value else "absent" for value in (before, now))
        found.append(f"{escape(key)} was {a}, is {b}")
    more = f", and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
    return f"{'; '.join(found[:MOST_NAMED])}{more}"
