"""What recording costs: a tick in the control loop, and the log of a minute; against the mcap library's own writer.

The messages of a run's log are written once more, one by one, with `mcap.writer.Writer` and its defaults (1 MiB chunks,
zstd), already serialised: what it costs to make their bytes is not counted there, but is counted for the recorder.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

from mcap.reader import make_reader
from mcap.writer import Writer

from benchmarks.table import Row
from manipcli.pipeline import run_task
from manipcli.record.write.container import Container
from manipcli.record.write.recorder import Recorder

POUR = Path(__file__).resolve().parents[1] / "tasks" / "pour.yaml"
CALLS = ("tick", "contacts", "event", "goal_sent", "goal_feedback", "goal_ended")
"""What the control loop asks of a recorder."""
THINNED = ("record={rates: {joint_states: 200 Hz, tf: 50 Hz, controller_state: 200 Hz}}",)
clock = time.perf_counter


@dataclass
class Spent:
    """Seconds in the loop (`waited`), of the thread that writes (`thread`), and ticks."""

    waited: float = 0.0
    thread: float = 0.0
    ticks: int = 0


def recorded_run(log: Path) -> Spent:
    """A pour whose recorder is timed."""
    spent = Spent()

    def timed(method: Callable[..., Any], self: Recorder, *arguments: Any, **words: Any) -> Any:
        began = clock()
        result = method(self, *arguments, **words)
        spent.waited += clock() - began
        return result

    def counted(method: Callable[..., Any], self: Recorder, *arguments: Any) -> Any:
        spent.ticks += 1
        return timed(method, self, *arguments)

    def on_thread(method: Callable[..., Any], self: Container, *arguments: Any) -> Any:
        began = time.thread_time()
        result = method(self, *arguments)
        spent.thread += time.thread_time() - began
        return result

    def patched(wrapper: Callable[..., Any], method: Callable[..., Any]) -> Callable[..., Any]:
        return lambda self, *arguments, **words: wrapper(method, self, *arguments, **words)

    methods = {name: patched(counted if name == "tick" else timed, getattr(Recorder, name)) for name in CALLS}
    with (
        patch.multiple(Recorder, **methods),
        patch.object(Container, "chunk", patched(on_thread, Container.chunk)),
    ):
        run_task(POUR, log=log, force=True)
    return spent


def raw_copy(log: Path, target: Path) -> float:
    """Seconds that the library's writer takes for the messages of a log."""
    with log.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        messages = [
            partial(
                Writer.add_message,
                channel_id=channel.id,
                log_time=message.log_time,
                data=message.data,
                publish_time=message.publish_time,
                sequence=message.sequence,
            )
            for _, channel, message in reader.iter_messages(log_time_order=False)
        ]
    with target.open("wb") as out:
        writer = Writer(out)
        writer.start(profile="ros2")
        for schema in summary.schemas.values():
            assert writer.register_schema(schema.name, schema.encoding, schema.data) == schema.id
        for channel in summary.channels.values():
            assert writer.register_channel(channel.topic, "cdr", channel.schema_id) == channel.id
        began = clock()
        for add in messages:
            add(writer)
        writer.finish()
        return clock() - began


def recording_rows(rounds: int) -> list[Row]:
    """Cost of a tick, and bytes of a minute."""
    ticks, threads, raws, ratios = [], [], [], []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        log, thin = Path(name) / "pour.mcap", Path(name) / "thin.mcap"
        recorded_run(log)  # imports, caches: does not count
        for _ in range(rounds):
            spent = recorded_run(log)
            raw = raw_copy(log, Path(name) / "raw.mcap")
            ticks.append(1e6 * spent.waited / spent.ticks)
            threads.append(1e6 * spent.thread / spent.ticks)
            raws.append(1e6 * raw / spent.ticks)
            ratios.append(spent.waited / raw)
        minute = 60.0 / run_task(POUR, log=log, force=True).verdict.simulated_time / 1e6
        run_task(POUR, log=thin, overrides=THINNED)
        sizes = [minute * path.stat().st_size for path in (log, thin)]
    return [
        Row("recording, in the loop / mcap.writer.Writer with the same messages", tuple(ratios), "x", 1.0),
        Row("recording, in the loop", tuple(ticks), "us per tick", None, "encoding included"),
        Row("recording, on the second thread", tuple(threads), "us per tick", None, "compressing, writing"),
        Row("mcap.writer.Writer with the same messages", tuple(raws), "us per tick", None, "serialised before"),
        Row("log of the pour", (sizes[0],), "MB a minute", None, "joints, frames, controllers at 1 kHz"),
        Row("log of the pour, thinned", (sizes[1],), "MB a minute", None, "joints, controllers 200 Hz, frames 50 Hz"),
    ]
