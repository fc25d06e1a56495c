"""Attacks on the server of a live session: `python -m benchmarks.fuzz_live [--frames N]`.

A good client reads the joint states and sends one goal after the other, while others attack. Measured are the rate that
it receives and the time of its goals, against those before the attack. In the end the log has no command but its goals.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import random
import signal
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import Awaitable
from pathlib import Path
from typing import Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.extensions.permessage_deflate import ClientPerMessageDeflateFactory

from benchmarks.live import Worker, worker
from benchmarks.live_worker import HOME
from benchmarks.malformed_frames import GOAL, malformed
from manipcli.live.source import recorded_commands

BURST: Final = 950
"""Frames of one connection: those at once before the limit of its rate."""
JOINTS: Final = [f"joint_{k}" for k in range(1, 8)]
POINT: Final = {"positions": [*HOME], "time_from_start": {"sec": 0, "nanosec": 500_000_000}}
TRAJECTORY_MESSAGE: Final = {"joint_names": JOINTS, "points": [POINT]}


class Good:
    """The good client: times of its messages and its goals [s], and whatever else it is sent."""

    def __init__(self) -> None:
        self.messages: list[float] = []
        self.goals: list[float] = []
        self.others: list[str] = []

    async def work(self, url: str) -> None:
        async with connect(url) as socket:
            await socket.send(json.dumps({"op": "subscribe", "topic": "/joint_states"}))
            sent = await self._goal(socket)
            async for text in socket:
                message = json.loads(text)
                if message["op"] == "publish":
                    self.messages.append(time.perf_counter())
                elif message["op"] == "action_result" and message["status"] == 4:
                    self.goals.append(time.perf_counter() - sent)
                    sent = await self._goal(socket)
                else:
                    self.others.append(str(text)[:200])

    async def _goal(self, socket: ClientConnection) -> float:
        goal = {"op": "send_action_goal", "action": GOAL, "id": f"g{len(self.goals)}"}
        await socket.send(json.dumps({**goal, "args": {"trajectory": TRAJECTORY_MESSAGE}}))
        return time.perf_counter()

    async def during(self, name: str, attack: Awaitable[object]) -> None:
        """Print what it notices of an attack."""
        self.messages.clear()
        self.goals.clear()
        began = time.perf_counter()
        found = await attack
        seconds = time.perf_counter() - began
        gap = max((b - a for a, b in zip(self.messages, self.messages[1:], strict=False)), default=0.0)
        goals = f"{statistics.median(self.goals):.2f} s" if self.goals else "-"
        rate = len(self.messages) / seconds
        print(f"{name}: {seconds:.1f} s, {rate:.0f} Hz, longest gap {gap:.2f} s, goals {goals}; {found}", flush=True)


async def fuzz(url: str, frames: int) -> str:
    """Malformed frames from several connections at once."""
    codes: Counter[object] = Counter()
    sent = 0

    async def read(socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for text in socket:
                codes[json.loads(text).get("op")] += 1
                assert "Traceback" not in str(text)
        codes[f"closed {socket.close_code}"] += 1

    async def one(seed: int) -> None:
        nonlocal sent
        draw = random.Random(seed)
        left = min(BURST, frames - BURST * seed)
        while left > 0:
            async with connect(url, max_size=None) as socket:
                reading = asyncio.create_task(read(socket))
                with contextlib.suppress(ConnectionClosed, AttributeError):  # of a transport that is closed
                    while left > 0:
                        left -= 1
                        await socket.send(malformed(draw, TRAJECTORY_MESSAGE))
                        sent += 1
                        await asyncio.sleep(0)  # the good client is in this process, too
            await reading

    seeds = [*range(-(-frames // BURST))]
    for k in range(0, len(seeds), 8):
        await asyncio.gather(*(one(seed) for seed in seeds[k : k + 8]))
    return f"{sent} frames sent; answers: {dict(codes.most_common())}"


async def half_open(port: int, count: int = 300) -> str:
    """Handshakes that never end."""
    began = time.perf_counter()
    pairs = [await asyncio.open_connection("127.0.0.1", port) for _ in range(count)]
    for _, writer in pairs:
        writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
    await asyncio.gather(*(asyncio.wait_for(reader.read(), 60.0) for reader, _ in pairs))
    return f"{count} handshakes, all closed after {time.perf_counter() - began:.0f} s"


async def large(url: str) -> str:
    """Frames of 1 MiB, and one that is larger."""
    async with connect(url, max_size=None, compression=None) as socket:
        for _ in range(50):
            await socket.send("[" + "1," * ((1 << 19) - 2) + "1]")
            await asyncio.sleep(0)
        await socket.send(" " * (2 << 20))
        await socket.wait_closed()
        return f"50 frames of 1 MiB; one of 2 MiB: close code {socket.close_code}"


async def bomb(url: str) -> str:
    """A client that offers compression, and sends a compressed frame all the same."""
    async with connect(url, extensions=[ClientPerMessageDeflateFactory()]) as socket:
        agreed = [*socket.protocol.extensions]
        socket.transport.write(bytes([0xC1, 0x85, 0, 0, 0, 0]) + b"\xaa\x00\x00\x00\x00")  # RSV1 is set
        await socket.wait_closed()
        return f"extensions agreed on: {agreed}; a compressed frame: close code {socket.close_code}"


async def crowd(url: str) -> str:
    """More clients than allowed."""
    sockets, refused = [], 0
    for _ in range(60):
        try:
            sockets.append(await connect(url))
        except InvalidHandshake:
            refused += 1
    for socket in sockets:
        await socket.close()
    return f"{len(sockets)} more clients were accepted, {refused} refused"


async def strangers(url: str) -> str:
    """Wrong tokens, hosts and origins."""
    plain, answers = url.partition("?")[0], []
    for target, options in (
        (f"{plain}?token=wrong", {}), (plain, {"origin": "http://evil.example"}),
        (plain, {"additional_headers": {"Host": "evil.example"}}),
    ):  # fmt: skip
        try:
            await (await connect(target, **options)).close()  # type: ignore[arg-type]
            answers.append("accepted")
        except InvalidHandshake as error:
            answers.append(str(error)[-10:])
    return f"wrong token, origin, host: {answers}"


async def deaf(url: str) -> str:
    """A client that subscribes to everything and reads nothing."""
    socket = await connect(url, max_queue=1, ping_interval=None)
    for topic in ("/joint_states", "/tf", "/clock", "/arm_controller/controller_state", "/robot_description"):
        await socket.send(json.dumps({"op": "subscribe", "topic": topic, "queue_length": 100}))
    socket.transport.pause_reading()
    began = time.perf_counter()
    while time.perf_counter() - began < 120.0:
        try:
            await socket.send(json.dumps({"op": "subscribe", "topic": "/robot_description"}))
        except ConnectionClosed:
            break
        await asyncio.sleep(0.02)
    return f"disconnected after {time.perf_counter() - began:.0f} s"


async def attacks(url: str, frames: int) -> None:
    """All of them."""
    port = int(url.partition("?")[0].rstrip("/").rpartition(":")[2])
    good = Good()
    working = asyncio.create_task(good.work(url))
    await asyncio.sleep(1.0)
    await good.during("nothing", asyncio.sleep(5.0))
    for name, attack in (
        (f"{frames} malformed frames", fuzz(url, frames)), ("large frames", large(url)), ("compression", bomb(url)),
        ("60 clients", crowd(url)), ("strangers", strangers(url)), ("half-open", half_open(port)), ("deaf", deaf(url)),
    ):  # fmt: skip
        await good.during(name, attack)
    await good.during("nothing", asyncio.sleep(5.0))
    working.cancel()
    others = [text for text in good.others if "dropped" not in text]
    print(f"the good client was told nothing else: {not others} {others[:3]}")


def recorded(own: Worker, log: Path) -> str:
    """End the session; the commands in its log."""
    own.process.send_signal(signal.SIGTERM)
    own.process.wait(60)
    schedule = recorded_commands(log, 0.001, failed=True)
    last = own.numbers[0] + 10
    return str(dict(Counter(f"{each.op} {each.name}" for tick in range(last) for each in schedule.take(tick))))


def main() -> None:
    """Attack and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz_live", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--frames", type=int, default=20_000, help="malformed frames [default: 20000]")
    options = parser.parse_args()
    with (
        tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name,
        worker(Path(name) / "serve", "serve", "1") as own,
    ):
        asyncio.run(attacks(own.url, options.frames))
        print(f"commands in the log: {recorded(own, Path(name) / 'serve' / 'serve.mcap')}")


if __name__ == "__main__":
    main()
