"""Import of heavy libraries before the stages that use them."""

from __future__ import annotations

from importlib import import_module

from manipcli.plan import retimer
from manipcli.simulate.engines import ENGINES
from manipcli.task.task import Task
from manipcli.task.vocabulary import controllers_spec, task_spec

COMMON = ("coal", "pinocchio", "ruckig", "mcap.records", "mcap.opcode", "zstandard")
"""Libraries that every run uses."""


def load_libraries(task: Task) -> None:
    """Import the libraries that later stages import lazily, so that import time counts as loading."""
    for name in COMMON:
        import_module(name)
    retimer.library()
    load_engine(task.spec.simulation.engine)


def load_engine(name: str) -> None:
    """Import the library of an engine.

    Raises:
        KeyError: there is no engine of this name.
        Exception: of an import that fails.
    """
    ENGINES[name].prepare()


def load_common() -> None:
    """Import what most runs import, apart from the library of the engine, and build the models of the files."""
    for name in (*COMMON, "manipcli.description.xacro.expand"):
        import_module(name)
    retimer.library()
    task_spec()
    controllers_spec()
