"""A file for one process alone, as long as that has it open."""

from __future__ import annotations

import errno
from fcntl import LOCK_EX, LOCK_NB, LOCK_SH, flock
from typing import Final

UNSUPPORTED: Final = frozenset({errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP})
"""What a file system says that knows no locks, as some of networks and containers."""


class Taken(Exception):
    """Another process has the file."""


def lock(descriptor: int, *, shared: bool = False) -> None:
    """Takes an open file without waiting for it; on a file system that knows no locks everybody gets it.

    Args:
        descriptor: of the file.
        shared: with others that share it, too.

    Raises:
        Taken: another process has it.
        OSError: it cannot be locked for any other reason.
    """
    try:
        flock(descriptor, (LOCK_SH if shared else LOCK_EX) | LOCK_NB)
    except BlockingIOError:  # EWOULDBLOCK, EAGAIN
        raise Taken from None
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise
