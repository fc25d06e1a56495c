"""File locks, held while a process has the file open."""

from __future__ import annotations

import errno
from fcntl import LOCK_EX, LOCK_NB, LOCK_SH, flock
from typing import Final

UNSUPPORTED: Final = frozenset({errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP})
"""Errors of file systems without locks, such as some network and container mounts."""


class Taken(Exception):
    """Another process holds the lock."""


def lock(descriptor: int, *, shared: bool = False) -> None:
    """Locks an open file without waiting; always succeeds on a file system without locks.

    Args:
        descriptor: descriptor of the file.
        shared: take a shared lock instead of an exclusive one.

    Raises:
        Taken: another process holds the lock.
        OSError: locking fails for any other reason.
    """
    try:
        flock(descriptor, (LOCK_SH if shared else LOCK_EX) | LOCK_NB)
    except BlockingIOError:  # EWOULDBLOCK, EAGAIN
        raise Taken from None
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise
