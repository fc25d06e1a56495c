"""Garbage collection settings for a short-lived process."""

from __future__ import annotations

import atexit
import gc
from typing import Final

THRESHOLDS: Final = (50_000, 20, 50)
"""Instead of (700, 10, 10), since most objects of a command live until its end."""


def spare() -> None:
    """Makes garbage collection rare in this process, and disables it at exit.

    Repeated collection over long-lived modules takes 0.1 s of a run, and the final collection 0.2 s, for memory that
    the system reclaims anyway. Only for the process of a command: programs that import manipcli choose themselves.
    """
    gc.set_threshold(*THRESHOLDS)
    atexit.register(gc.freeze)
