"""Files of a run in its own process: locked while the process lives, and removed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from manipcli.core.lock import Taken, lock


def locked(path: Path) -> BinaryIO:
    """Opens the file, empty and locked, as long as this process or a child that writes to it has it open.

    Raises:
        Taken: another process has locked it.
        OSError: it cannot be written.
    """
    while True:
        file = path.open("ab")
        try:
            lock(file.fileno())
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                file.truncate(0)
                return file
        except FileNotFoundError:
            pass
        except (Taken, OSError):
            file.close()
            raise
        file.close()  # its previous owner has removed it meanwhile


def remove(*files: Path | None) -> None:
    for file in files:
        if file is not None:
            file.unlink(missing_ok=True)
