"""Import of heavy libraries before the stages that use them."""

from __future__ import annotations

from importlib import import_module

from manipcli.plan import retimer
from manipcli.simulate.engines import ENGINES
from manipcli.task.task import Task


def load_libraries(task: Task) -> None:
    """Import the libraries that later stages import lazily, so that import time counts as loading."""
    for name in ("coal", "pinocchio", "ruckig", "mcap.records", "mcap.opcode", "zstandard"):
        import_module(name)
    retimer.library()
    ENGINES[task.spec.simulation.engine].prepare()
