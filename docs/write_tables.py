"""Writes the tables of docs/task.md, docs/robot.md and docs/controllers.md anew: the fields of the blocks of files.

A table stands below a line `<!-- fields of BLOCK -->`, or `<!-- fields of BLOCK beside OTHER -->` for those that the
other does not have; the blocks are models in `manipcli/spec/`. What is written around the tables stays.

python docs/write_tables.py
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from pydantic import BaseModel
from write_steps import table

from manipcli.spec import baseline, controllers, other_controllers, reactions, robot, task, vary

PAGES: Final = tuple(Path(__file__).with_name(name) for name in ("task.md", "robot.md", "controllers.md"))
_MODULES: Final = (task, robot, controllers, other_controllers, reactions, vary, baseline)
_TABLE: Final = re.compile(r"(<!-- fields of (\w+)(?: beside (\w+))? -->\n)(?:\|.*\n)*")


def renewed(page: str) -> str:
    """The text of a page with its tables as the models say."""

    def filled(found: re.Match[str]) -> str:
        mark, name, beside = found.groups()
        return f"{mark}{table(_model(name), beside=_model(beside) if beside else None)}\n"

    return _TABLE.sub(filled, page)


def _model(name: str) -> type[BaseModel]:
    found: type[BaseModel] = next(getattr(module, name) for module in _MODULES if hasattr(module, name))
    return found


if __name__ == "__main__":
    for path in PAGES:
        path.write_text(renewed(path.read_text(encoding="utf-8")), encoding="utf-8")
