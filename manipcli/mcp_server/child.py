"""manipcli in a process of its own: bounded output, a time limit, and an end when the client cancels."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from manipcli.mcp_server.folder import Folder

MAX_OUTPUT: Final = 40_000
"""Most characters of an output; of a longer one, the beginning and the end."""
GRACE: Final = 15.0
"""[s] Time to end after an interrupt; a run then has finished its log."""
_TRACEBACK: Final = "Traceback (most recent call last)"


@dataclass(frozen=True, slots=True)
class Output:
    """Of a command that ended: its exit code, and what it printed."""

    code: int
    text: str


@dataclass(frozen=True, slots=True)
class Runner:
    """Starts commands in a folder.

    Attributes:
        folder: that they are confined to.
        packages: folders of packages outside of it that may be read.
        limit: [s] of wall time for a command.
        environment: variables for the commands.
    """

    folder: Folder
    packages: tuple[Path, ...] = ()
    limit: float = 600.0
    environment: Mapping[str, str] = field(default_factory=dict)

    @property
    def package_options(self) -> list[str]:
        """Options of a command that name the folders of packages."""
        return [f"--package-path={path}" for path in self.packages]

    async def start(self, words: Sequence[str]) -> asyncio.subprocess.Process:
        """Start `manipcli WORDS`; stderr is part of its stdout.

        Its stdin stays open as long as this process lives: when it is closed, the command ends.
        """
        root, packages = str(self.folder.root), [str(path) for path in self.packages]
        return await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "manipcli.mcp_server.confined", root, *packages, "--", *words),
            cwd=root,
            env={**os.environ, **self.environment},
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            start_new_session=True,
        )

    async def run(self, words: Sequence[str]) -> Output:
        """What a command prints.

        Raises:
            TimeoutError: it took longer than the limit.
        """
        process = await self.start(words)
        try:
            async with asyncio.timeout(self.limit):
                text = await bounded(process.stdout)
                return Output(await process.wait(), text)
        finally:
            await ended(process)


async def bounded(stream: asyncio.StreamReader | None) -> str:
    """All that a stream gives, at most `MAX_OUTPUT` characters."""
    assert stream is not None
    head, tail, size, half = b"", b"", 0, MAX_OUTPUT // 2
    while part := await stream.read(1 << 16):
        size += len(part)
        missing = half - len(head)
        head, rest = head + part[: max(missing, 0)], part[max(missing, 0) :]
        tail = (tail + rest)[-half:]
    left = size - len(head) - len(tail)
    between = f"\n... {left} characters are left out ...\n".encode() if left else b""
    return readable((head + between + tail).decode("utf-8", "replace"))


def readable(text: str) -> str:
    """An output without a traceback."""
    before, found, after = text.partition(_TRACEBACK)
    if not found:
        return text.strip()
    last = after.strip().rsplit("\n", 1)[-1]
    return f"{before}internal error: {last}".strip()


async def ended(process: asyncio.subprocess.Process) -> None:
    """Interrupt a process and those it started, and kill what does not end; also while its caller is cancelled."""
    import anyio

    if process.returncode is not None:
        return
    send_signal(process, signal.SIGINT)
    with anyio.move_on_after(GRACE, shield=True):
        await bounded(process.stdout)
        await process.wait()
    if process.returncode is None:
        send_signal(process, signal.SIGKILL)
        with anyio.CancelScope(shield=True):
            await process.wait()


def send_signal(process: asyncio.subprocess.Process, number: signal.Signals) -> None:
    """Send a signal to a process and those it started."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
