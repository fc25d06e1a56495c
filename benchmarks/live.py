"""What serving costs the control loop: `python -m benchmarks.live [--rounds N] [--minutes M]`.

The scene of the pour, held at rest. A plain `run` and sessions of `serve --speed max` with 0, 1 and 20 clients take
turns: all of them are stopped but one, which goes on for 0.4 s of wall time, together with the processes of its
network and its clients. So all see the same load of the machine; a ratio is that of two turns of the same round. The
clients count what they receive. At real-time pace: the time from when a client sends a command to the tick that
obeys it; and the memory of a session with 20 clients of which one never reads.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from mmap import PAGESIZE
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.live_worker import ROOT, THROTTLE, shared
from benchmarks.table import Row, markdown

CROWDS: Final = {0: 0.95, 1: 0.9, 20: 0.7}
"""Numbers of clients, and the least share of the ticks of `run` that is aimed at."""
WARM: Final = 1000
"""Ticks before the first turn."""
TURN: Final = 0.4
AFTER: Final = 0.05
"""[s] Length of a turn, and what of its beginning does not count."""
COMMANDS: Final = 200
MIB: Final = 1 << 20


class Worker:
    """A process of `live_worker`; a session with its clients."""

    def __init__(self, folder: Path, *command: str, clients: int = 0, deaf: int = 0) -> None:
        folder.mkdir()
        (folder / "numbers").write_bytes(bytes(PAGESIZE))
        self.numbers = shared(folder / "numbers")
        self.process = started(command[0], str(folder), *command[1:])
        self.url = "" if command[0] == "run" else line(self.process)
        self.clients: subprocess.Popen[str] | None = None
        while self.numbers[0] < WARM:
            if self.process.poll() is not None:
                raise SystemExit(f"{command} has ended")
            time.sleep(0.05)
        if clients:
            self.clients = started("watch", self.url, str(clients), str(deaf))
            assert line(self.clients) == "ready"
        own = [self.process.pid, *children(self.process.pid)]
        self._pids = own if self.clients is None else [*own, self.clients.pid]

    def counted(self) -> int:
        """Messages that each client has received at least of each topic since the last call."""
        if self.clients is None:
            return 0
        assert self.clients.stdin
        self.clients.stdin.write("\n")
        self.clients.stdin.flush()
        return int(line(self.clients))

    def signal(self, number: int) -> None:
        """To all its processes."""
        for pid in self._pids:
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    def close(self) -> None:
        """End them."""
        self.signal(signal.SIGCONT)  # the network ends when it sees that its session has ended
        for process in (self.clients, self.process):
            if process is not None:
                process.kill()
                process.wait()


def started(*command: str) -> subprocess.Popen[str]:
    """A worker."""
    words = [sys.executable, "-m", "benchmarks.live_worker", *command]
    return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)


def line(process: subprocess.Popen[str]) -> str:
    """Its next line."""
    assert process.stdout
    return process.stdout.readline().strip()


def children(pid: int) -> list[int]:
    """Processes that a process has started."""
    return [
        int(word) for task in Path(f"/proc/{pid}/task").iterdir() for word in (task / "children").read_text().split()
    ]


@contextmanager
def worker(folder: Path, *command: str, clients: int = 0, deaf: int = 0) -> Iterator[Worker]:
    """A worker that is ended."""
    found = Worker(folder, *command, clients=clients, deaf=deaf)
    try:
        yield found
    finally:
        found.close()


def turn(one: Worker) -> tuple[float, float]:
    """Ticks per second of wall time, and of processor time of the loop's thread."""
    one.signal(signal.SIGCONT)
    time.sleep(AFTER)
    ticks, cpu, began = one.numbers[0], one.numbers[1], time.perf_counter()
    time.sleep(TURN)
    done, wall, used = one.numbers[0] - ticks, time.perf_counter() - began, 1e-9 * (one.numbers[1] - cpu)
    one.signal(signal.SIGSTOP)
    return done / wall, done / used


def speed_rows(folder: Path, rounds: int) -> list[Row]:
    """Ticks per second against those of `run`, and the least rate at which a client got a topic."""
    with ExitStack() as stack:
        plain = stack.enter_context(worker(folder / "run", "run"))
        plain.signal(signal.SIGSTOP)
        crowds: dict[int, Worker] = {}
        for clients in CROWDS:
            own = stack.enter_context(worker(folder / f"serve_{clients}", "serve", "max", clients=clients))
            own.counted()
            own.signal(signal.SIGSTOP)
            crowds[clients] = own
        found: dict[int, list[tuple[float, float]]] = {clients: [] for clients in CROWDS}
        for _ in range(rounds):
            reference = turn(plain)
            for clients, own in crowds.items():
                wall, cpu = turn(own)
                found[clients].append((reference[0] / wall, reference[1] / cpu))
        rates = {}
        for clients, own in crowds.items():
            own.signal(signal.SIGCONT)
            rates[clients] = own.counted() / (rounds * (TURN + AFTER))
            own.signal(signal.SIGSTOP)
    rows = []
    for clients, least in CROWDS.items():
        walls, cpus = zip(*found[clients], strict=True)
        note = f"{rates[clients]:.0f} Hz of every topic" if clients else ""
        rows.append(Row(f"ticks/s of run over those of serve, {clients} clients", walls, "x", 1 / least, note))
        rows.append(Row("the same in processor time of the loop's thread", cpus, "x", None))
    return rows


def latency_row(folder: Path) -> Row:
    """From sending a command to the tick that obeys it, at real-time pace."""
    with worker(folder / "latency", "serve", "1") as own:
        sender = started("commands", own.url, str(COMMANDS))
        times = [1e3 * float(line(own.process)) for _ in range(COMMANDS)]
        sender.wait()
    note = f"of {COMMANDS} commands, 95 %: {np.percentile(times, 95):.2g}"
    return Row("from sending a command to the tick that obeys it", tuple(times), "ticks of 1 ms", 2.0, note)


def memory_rows(folder: Path, minutes: float) -> list[Row]:
    """Resident memory of a session, and of its network, with 20 clients of which one never reads."""
    sizes: list[tuple[float, float, float]] = []
    with worker(folder / "memory", "serve", "1", clients=20, deaf=1) as own:
        pids = [own.process.pid, *children(own.process.pid)]
        own.counted()
        began = time.perf_counter()
        while (now := time.perf_counter() - began) < 60.0 * minutes:
            time.sleep(min(5.0, 6.0 * minutes))
            sizes.append((now / 60.0, *(resident(pid) for pid in pids)))  # type: ignore[arg-type]
        rate = own.counted() / (60.0 * minutes)
    late = np.array(sizes[len(sizes) // 5 :])
    rows = []
    for k, name in enumerate(("control loop", "network"), start=1):
        slope = float(np.polyfit(late[:, 0], late[:, k], 1)[0])
        note = f"{minutes:g} min, 20 clients, one never reads, {rate:.0f} Hz; {late[0, k]:.1f} to {late[-1, k]:.1f} MiB"
        rows.append(Row(f"memory of the {name}", (slope,), "MiB/min", 0.1, note))
    return rows


def resident(pid: int) -> float:
    """Resident memory of a process [MiB]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGESIZE / MIB


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.live", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rounds", type=int, default=40, help="turns of each (default 40)")
    parser.add_argument(
        "--minutes", type=float, default=10.0, help="of the measurement of memory; 0: without (default 10)"
    )
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        rows = speed_rows(Path(name), options.rounds) if options.rounds else []
        rows += [latency_row(Path(name))]
        if options.minutes:
            rows += memory_rows(Path(name), options.minutes)
    print(f"Each client asks for a message of each topic every {THROTTLE} ms at most.")
    print(markdown(rows))


if __name__ == "__main__":
    main()
