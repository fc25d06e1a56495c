"""python -m benchmarks.engines [PART ...]: measures both engines and renews docs/explanation/engines.md.

Its tables and figures are renewed, the text around them stays. The parts are `laws`, `vice`, `cup`, `cost` and
`tasks`; all without one. Each table is between `<!-- begin of PART -->` and `<!-- end of PART -->`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.engines import pictures
from benchmarks.engines.cost import cost_rows
from benchmarks.engines.grasps import MUJOCO, PYBULLET, cup_rows, vice_rows
from benchmarks.engines.laws import law_rows, laws
from benchmarks.engines.tasks import task_rows
from benchmarks.engines.worlds import NAMES

PAGE: Final = pictures.DOCS / "explanation" / "engines.md"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """In Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def _laws() -> str:
    pictures.drop_picture()
    return table(["what", *NAMES.values()], law_rows([laws(name) for name in NAMES]))


def _vice() -> str:
    pictures.vice_picture()
    return table(["cube", *(variant.label for variant in (*PYBULLET, MUJOCO))], vice_rows())


def _cup() -> str:
    with TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        rows, hard = cup_rows(Path(folder))
    pictures.slip_picture(hard)
    return table(["pour", "grip force", "slip", "slip of a cup of 300 g, friction 0.5"], rows)


def _cost() -> str:
    return table(["processor time", *NAMES.values()], cost_rows())


def _tasks() -> str:
    rows, summary = task_rows()
    return f"{table(['task', 'number', *NAMES.values()], rows)}\n\n{summary}"


PARTS: Final[dict[str, Callable[[], str]]] = {
    "laws": _laws,
    "vice": _vice,
    "cup": _cup,
    "cost": _cost,
    "tasks": _tasks,
}


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engines", description=__doc__.partition(":")[2])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)} [default: all]")
    chosen = parser.parse_args().parts or list(PARTS)
    if unknown := set(chosen) - set(PARTS):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; expected {', '.join(PARTS)}")
    for part in chosen:
        text = PARTS[part]()
        page = PAGE.read_text(encoding="utf-8")
        block = re.compile(rf"(<!-- begin of {part} -->\n).*?(<!-- end of {part} -->)", re.DOTALL)
        page, count = block.subn(lambda found: f"{found[1]}{text}\n{found[2]}", page)  # noqa: B023
        if count != 1:
            parser.error(f"{PAGE.name} needs one block `<!-- begin of {part} -->`, and has {count}")
        PAGE.write_text(page, encoding="utf-8")
        print(f"{part}: done", flush=True)


if __name__ == "__main__":
    main()
