"""What faults do to a sweep: the CSV at the end is that of an undisturbed sweep, or the sweep reports what is missing.

Each fault is caused for real, on this machine and on a Dask cluster of processes that the fault kills, cuts off or
starves. A sample that crashes or hangs does so when it opens its log.

    python -m benchmarks.sweep_faults
    python -m benchmarks.sweep_faults --only cut killed --samples 30 --seed 3
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
TASK: Final = """\
task: held
robot: ../robots/arm7_hand3/robot.yaml
controllers: ../controllers/arm7_hand3.yaml
simulation: {engine: kinematic, control_period: 1 ms, step: 1 ms, settle: 0}
frames: {mark: {pose: {xyz: [0.6, 0.4, 0.025]}}}
scene:
  block: {box: {size: [5 cm, 5 cm, 5 cm]}, fixed: true, pose: {xyz: [0.6, 0.4, 0.025]}}
steps: [{wait: 1 s}]
expect: [{near: {object: block, to: mark, within: 1 cm}}]
vary:
  scene.block.pose.xyz: {offset: {uniform: [[0, 0, 0], [2 cm, 0, 0]]}}
"""
FAULT: Final = '''
"""Python imports this at its start: sample 3 crashes or hangs when it opens its log, each time or the first time."""
import os, signal, sys, time
def hook(event, arguments):
    if event == "open" and str(arguments[0]).endswith("held@3.mcap.partial"):
        times, marker = os.environ["FAULT_TIMES"], os.environ["FAULT_MARKER"]
        with open(marker, "a") as file:
            file.write("x")
        if times == "each" or os.path.getsize(marker) <= int(times):
            if os.environ["FAULT"] == "hang":
                time.sleep(1e6)
            os.kill(os.getpid(), signal.SIGSEGV)
sys.addaudithook(hook)
'''
PATIENCE: Final = 300.0
"""[s] limit of a sweep."""
CUT: Final = 10.0
"""[s] without a connection."""


class Proxy:
    """A TCP relay that can be cut: `reset` closes all connections and accepts none, `silent` forwards nothing."""

    def __init__(self, port: int) -> None:
        self.to = port
        self._listener: socket.socket | None = None
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._silent = threading.Event()
        self.port = 0
        self._listen()

    def reset(self, duration: float) -> None:
        """Closes everything, and listens again after `duration` [s]."""
        assert self._listener is not None
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for pair in self._pairs:
            for end in pair:
                with suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
        time.sleep(duration)
        self._listen()

    def silence(self, duration: float) -> None:
        """Forwards nothing for `duration` [s]."""
        self._silent.set()
        time.sleep(duration)
        self._silent.clear()

    def _listen(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", self.port), reuse_port=True)
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        with suppress(OSError):
            while True:
                near, _ = listener.accept()
                try:
                    far = socket.create_connection(("127.0.0.1", self.to))
                except ConnectionRefusedError:
                    near.close()
                    continue
                self._pairs.append((near, far))
                threading.Thread(target=self._relay, args=(near, far), daemon=True).start()

    def _relay(self, near: socket.socket, far: socket.socket) -> None:
        with suppress(OSError), near, far:
            while True:
                for readable in select.select([near, far], [], [])[0]:
                    data = readable.recv(65536)
                    while self._silent.is_set():
                        time.sleep(0.05)
                    if not data:
                        return
                    (far if readable is near else near).sendall(data)


class Cluster:
    """A Dask scheduler and its workers, as processes."""

    def __init__(self, folder: Path, *, python: str = sys.executable) -> None:
        self._folder, self._python = folder, python
        self.workers: list[subprocess.Popen[bytes]] = []
        file = folder / "scheduler.json"
        self._scheduler = self._started(
            "scheduler", "--scheduler-file", str(file), "--host", "127.0.0.1", "--port", "0"
        )
        while not file.exists() or not file.read_text():
            time.sleep(0.1)
        time.sleep(0.1)
        self.port = int(json.loads(file.read_text())["address"].rpartition(":")[2])

    def worker(self, *words: str, python: str = "", cwd: Path | None = None, limits: str = "", **env: str) -> None:
        """Starts a worker with one thread; `limits`: shell commands before it."""
        address = f"tcp://127.0.0.1:{self.port}"
        arguments = ("worker", address, "--nworkers", "1", "--nthreads", "1", *words)
        self.workers.append(self._started(*arguments, python=python, cwd=cwd, limits=limits, **env))

    def close(self) -> None:
        """Ends everything."""
        for process in (*self.workers, self._scheduler):
            kill_all(process.pid)
            process.wait()

    def _started(
        self, *words: str, python: str = "", cwd: Path | None = None, limits: str = "", **env: str
    ) -> subprocess.Popen[bytes]:
        command = [python or self._python, "-m", "dask", *words, "--no-dashboard"]
        shell = ["bash", "-c", f'{limits}\nexec "$@"', "bash", *command] if limits else command
        with (self._folder / "cluster.txt").open("ab") as output:
            return subprocess.Popen(
                shell, stdout=output, stderr=output, stdin=subprocess.DEVNULL, cwd=cwd or self._folder,
                env=os.environ | env,
            )  # fmt: skip


def children(pid: int) -> list[int]:
    """All processes below one, the deepest last."""
    found = []
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                found += [int(child), *children(int(child))]
    return found


def kill_all(pid: int) -> None:
    """SIGKILL for a process and all below it."""
    for each in (pid, *children(pid)):
        with suppress(ProcessLookupError):
            os.kill(each, signal.SIGKILL)


class Lab:
    """Sweeps of a short task."""

    def __init__(self, folder: Path, samples: int, seed: int) -> None:
        self.folder, self.samples, self.random = folder, samples, random.Random(seed)
        (folder / "tasks").mkdir()
        (folder / "fault").mkdir()
        (folder / "fault" / "sitecustomize.py").write_text(FAULT)
        for name in ("robots", "controllers"):
            (folder / name).symlink_to(ROOT / name)
        (folder / "tasks" / "held.yaml").write_text(TASK)
        self.csv = folder / "a.csv"
        self.journal = folder / "runs" / "sweep" / "random" / "tasks" / "held.jsonl"
        self.expected = self.finished(self.started())

    def command(self, *words: str) -> list[str]:
        command = [sys.executable, "-m", "manipcli", "sweep", "tasks/held.yaml", "--samples", str(self.samples)]
        return [*command, "-n", "2", "--at-least", "0%", "--csv", str(self.csv), *words]

    def started(self, *words: str, limits: str = "", **env: str) -> subprocess.Popen[str]:
        self.csv.unlink(missing_ok=True)
        command = self.command(*(words if "--resume" in words else (*words, "--force")))
        shell = ["bash", "-c", f'{limits}\nexec "$@"', "bash", *command] if limits else command
        return subprocess.Popen(
            shell, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | env
        )

    def finished(self, process: subprocess.Popen[str]) -> str:
        """The CSV at the end; where there is none, what was reported."""
        out, err = process.communicate(timeout=PATIENCE)
        if self.csv.exists():
            return self.csv.read_text()
        missing = [line.strip() for line in out.splitlines() if "missing:" in line]
        errors = [line for line in err.splitlines() if line.startswith(("error", "journal", "Traceback"))]
        return " | ".join([f"exit code {process.returncode}", *missing, *errors])

    def faulty(self, fault: str, times: str) -> dict[str, str]:
        """Environment in which sample 3 has a fault."""
        marker = self.folder / "marker"
        marker.unlink(missing_ok=True)
        path = os.pathsep.join(filter(None, (str(self.folder / "fault"), os.environ.get("PYTHONPATH"))))
        return {"PYTHONPATH": path, "FAULT": fault, "FAULT_TIMES": times, "FAULT_MARKER": str(marker)}

    def outcome(self, found: str) -> str:
        if found == self.expected:
            return "same CSV"
        if not found.startswith("sample,"):
            return found
        pairs = zip(found.splitlines(), self.expected.splitlines(), strict=False)
        differ = [a for a, b in pairs if a != b]
        return f"{len(differ)} rows differ: {differ[0][:110]}" if differ else "CSV of another length"

    @contextmanager
    def cluster(self, workers: int = 2, **env: str) -> Iterator[Cluster]:
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            cluster = Cluster(Path(name))
            try:
                for _ in range(workers):
                    cluster.worker(**env)
                yield cluster
            finally:
                cluster.close()

    def journalled(self, least: int, process: subprocess.Popen[str]) -> None:
        """Waits until the journal has results."""
        began = time.time()
        while process.poll() is None:
            with suppress(OSError):
                text = self.journal.read_bytes()
                if (
                    self.journal.stat().st_mtime >= began - 1.0
                    and text.count(b"\n") > least
                    and b"complete" not in text
                ):
                    return
            time.sleep(0.02)


def worker_killed(lab: Lab) -> str:
    """A worker, its nanny and all below them are killed at five random moments; another one is started."""
    with lab.cluster() as cluster:
        process = lab.started("--scheduler", f"tcp://127.0.0.1:{cluster.port}")
        lab.journalled(1, process)
        for k in range(5):
            time.sleep(lab.random.uniform(0.1, 1.5))
            worker = cluster.workers[k]
            kill_all(worker.pid) if k % 2 else worker.kill()
            cluster.worker()
        return lab.outcome(lab.finished(process))


def worker_process_killed(lab: Lab) -> str:
    """The process of a worker is killed at five random moments, its nanny starts it again."""
    with lab.cluster() as cluster:
        process = lab.started("--scheduler", f"tcp://127.0.0.1:{cluster.port}")
        lab.journalled(1, process)
        for _ in range(5):
            time.sleep(lab.random.uniform(0.1, 1.5))
            below = [pid for worker in cluster.workers for pid in children(worker.pid)[:2]]
            with suppress(ProcessLookupError):
                os.kill(lab.random.choice(below), signal.SIGKILL)
        return lab.outcome(lab.finished(process))


def _cut(lab: Lab, how: Callable[[Proxy], Callable[[float], None]]) -> str:
    with lab.cluster() as cluster:
        proxy = Proxy(cluster.port)
        process = lab.started("--scheduler", f"tcp://127.0.0.1:{proxy.port}")
        lab.journalled(2, process)
        how(proxy)(CUT)
        return lab.outcome(lab.finished(process))


def cut(lab: Lab) -> str:
    """The connection of the client to the scheduler is closed and refused for 10 s."""
    return _cut(lab, lambda proxy: proxy.reset)


def silent(lab: Lab) -> str:
    """The connection of the client to the scheduler carries nothing for 10 s."""
    return _cut(lab, lambda proxy: proxy.silence)


def scheduler_restarted(lab: Lab) -> str:
    """The scheduler is killed with its workers, and others are started behind the same address."""
    with lab.cluster() as first:
        proxy = Proxy(first.port)
        process = lab.started("--scheduler", f"tcp://127.0.0.1:{proxy.port}")
        lab.journalled(2, process)
        first.close()
        with lab.cluster() as second:
            proxy.to = second.port
            return lab.outcome(lab.finished(process))


def _sample(lab: Lab, fault: str, times: str, *, on_cluster: bool) -> str:
    env = lab.faulty(fault, times)
    words = ("--silence", "2")
    if not on_cluster:
        return lab.outcome(lab.finished(lab.started(*words, **env)))
    with lab.cluster(**env) as cluster:
        return lab.outcome(lab.finished(lab.started(*words, "--scheduler", f"tcp://127.0.0.1:{cluster.port}")))


def worker_disk_full(lab: Lab) -> str:
    """A worker may write no file above 8 kB."""
    with lab.cluster(workers=1) as cluster:
        cluster.worker(limits="ulimit -f 8")
        return lab.outcome(lab.finished(lab.started("--scheduler", f"tcp://127.0.0.1:{cluster.port}")))


def disk_full(lab: Lab) -> str:
    """No file may grow above 100 kB after some samples; then they may, and the sweep goes on."""
    process = lab.started()
    lab.journalled(3, process)
    for pid in (process.pid, *children(process.pid)):
        with suppress(ProcessLookupError):
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (100_000, resource.RLIM_INFINITY))
    return f"{lab.outcome(lab.finished(process))}; then {lab.outcome(lab.finished(lab.started('--resume')))}"


def sweep_killed(lab: Lab) -> str:
    """The sweep is killed at five random moments, and resumed."""
    words: tuple[str, ...] = ()
    for _ in range(5):
        process = lab.started(*words)
        words = ("--resume",)
        time.sleep(lab.random.uniform(1.0, 6.0))
        process.kill()
        process.communicate()
    return lab.outcome(lab.finished(lab.started("--resume")))


FAULTS: Final[dict[str, Callable[[Lab], str]]] = {
    "worker-killed": worker_killed,
    "worker-process-killed": worker_process_killed,
    "cut": cut,
    "silent": silent,
    "scheduler-restarted": scheduler_restarted,
    "segfault-local": lambda lab: _sample(lab, "segfault", "each", on_cluster=False),
    "segfault-once-local": lambda lab: _sample(lab, "segfault", "1", on_cluster=False),
    "hang-local": lambda lab: _sample(lab, "hang", "each", on_cluster=False),
    "segfault-cluster": lambda lab: _sample(lab, "segfault", "each", on_cluster=True),
    "segfault-once-cluster": lambda lab: _sample(lab, "segfault", "1", on_cluster=True),
    "hang-cluster": lambda lab: _sample(lab, "hang", "each", on_cluster=True),
    "worker-disk-full": worker_disk_full,
    "disk-full": disk_full,
    "sweep-killed": sweep_killed,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Cause the faults, and print what the sweep made of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1, help="of the moments of the faults")
    parser.add_argument("--only", nargs="+", metavar="FAULT", help=f"of {', '.join(FAULTS)}", default=[*FAULTS])
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        lab = Lab(Path(name), options.samples, options.seed)
        for fault in options.only:
            began = time.monotonic()
            print(f"{fault:22} {FAULTS[fault](lab)}  ({time.monotonic() - began:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
