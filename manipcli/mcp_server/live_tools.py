"""Tools of a live session: a robot that is simulated in a process of its own, and does one step after another."""

from __future__ import annotations

import asyncio
import json
import re
import signal
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from pathlib import PurePath
from typing import Annotated, Any, Final

from pydantic import Field

from manipcli.live.remote import Remote, RemoteFailed
from manipcli.live.remote_goal import GoalResult, RemoteGoal
from manipcli.mcp_server.child import GRACE, Runner, bounded, ended, readable, send_signal
from manipcli.mcp_server.folder import LONGEST
from manipcli.mcp_server.tools import Failed, Number, Overrides, TaskPath, inside, options

PATIENCE: Final = 30.0
"""[s] Longest wait for a response; goals have none."""
LASTING: Final = 3600
"""[s] Longest session of wall time: its log grows while nothing happens, too."""
RUN_STEP: Final = ("/task/run_step", "manipcli_msgs/action/RunStep")
CHECK_STEP: Final = "/task/check_step"
_URL = re.compile(rb"ws://127\.0\.0\.1:\d+/\?token=[\w-]+")

Step = Annotated[
    dict[str, Any],
    Field(
        description='A step as in a task file: {"pick": {"object": "cup", "grasp": {"posture": "wrap"}}}, '
        '{"move": {"to": "home"}}.'
    ),
]


class LiveTools:
    """At most one session. Public methods but `close` are tools; their docstrings are for the model.

    Args:
        runner: starts the session.
    """

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        self._session: _Session | None = None

    @property
    def all(self) -> Sequence[Callable[..., Awaitable[Any]]]:
        """The tools."""
        return (self.live_start, self.live_run_step, self.live_check_step, self.live_state, self.live_stop)

    async def live_start(
        self,
        task: TaskPath,
        overrides: Overrides = [],  # noqa: B006 (the schema shows it)
        speed: Annotated[
            float, Field(description="Simulated seconds per second of wall time.", ge=0.001, le=1000)
        ] = 1.0,
        seed: Number = None,
        sample: Number = None,
    ) -> str:
        """Start a live session: the robot and the scene of a task, at its start; its own steps are not run. Then give
        steps with live_run_step. There is one session at a time; it is recorded under runs/."""
        if self._session is not None:
            raise Failed("a session is running; end it with live_stop")
        folder = self._runner.folder
        file, log = inside(folder.file, task), inside(folder.log, f"{PurePath(task).stem}@live")
        words = ["serve", f"--log={log}", "--force", "--port=0", "--no-foxglove", "--no-page", f"--speed={speed:g}"]
        words += [f"--for={LASTING}s", *options(overrides, seed=seed, sample=sample), *self._runner.package_options]
        session = _Session(await self._runner.start([*words, "--", file]))
        try:
            async with asyncio.timeout(self._runner.limit):
                await session.open()
        except BaseException:
            await session.close()
            raise
        self._session = session
        return f"live session of {file} started; log: {log}"

    async def live_run_step(self, step: Step) -> str:
        """Plan and do one step in the live session, from the present state. Returns its outcome (done, or why not) and
        its margin as JSON."""
        text = _json(step)
        found = await self._asked(lambda session: session.goal(*RUN_STEP, {"step": text}))
        if found.get("outcome") == "invalid":
            raise Failed(str(found.get("text")))
        return json.dumps(found)

    async def live_check_step(self, step: Step) -> str:
        """Whether a step is valid and has a plan from the present state of the live session; nothing moves."""
        text = _json(step)
        return json.dumps(
            await self._asked(
                lambda session: session.ask(lambda remote: remote.call(CHECK_STEP, {"step": text}, patience=PATIENCE))
            )
        )

    async def live_state(self) -> str:
        """State of the live session as JSON: simulated time [s], joint positions [rad or m], and the pose of each
        object in the world [m, quaternion x y z w]."""

        def state(remote: Remote) -> dict[str, Any]:
            joints, frames = _latest(remote, "/joint_states"), _latest(remote, "/tf")
            stamp = joints["header"]["stamp"]
            return {
                "time": round(stamp["sec"] + 1e-9 * stamp["nanosec"], 3),
                "joints": dict(zip(joints["name"], map(_rounded, joints["position"]), strict=True)),
                "objects": {
                    frame["child_frame_id"]: [
                        *map(_rounded, frame["transform"]["translation"].values()),
                        *map(_rounded, frame["transform"]["rotation"].values()),
                    ]
                    for frame in frames["transforms"]
                    if frame["header"]["frame_id"] == "world"
                },
            }

        return json.dumps(await self._asked(lambda session: session.ask(state)))

    async def live_stop(self) -> str:
        """End the live session: its log is finished and judged."""
        session = self._opened()
        self._session = None
        return await session.close()

    async def close(self) -> None:
        """End the session, if there is one."""
        if self._session is not None:
            await self._session.close()

    async def _asked(self, ask: Callable[[_Session], Awaitable[dict[str, Any]]]) -> dict[str, Any]:
        session = self._opened()
        try:
            return await ask(session)
        except RemoteFailed as error:
            if session.running:
                raise Failed(str(error)) from None
            self._session = None
            raise Failed(f"the session has ended\n{await session.close()}") from None

    def _opened(self) -> _Session:
        if self._session is None:
            raise Failed("no session is running; start one with live_start")
        return self._session


class _Session:
    """A process that serves, and the connection to it."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self._remote: Remote | None = None
        self._lock = asyncio.Lock()
        self._output: asyncio.Task[str] | None = None

    @property
    def running(self) -> bool:
        return self._process.returncode is None

    async def open(self) -> None:
        """Connect as soon as it says where.

        Raises:
            Failed: it ended instead.
        """
        assert self._process.stdout is not None
        printed = b""
        while (found := _URL.search(printed)) is None:
            line = await self._process.stdout.readline()
            if not line:
                raise Failed(readable(printed.decode("utf-8", "replace")))
            printed += line
        self._output = asyncio.create_task(bounded(self._process.stdout))
        self._remote = await asyncio.to_thread(Remote, found[0].decode())

    async def ask(
        self, ask: Callable[[Remote], dict[str, Any]], cancel: Callable[[], None] = lambda: None
    ) -> dict[str, Any]:
        """What a function of the connection returns, called in a thread, one at a time.

        Args:
            ask: the function.
            cancel: called if the caller is cancelled; the function goes on, and the next one waits for its end.
        """
        assert self._remote is not None
        await self._lock.acquire()
        asking = asyncio.ensure_future(asyncio.to_thread(ask, self._remote))
        asking.add_done_callback(self._asked)
        try:
            return await asyncio.shield(asking)
        except asyncio.CancelledError:
            cancel()
            raise

    async def goal(self, action: str, kind: str, goal: dict[str, object]) -> dict[str, Any]:
        """The result of a goal, however long it takes; a cancelled caller cancels it."""
        sent: list[RemoteGoal] = []
        canceled = False

        def ask(remote: Remote) -> dict[str, Any]:
            sent.append(RemoteGoal(remote, action, kind, goal, feedback=False))
            if canceled:
                sent[0].cancel()
            *_, result = sent[0].events()
            assert isinstance(result, GoalResult)
            return result.values

        def cancel() -> None:
            nonlocal canceled
            canceled = True
            with suppress(RemoteFailed):
                for each in sent:
                    each.cancel()

        return await self.ask(ask, cancel)

    def _asked(self, asking: asyncio.Future[dict[str, Any]]) -> None:
        self._lock.release()
        if not asking.cancelled():
            asking.exception()  # it is retrieved, also where nobody waits any more

    async def close(self) -> str:
        """End the process; returns what it printed after its start."""
        try:
            if self._remote is not None:
                await asyncio.to_thread(self._remote.__exit__, None, None, None)
            if self._output is None:
                return ""
            send_signal(self._process, signal.SIGINT)
            async with asyncio.timeout(2 * GRACE):  # the log is finished and judged
                text = await asyncio.shield(self._output)
                await self._process.wait()
            return text
        except TimeoutError:
            return "the session did not end, and was killed"
        finally:
            await ended(self._process)


def _latest(remote: Remote, topic: str) -> dict[str, Any]:
    """The next message of a topic; what else was on its way is passed over."""
    try:
        return next(remote.messages(topic, patience=PATIENCE))
    finally:
        remote.send(op="unsubscribe", topic=topic)
        remote.settle()


def _json(step: dict[str, Any]) -> str:
    text = json.dumps(step)
    if len(text) > 20 * LONGEST:
        raise Failed(f"a step is at most {20 * LONGEST} characters of JSON")
    return text


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 5)
