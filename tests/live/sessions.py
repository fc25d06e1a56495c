"""Live sessions of tests: with commands at given ticks, or served in a thread."""

from __future__ import annotations

import asyncio
import json
import queue
import threading
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from manipcli import pipeline
from manipcli.live.access import Access
from manipcli.live.command import Command
from manipcli.live.feed import Feed
from manipcli.live.loop import Outside, simulate_live
from manipcli.live.outlet import OutletOptions
from manipcli.live.pace import Pace
from manipcli.live.session import LiveOptions
from manipcli.live.source import Schedule
from manipcli.logs.judge_log import judge_log
from manipcli.record.recording import END
from manipcli.run.execute import build_manager
from manipcli.run.observer import SILENT, Progress
from manipcli.run.run_log import open_log, verdict_metadata
from manipcli.task.part import LIVE, Part

ROOT = Path(__file__).parents[2]
SMALL = f"""\
task: small
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
start: home
simulation: {{settle: 0.1 s}}
steps: [wait: 0.1 s]
"""
HOME = (0.0, 0.1, 0.0, -1.6, 0.0, -0.1, 0.0)
TOKEN = "a-token-of-the-tests"


def trajectory(joints: Sequence[str], positions: Sequence[float], seconds: float) -> dict[str, Any]:
    """A trajectory_msgs/JointTrajectory with one point, without the fields that can be left out."""
    time = {"sec": int(seconds), "nanosec": round(1e9 * (seconds - int(seconds)))}
    return {"joint_names": [*joints], "points": [{"positions": [*positions], "time_from_start": time}]}


def simulated(path: Path, commands: Mapping[int, Sequence[Command]], log: Path, part: Part = LIVE) -> None:
    """A session with these commands by tick, as fast as possible, into a log."""
    task = replace(pipeline.load_task(path), part=part)
    plan = pipeline.plan_task(task)
    manager = build_manager(task, plan.planner.kinematics)
    period = task.spec.simulation.control_period
    outside = Outside(Schedule(commands), Feed(period), Pace(period, speed=None))
    with open_log(task, plan, manager, log, overwrite=True, embed_meshes=True) as recorder:
        end = simulate_live(task, plan, manager, recorder, outside)
        recorder.metadata(END, {"status": end.status, "cause": end.cause})
        recorder.finish(verdict_metadata(judge_log(recorder.partial_path, being_written=True)))


def serving(
    folder: Path,
    use: Callable[[str], Awaitable[None]],
    *,
    token: str | None = TOKEN,
    outlets: Sequence[OutletOptions] = (),
    progress: Progress = SILENT,
    task: Path | str = SMALL,
    speed: float | None = None,
) -> Path:
    """Serve a task, a file or its text, while `use` runs with its URL; returns the log.

    `speed`: simulated seconds per second; None: as fast as possible.
    """
    file, log = folder / "small.yaml", folder / "session.mcap"
    if isinstance(task, Path):
        file = task
    else:
        file.write_text(task)
    announced: queue.Queue[str] = queue.Queue()
    over = threading.Event()
    failures: list[BaseException | str] = []

    def between() -> None:
        if over.is_set():
            raise KeyboardInterrupt

    def serve() -> None:
        options = LiveOptions(Access(token), port=0, speed=speed, outlets=outlets)
        try:
            _, failure = pipeline.serve_task(
                file,
                options,
                log=log,
                progress=progress,
                between=between,
                announce=announced.put,
                allow_outside=True,
            )
            failures.extend([failure] if failure else [])
        except BaseException as error:  # noqa: BLE001 (raised again by the test)
            failures.append(error)
            announced.put("")

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        url = announced.get(timeout=60)
        assert url, failures
        asyncio.run(_within(use, url))
    finally:
        over.set()
        thread.join(60)
    assert failures == [], failures
    return log


async def _within(use: Callable[[str], Awaitable[None]], url: str) -> None:
    async with asyncio.timeout(60):
        await use(url)


class Raw:
    """A client of raw frames; `others` keeps what `until` passed over."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.others: list[dict[str, Any]] = []

    async def send(self, **frame: Any) -> None:
        await self.socket.send(json.dumps(frame))

    async def until(self, **wanted: Any) -> dict[str, Any]:
        """The next message with these values."""
        while True:
            message: dict[str, Any] = json.loads(await self.socket.recv())
            if all(message.get(key) == value for key, value in wanted.items()):
                return message
            self.others.append(message)

    async def call(self, service: str, **request: Any) -> dict[str, Any]:
        """The response of a service."""
        await self.send(op="call_service", id="call", service=service, args=request)
        return await self.until(op="service_response", id="call")


async def opened(url: str) -> Raw:
    """A connected client."""
    return Raw(await connect(url))
