"""One pour for the whole test session: several tests look at the same run."""

from __future__ import annotations

import fcntl
import gc
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import hypothesis
import pytest
from mcap.reader import make_reader
from mcap.records import Message
from mcap.writer import Writer

from manipcli.batch.child import _Beats, _end_of
from manipcli.cli.app import main
from manipcli.description.expanded import Description, read_description

ROOT = Path(__file__).parents[1]

hypothesis.settings.register_profile("any machine", deadline=None)
hypothesis.settings.load_profile("any machine")


@pytest.fixture(autouse=True, scope="session")
def descriptions_read_once() -> Iterator[None]:
    """The descriptions of our robots are expanded once per process: they do not change, and each takes 50 ms."""
    found: dict[tuple[object, ...], Description] = {}

    def read(path: Path, **options: Any) -> Description:
        if ROOT / "robots" not in path.parents:
            return read_description(path, **options)
        key = (path, repr(sorted(options.get("arguments", {}).items())), *sorted(options.get("allow_env", ())))
        if key not in found:
            found[key] = read_description(path, **options)
        path.open().close()  # whoever records which files are read sees this one
        return replace(found[key], packages=options["packages"])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("manipcli.description.lint.examine.read_description", read)
        yield


def pytest_collection_finish() -> None:
    """What is there before the first test stays: no search for garbage looks at it."""
    gc.collect()
    gc.freeze()


@dataclass(frozen=True)
class Ran:
    """A command line that came to its end."""

    code: int
    out: str
    err: str


RunCli = Callable[..., Ran]


@pytest.fixture
def call_cli(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> RunCli:
    """Calls the command line in this process, which takes a second less."""

    def run(*words: str | Path, cwd: Path) -> Ran:
        monkeypatch.chdir(cwd)
        capfd.readouterr()
        code = main([*map(str, words)])
        return Ran(code, *capfd.readouterr())

    return run


@pytest.fixture(scope="session")
def run_cli() -> RunCli:
    """Calls the command line in a process of its own, as a user does."""

    def run(*words: str | Path, cwd: Path, timeout: float = 120.0, **options: object) -> Ran:
        done = subprocess.run(
            [sys.executable, "-m", "manipcli", *map(str, words)],
            cwd=cwd,
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout,
            **options,  # type: ignore[call-overload]
        )
        return Ran(done.returncode, done.stdout, done.stderr)

    return run


class _Thread:
    """A thread that takes the place of the process of a run, with the same messages to its parent."""

    returncode = 0

    def __init__(self, command: Sequence[str], **_: object) -> None:
        connection = Connection(os.dup(int(command[-1])))
        self.pid = os.getpid()
        self._thread = Thread(target=self._run, args=(connection,), daemon=True)
        self._thread.start()

    def _run(self, connection: Connection) -> None:
        with connection:
            connection.send(_end_of(connection.recv(), _Beats(connection)))

    def wait(self, timeout: float | None = None) -> None:
        self._thread.join(timeout)

    def kill(self) -> None: ...


@pytest.fixture
def runs_in_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of tests and baselines are in threads, which take a second less than processes."""
    names = SimpleNamespace(Popen=_Thread, DEVNULL=subprocess.DEVNULL, TimeoutExpired=subprocess.TimeoutExpired)
    monkeypatch.setattr("manipcli.batch.process.subprocess", names)
    monkeypatch.setattr("manipcli.batch.forks.available", lambda: False)


@dataclass(frozen=True)
class PourRun:
    """`ran`: `manipcli run tasks/pour.yaml --format json`; `log`: where it recorded."""

    ran: Ran
    log: Path


@pytest.fixture(scope="session")
def pour_run(run_cli: RunCli, tmp_path_factory: pytest.TempPathFactory) -> PourRun:
    """The pour, run once, whatever the number of workers of pytest-xdist: the first that needs it runs it."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    folder, kept = folder / "pour", folder / "pour.pickle"
    with folder.with_suffix(".lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        if not kept.exists():
            folder.mkdir()
            ran = run_cli("run", ROOT / "tasks" / "pour.yaml", "--format", "json", cwd=folder)
            kept.write_bytes(pickle.dumps((ran.code, ran.out, ran.err)))
    return PourRun(Ran(*pickle.loads(kept.read_bytes())), folder / "runs" / "pour.mcap")


Pendulum = Callable[..., Path]


@pytest.fixture
def pendulum(tmp_path: Path) -> Pendulum:
    """Writes `robot.yaml`, 1 kg that hangs 0.25 m below a `hinge` of 20 N m, and gives its folder.

    `robot` is written at the end of that file, `urdf` at that of the description.
    """

    def write(robot: str, *, urdf: str = "") -> Path:
        (tmp_path / "pendulum.urdf").write_text(
            """<robot name="pendulum"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="3" effort="20"/></joint>"""
            f"{urdf}</robot>"
        )
        (tmp_path / "robot.yaml").write_text(
            f"robot: pendulum\ndescription: pendulum.urdf\ngroups: {{all: {{joints: [hinge]}}}}\n{robot}"
        )
        return tmp_path

    return write


Rewrite = Callable[..., Path]


@pytest.fixture(scope="session")
def rewrite_log() -> Rewrite:
    """Writes a log once more with the mcap library, all its checksums valid.

    `message(topic, message)` gives the bytes that take the place of a message's, or None to leave it out;
    `schema(name, text)` the text of a type; `attachment(name, data)` and `metadata(name, values)` give what takes the
    place of those, or None. What is said besides goes to the library's `Writer`.
    """

    def rewrite(
        source: Path,
        target: Path,
        *,
        message: Callable[[str, Message], bytes | None] = lambda _, one: one.data,
        attachment: Callable[[str, bytes], bytes | None] = lambda _, data: data,
        metadata: Callable[[str, dict[str, str]], dict[str, str] | None] = lambda _, values: values,
        schema: Callable[[str, bytes], bytes] = lambda _, text: text,
        **writing: Any,
    ) -> Path:
        with source.open("rb") as file, target.open("wb") as out:
            reader, writer = make_reader(file), Writer(out, **writing)
            header, summary = reader.get_header(), reader.get_summary()
            assert summary is not None
            writer.start(profile=header.profile, library=header.library)
            schemas = {
                k: writer.register_schema(one.name, one.encoding, schema(one.name, one.data))
                for k, one in summary.schemas.items()
            }
            channels = {
                k: writer.register_channel(one.topic, one.message_encoding, schemas[one.schema_id], one.metadata)
                for k, one in summary.channels.items()
            }
            for held in reader.iter_attachments():
                data = attachment(held.name, held.data)
                if data is not None:
                    writer.add_attachment(held.create_time, held.log_time, held.name, held.media_type, data)
            for record in reader.iter_metadata():
                values = metadata(record.name, record.metadata)
                if values is not None:
                    writer.add_metadata(record.name, values)
            for _, channel, one in reader.iter_messages(log_time_order=False):
                data = message(channel.topic, one)
                if data is not None:
                    writer.add_message(channels[channel.id], one.log_time, data, one.publish_time, one.sequence)
            writer.finish()
        return target

    return rewrite
