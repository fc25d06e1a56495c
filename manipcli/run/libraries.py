"""Heavy libraries, imported before the stages that use them."""

from __future__ import annotations

from importlib import import_module

from manipcli.plan import retimer
from manipcli.simulate.engines import ENGINES
from manipcli.task.task import Task


def load_libraries(task: Task) -> None:
    """Import what later stages import at their first use, so that import time counts as loading."""
    for name in ("coal", "pinocchio", "ruckig", "mcap.records", "mcap.opcode", "zstandard"):
        import_module(name)
    retimer.library()
    ENGINES[task.spec.simulation.engine].prepare()
