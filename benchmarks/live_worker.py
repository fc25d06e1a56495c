"""Processes of `benchmarks.live`: a run, a session, and clients of a session. Each is one command of this module.

A worker writes its ticks and the processor time of its loop into shared numbers, so that it can be measured while it is
stopped and continued from outside.
"""

from __future__ import annotations

import asyncio
import json
import mmap
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final
from unittest.mock import patch

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from manipcli import pipeline
from manipcli.live.access import Access
from manipcli.live.command import Command
from manipcli.live.obey import Obedience
from manipcli.live.session import LiveOptions

ROOT: Final = Path(__file__).resolve().parents[1]
TOPICS: Final = (
    "/joint_states", "/tf", "/clock", "/arm_controller/controller_state", "/hand_controller/controller_state",
)  # fmt: skip
TRAJECTORY: Final = "/arm_controller/joint_trajectory"
HOME: Final = (0.0, 0.1, 0.0, -1.6, 0.0, -0.1, 0.0)
TOKEN: Final = "token-of-the-benchmark"
THROTTLE: Final = 25
"""[ms] Least time between two messages of a topic that a client asks for: 40 Hz."""


def shared(file: Path) -> memoryview:
    """Two numbers: ticks, and processor time [ns] of the loop's thread."""
    with file.open("r+b") as open_file:
        return memoryview(mmap.mmap(open_file.fileno(), mmap.PAGESIZE)).cast("q")


def counting(numbers: memoryview) -> Callable[[], None]:
    """To be called once a tick; ends the session after SIGTERM."""
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))

    def count() -> None:
        if ended:
            raise KeyboardInterrupt
        numbers[0] += 1
        if numbers[0] % 50 == 0:
            numbers[1] = time.thread_time_ns()

    return count


def task_file(folder: Path) -> Path:
    """The pour's scene, and a long wait."""
    lines = (ROOT / "tasks/pour.yaml").read_text().split("\nsteps:")[0].replace("../", f"{ROOT}/")
    file = folder / "hold.yaml"
    file.write_text(f"{lines}\nsteps:\n  - wait: 3600 s\n")
    return file


def run(folder: Path) -> None:
    """A plain run."""
    numbers = shared(folder / "numbers")

    class Ticks(type(pipeline.SILENT)):  # type: ignore[misc]
        def tick(self, simulated_time: float, wall: float) -> None:
            numbers[0], numbers[1] = round(1000 * simulated_time), time.thread_time_ns()

    pipeline.run_task(task_file(folder), log=folder / "run.mcap", force=True, progress=Ticks())


def serve(folder: Path, speed: str) -> None:
    """A session; prints its URL, and then when each command of `commands` was sent and obeyed [s]."""
    count = counting(shared(folder / "numbers"))
    obey = Obedience.obey
    out = os.fdopen(os.dup(1), "w")  # from the opening of the scene on, stdout is stderr

    def timed(self: Obedience, command: Command) -> bool:
        if command.name == TRAJECTORY:
            sent = float(json.loads(command.json)["header"]["frame_id"])
            print(f"{time.perf_counter() - sent:.6f}", file=out, flush=True)
        return obey(self, command)

    def announce(url: str) -> None:
        print(url, file=out, flush=True)

    options = LiveOptions(Access(TOKEN), port=0, speed=None if speed == "max" else float(speed))
    with patch.object(Obedience, "obey", timed):
        pipeline.serve_task(
            task_file(folder), options, log=folder / "serve.mcap", force=True, between=count, announce=announce
        )


async def watch(url: str, clients: int, deaf: int) -> None:
    """Clients that count, of which some never read; each line of stdin is answered with the least count of a topic of
    a client since the last line."""
    counts: list[Counter[str]] = [Counter() for _ in range(clients - deaf)]

    async def subscribed(k: int) -> None:
        async with connect(url, compression=None, max_size=None, max_queue=1 if k < deaf else 16) as socket:
            for topic in TOPICS:
                throttle = 0 if k < deaf else THROTTLE
                await socket.send(json.dumps({"op": "subscribe", "topic": topic, "throttle_rate": throttle}))
            if k < deaf:
                await socket.wait_closed()
                return
            async for text in socket:
                topic = str(text).partition('"topic":"')[2].partition('"')[0]
                if topic in TOPICS:
                    counts[k - deaf][topic] += 1

    async def one(k: int) -> None:
        while True:
            with suppress(ConnectionClosed):
                await subscribed(k)

    tasks = [asyncio.create_task(one(k)) for k in range(clients)]
    while not all(len(count) >= len(TOPICS) for count in counts):
        await asyncio.sleep(0.05)
    print("ready", flush=True)
    while await asyncio.to_thread(sys.stdin.readline):
        print(min(count[topic] for count in counts for topic in TOPICS), flush=True)
        for count in counts:
            count.clear()
    for task in tasks:
        task.cancel()


async def commands(url: str, count: int) -> None:
    """Sends trajectories that have the time of sending in their frame, at irregular times."""
    point = {"positions": HOME, "time_from_start": {"sec": 1, "nanosec": 0}}
    joints = [f"joint_{k}" for k in range(1, 8)]
    async with connect(url) as socket:
        for k in range(count):
            await asyncio.sleep(0.02 + 0.0137 * (k % 7))
            message = {"header": {"frame_id": repr(time.perf_counter())}, "joint_names": joints, "points": [point]}
            await socket.send(json.dumps({"op": "publish", "topic": TRAJECTORY, "msg": message}))
        await asyncio.sleep(0.5)


def main(what: str, *arguments: str) -> None:
    """One worker."""
    if what == "run":
        run(Path(arguments[0]))
    elif what == "serve":
        serve(Path(arguments[0]), arguments[1])
    elif what == "watch":
        asyncio.run(watch(arguments[0], int(arguments[1]), int(arguments[2])))
    else:
        asyncio.run(commands(arguments[0], int(arguments[1])))


if __name__ == "__main__":
    main(*sys.argv[1:])
