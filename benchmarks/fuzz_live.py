"""Attacks on the server of a live session: `python -m benchmarks.fuzz_live [--frames N]`.

A good client in its own process reads the joint states and sends one goal after the other, while others attack.
Measured are the rate that it receives and the time of its goals, and the processor time and memory of the network, in
turn with those without an attack. In the end the log has no command but its goals.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Awaitable
from pathlib import Path
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.extensions.permessage_deflate import ClientPerMessageDeflateFactory

from benchmarks.good_client import TRAJECTORY_MESSAGE
from benchmarks.live import ROOT, Worker, children, line, worker
from benchmarks.malformed_frames import malformed
from manipcli.live.source import recorded_commands

ATTACKERS: Final = 8
PARTS: Final = 3
"""The malformed frames come in so many parts, with pauses in between."""


class Beside:
    """The good client, and the process of the network."""

    def __init__(self, own: Worker) -> None:
        command = [sys.executable, "-m", "benchmarks.good_client", own.url]
        self._own = own
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        (self._network,) = [pid for pid in children(own.process.pid) if _serves(pid)]
        self.others: list[str] = []

    def noticed(self) -> dict[str, Any]:
        """By the good client, since the last call."""
        assert self.process.stdin
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        found: dict[str, Any] = json.loads(line(self.process))
        self.others += [text for text in found["others"] if "dropped" not in text]
        return found

    def used(self) -> float:
        """Processor time of the network [s]."""
        words = Path(f"/proc/{self._network}/stat").read_text().rpartition(")")[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def memory(self) -> int:
        """Resident memory of the network [MiB]."""
        return int(Path(f"/proc/{self._network}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") >> 20

    async def during(self, name: str, attack: Awaitable[object]) -> None:
        """Print what it notices of an attack."""
        self.noticed()
        began, used = time.perf_counter(), self.used()
        attacking = time.process_time()
        ticks = self._own.numbers[0]
        found = await attack
        seconds = time.perf_counter() - began
        speed = 0.001 * (self._own.numbers[0] - ticks) / seconds
        seen = await asyncio.to_thread(self.noticed)
        goals = f"{statistics.median(seen['goals']):.2f} s" if seen["goals"] else "-"
        rate = seen["messages"] / seconds
        rates = f"{rate:.0f} Hz ({rate / speed:.0f} per simulated second)"
        good = f"{rates}, longest gap {seen['gap']:.2f} s, goals {goals}"
        network = f"network {100 * (self.used() - used) / seconds:.0f} % of a core, {self.memory()} MiB"
        own = f"speed {speed:.2f}, attackers {100 * (time.process_time() - attacking) / seconds:.0f} %"
        print(f"{name}: {seconds:.1f} s, {good}; {network}; {own}; {found}", flush=True)


def _serves(pid: int) -> bool:
    return b"manipcli.live.network" in Path(f"/proc/{pid}/cmdline").read_bytes()


async def busy(seconds: float = 5.0) -> str:
    """Frames are made and sent to nobody: what the load of the machine alone costs."""
    draw, began = random.Random(0), time.perf_counter()
    while time.perf_counter() - began < seconds:
        malformed(draw, TRAJECTORY_MESSAGE)
        await asyncio.sleep(0)
    return ""


async def fuzz(url: str, frames: int, first: int) -> str:
    """Malformed frames of as many connections as there are `ATTACKERS`, with seeds from `first` on."""
    codes: Counter[object] = Counter()
    sent = 0

    async def read(socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for text in socket:
                codes[json.loads(text).get("op")] += 1
                assert "Traceback" not in str(text)
        codes[f"closed {socket.close_code} {(socket.close_reason or '').partition(';')[0]}"] += 1

    async def one(seed: int) -> None:
        nonlocal sent
        draw = random.Random(first + seed)
        left = frames // ATTACKERS
        while left > 0:
            async with connect(url, max_size=None, ping_interval=None, close_timeout=120.0) as socket:
                reading = asyncio.create_task(read(socket))
                with contextlib.suppress(ConnectionClosed, AttributeError):  # of a transport that is closed
                    while left > 0:
                        left -= 1
                        await socket.send(malformed(draw, TRAJECTORY_MESSAGE))
                        sent += 1
                        await asyncio.sleep(0)
            await reading

    await asyncio.gather(*(one(seed) for seed in range(ATTACKERS)))
    return f"{sent} frames sent; answers: {dict(codes.most_common())}"


async def raw(url: str, frame: bytes, count: int = 100_000) -> str:
    """The same frame in large writes, from four connections at once."""

    async def one() -> str:
        sent = 0
        async with connect(url, compression=None, ping_interval=None, max_queue=None) as socket:
            answer = asyncio.create_task(socket.recv())
            with contextlib.suppress(ConnectionClosed):
                while sent < count and not socket.transport.is_closing():
                    socket.transport.write(frame * 1000)  # the mask is 0
                    sent += 1000
                    while socket.transport.get_write_buffer_size() and not socket.transport.is_closing():
                        await asyncio.sleep(0.001)
                await socket.send("")
            with contextlib.suppress(ConnectionClosed, TimeoutError):
                await answer
                async with asyncio.timeout(5.0):
                    await socket.wait_closed()
        return f"{sent} sent, closed {socket.close_code} {(socket.close_reason or '').partition(';')[0]}"

    return str(dict(Counter(await asyncio.gather(*(one() for _ in range(4))))))


def tiny(url: str) -> Awaitable[str]:
    """Empty text frames."""
    return raw(url, bytes([0x81, 0x80, 0, 0, 0, 0]))


def pings(url: str) -> Awaitable[str]:
    """Empty pings, each of which is answered by the library."""
    return raw(url, bytes([0x89, 0x80, 0, 0, 0, 0]))


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
    sent, answers = 0, 0
    async with connect(url, compression=None) as socket:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await socket.send("[" + "1," * ((1 << 19) - 2) + "1]")
                sent += 1
                answers += "msg" in str(await socket.recv())
    async with connect(url, compression=None) as other:
        with contextlib.suppress(ConnectionClosed):
            await other.send(" " * (2 << 20))
            await other.wait_closed()
    return f"{answers} frames of 1 MiB were refused, then: {socket.close_code}; one of 2 MiB: {other.close_code}"


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


async def attacks(own: Worker, frames: int) -> None:
    """All of them."""
    url, beside = own.url, Beside(own)
    port = int(url.partition("?")[0].rstrip("/").rpartition(":")[2])
    try:
        await asyncio.sleep(2.0)
        part = -(-frames // PARTS)
        for k in range(PARTS):
            await beside.during("nothing", asyncio.sleep(5.0))
            await beside.during("a busy process", busy())
            await beside.during(f"{part} malformed frames", fuzz(url, part, 1000 * k))
        for name, attack in (
            ("tiny frames", tiny(url)), ("pings", pings(url)), ("large frames", large(url)), ("compression", bomb(url)),
            ("60 clients", crowd(url)), ("strangers", strangers(url)), ("half-open", half_open(port)),
            ("deaf", deaf(url)), ("nothing", asyncio.sleep(5.0)),
        ):  # fmt: skip
            await beside.during(name, attack)
        print(f"the good client was told nothing else: {not beside.others} {beside.others[:3]}")
    finally:
        beside.process.kill()
        beside.process.wait()


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
        asyncio.run(attacks(own, options.frames))
        print(f"commands in the log: {recorded(own, Path(name) / 'serve' / 'serve.mcap')}")


if __name__ == "__main__":
    main()
