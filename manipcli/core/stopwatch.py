"""How long something took that happens now and then."""

from __future__ import annotations

import time
from types import TracebackType


class Stopwatch:
    """Adds up the time [s] on the wall that is spent in its `with` blocks, however they end."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._began = 0.0

    def __enter__(self) -> None:
        self._began = time.perf_counter()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.seconds += time.perf_counter() - self._began
