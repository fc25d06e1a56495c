"""The garbage collector in a process that does one thing and ends."""

from __future__ import annotations

import atexit
import gc
from typing import Final

THRESHOLDS: Final = (50_000, 20, 50)
"""Instead of (700, 10, 10): what a command imports and builds stays until its end."""


def spare() -> None:
    """Collect seldom from now on, and not at the end.

    Looking again and again through modules that stay takes 0.1 s of a run, and looking once more through all of
    them when the interpreter ends 0.2 s, for memory that the system takes back anyway. For the process of a command
    alone: whoever imports manipcli decides for himself.
    """
    gc.set_threshold(*THRESHOLDS)
    atexit.register(gc.freeze)
