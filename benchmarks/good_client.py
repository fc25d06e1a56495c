"""A good client beside attackers, in a process of its own: `python -m benchmarks.good_client URL`.

It reads the joint states and sends one goal after the other. Each line of stdin is answered with what it noticed since
the last one, a line of JSON: messages, longest time between two [s], times of its goals [s], and whatever else it was
sent.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import sys
import time
from typing import Final

from websockets.asyncio.client import ClientConnection, connect

from benchmarks.live_worker import HOME
from benchmarks.malformed_frames import GOAL

JOINTS: Final = [f"joint_{k}" for k in range(1, 8)]
POINT: Final = {"positions": [*HOME], "time_from_start": {"sec": 0, "nanosec": 500_000_000}}
TRAJECTORY_MESSAGE: Final = {"joint_names": JOINTS, "points": [POINT]}


class Good:
    """What it noticed."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._goals: list[float] = []
        self._others: list[str] = []
        self._sent = 0

    async def work(self, url: str) -> None:
        """Read and send goals until the connection ends."""
        async with connect(url) as socket:
            await socket.send(json.dumps({"op": "subscribe", "topic": "/joint_states"}))
            sent = await self._goal(socket)
            async for text in socket:
                message = json.loads(text)
                if message["op"] == "publish":
                    self._times.append(time.perf_counter())
                elif message["op"] == "action_result" and message["status"] == 4:
                    self._goals.append(time.perf_counter() - sent)
                    sent = await self._goal(socket)
                else:
                    self._others.append(str(text)[:200])
        self._others.append(f"closed with {socket.close_code} {socket.close_reason}")

    async def _goal(self, socket: ClientConnection) -> float:
        self._sent += 1
        goal = {"op": "send_action_goal", "action": GOAL, "id": f"g{self._sent}"}
        await socket.send(json.dumps({**goal, "args": {"trajectory": TRAJECTORY_MESSAGE}}))
        return time.perf_counter()

    def noticed(self) -> str:
        """As a line of JSON; starts again."""
        times = self._times
        gap = max((b - a for a, b in itertools.pairwise(times)), default=0.0)
        found = {"messages": len(times), "gap": gap, "goals": [*self._goals], "others": [*self._others]}
        for each in (self._times, self._goals, self._others):
            each.clear()
        return json.dumps(found)


async def main(url: str) -> None:
    """Answer the lines of stdin."""
    good = Good()
    working = asyncio.create_task(good.work(url))
    while await asyncio.to_thread(sys.stdin.readline):
        print(good.noticed(), flush=True)
    working.cancel()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
