"""Runs manipcli confined to a folder: `python -m manipcli.mcp_server.confined FOLDER PACKAGES... -- WORDS...`.

A task names other files (robot, controllers, includes, meshes). An audit hook of Python refuses to open those outside
of the folder, the folders of packages and Python's own, and to write anywhere but in `runs`, temporary files and the
cache. It guards what files can name; it is no sandbox for foreign code, which tasks cannot contain.

stdin is a pipe that the server holds open. When the server has ended, however it ended, the command is interrupted.
"""

from __future__ import annotations

import errno
import os
import runpy
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

LAST: Final = 30.0
"""[s] Longest end of a command whose server has ended; its log is finished and judged. Then it is killed."""
_WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CHANGES: Final = {
    **dict.fromkeys(("os.mkdir", "os.rmdir", "os.remove", "os.chmod", "os.chown", "os.truncate"), 1),
    **dict.fromkeys(("os.rename", "os.link", "os.symlink"), 2),
}
"""Audit events that change files, and how many of their arguments are paths."""
_SYSTEM: Final = ("/usr", "/lib", "/lib64", "/opt", "/proc", "/sys", "/dev", "/etc/ld.so.cache", "/etc/localtime")


def main(words: Sequence[str]) -> None:
    """Run manipcli with the words after `--`."""
    _watch_server()
    end = words.index("--")
    folder, *packages = words[:end]
    cache = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    written = [Path(folder, "runs"), Path(tempfile.gettempdir()), Path(cache, "manipcli"), Path(os.devnull)]
    python = [Path(path) for path in (sys.prefix, sys.base_prefix, *sys.path, os.__file__) if path]
    named = [Path(path) for path in (folder, *packages, *_SYSTEM)]
    sys.addaudithook(_hook([*written, *python, *named], written))
    sys.argv = ["manipcli", *words[end + 1 :]]
    runpy.run_module("manipcli", run_name="__main__", alter_sys=True)


def _watch_server() -> None:
    """Watch stdin in a thread; for the command it is empty."""
    pipe = os.dup(0)
    with open(os.devnull, "rb") as empty:
        os.dup2(empty.fileno(), 0)
    threading.Thread(target=_end_with, args=(pipe,), name="server", daemon=True).start()


def _end_with(pipe: int) -> None:
    """Interrupt this process when a pipe is closed, and kill it with those it started if it does not end."""
    while os.read(pipe, 1):
        pass
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(LAST)
    with suppress(ProcessLookupError):
        os.killpg(os.getpid(), signal.SIGKILL)


def _hook(read: Sequence[Path], written: Sequence[Path]) -> Callable[[str, tuple[Any, ...]], None]:
    """An audit hook that refuses files that are not below these folders."""
    readable, writable = (tuple(path.resolve() for path in paths) for paths in (read, written))

    @lru_cache(maxsize=10000)
    def allowed(name: str, *, writes: bool) -> bool:
        real = Path(name).resolve()
        return any(real.is_relative_to(root) for root in (writable if writes else readable))

    def check(path: object, *, writes: bool) -> None:
        if isinstance(path, int) or path is None:
            return
        name = os.fsdecode(path)  # type: ignore[arg-type]
        if not allowed(name, writes=writes):
            reason = "files are written to 'runs' only" if writes else "it is outside of the folder of this server"
            raise PermissionError(errno.EACCES, reason, name)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = arguments
            writes = bool(isinstance(flags, int) and flags & _WRITES) or bool(mode and set(mode) & set("wax+"))
            check(path, writes=writes)
        elif event in _CHANGES:
            for path in arguments[: _CHANGES[event]]:
                check(path, writes=True)
        elif event in ("os.listdir", "os.scandir"):
            check(arguments[0], writes=False)

    return hook


if __name__ == "__main__":
    main(sys.argv[1:])
