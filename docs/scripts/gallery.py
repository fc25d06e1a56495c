"""Writes docs/gallery.md and its pictures: every task and example, from the logs of their runs.

python docs/scripts/gallery.py [--logs DIR] [NAME...]

A log that is missing in DIR [default: runs/gallery] is made by running the task. With names, only these entries get
a new picture and verdict; the other sections keep theirs. Everything else on the page comes from the files.
"""

from __future__ import annotations

import argparse
import io
import itertools
import json
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent
PAGE, PICTURES = DOCS / "gallery.md", DOCS / "gallery"
LINES = 10
"""Lines of YAML in a section."""
SIZE, MOST = (480, 360), 40_000
"""Of a picture [pixel], and its largest size [byte]."""
COLUMNS = 4
"""Of the index."""
HEAD = """# Gallery

Every task of [tasks](../tasks) and every example of [examples](../examples/README.md): what it does, a picture from
the log of its run, its most telling lines, and its verdict. `manipcli run FILE` runs one;
`python docs/scripts/gallery.py` runs them all and writes this page."""


@dataclass(frozen=True, slots=True)
class Look:
    """What a section shows.

    Attributes:
        first: the key at which its lines begin.
        step: whose motion the picture shows; "": the end of the run.
        share: of the duration of this step, at which the picture is taken.
        view: of the picture, as `replay --view`.
    """

    first: str = "steps"
    step: str = ""
    share: float = 1.0
    view: str = "iso"


LOOKS: Mapping[str, Look] = {
    "carry": Look(step="place_1", share=0.4),
    "clutter": Look(step="pick_1", share=0.9, view="205,20"),
    "dial": Look(step="turn_1", share=0.6),
    "door": Look(step="open_1", share=0.85),
    "drawer": Look(step="place_1", share=0.5, view="150,30"),
    "granular_pour": Look(step="pour_1", share=0.55),
    "home": Look(step="follow_1", share=0.5),
    "peg": Look(step="insert_1", share=0.6),
    "pick_place": Look(step="place_1", share=0.4),
    "pour": Look(step="pour_1", share=0.55),
    "pour_between": Look(step="pour_1", share=0.55),
    "pour_handle": Look(first="cup", step="pick_1", share=0.9),
    "pour_iiwa": Look(step="pour_1", share=0.55),
    "pour_into_mug": Look(step="pour_1", share=0.55),
    "pour_seen": Look(step="locate_1"),
    "press": Look(step="hold", share=0.5),
    "push": Look(step="push_1", share=0.7),
    "sort": Look(step="place_3", share=0.6),
    "sort_many": Look(first="repeat", step="sort[9]/raise"),
    "stack": Look(step="place_3", share=0.7),
    "01_first_task": Look(step="move_1", share=0.6),
    "02_pick_a_block": Look(step="place_1", share=0.7),
    "03_ros_trajectory": Look(step="follow_1", share=0.5),
    "04_own_robot": Look(step="across", share=0.3),
    "05_python_api": Look(first="task", step="pour_1", share=0.55, view="60,25"),
    "06_failure": Look(step="lift_1"),
    "07_differential_wrist": Look(step="right"),
    "08_four_bar_finger": Look(step="curl", share=0.95),
    "09_continuous_integration": Look(first="- run", step="lift_1"),
    "10_stack": Look(step="place_3", share=0.7),
    "11_by_feel": Look(step="feel"),
    "12_choices": Look(step="sort[1]/lift_1"),
    "13_live": Look(first="action", step="lift@2"),
    "14_sensors": Look(first="fingertip", step="lift_1"),
    "15_camera": Look(first="kinect", step="lift_1", share=0.8),
    "16_force_control": Look(step="press", share=0.5),
    "17_slip": Look(first="left_tip", step="push"),
}
"""By name of the entry; others show their steps, and the world at the end."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A task or an example.

    Attributes:
        name: of the file, or of the example's folder.
        file: whose lines are shown.
        task: that is run; None for an example in Python, which is run itself.
        script: of an example in Python.
    """

    name: str
    file: Path
    task: Path | None = None
    script: Path | None = None

    @property
    def look(self) -> Look:
        return LOOKS.get(self.name, Look())

    @property
    def page(self) -> Path:
        """What its heading links to."""
        return self.file if self.file.parent == ROOT / "tasks" else self.file.parent / "README.md"

    @property
    def summary(self) -> str:
        """The first sentence of its file, or of the README of an example without a task."""
        if self.file.suffix == ".yaml":
            comments = re.match(r"(?:#.*\n)+", self.file.read_text(encoding="utf-8"))
            text = " ".join(line.lstrip("# ") for line in comments.group().splitlines()) if comments else ""
        else:
            text = " ".join(self.page.read_text(encoding="utf-8").split("\n\n")[1].split())
        return re.split(r"(?<=\.)\s", text, maxsplit=1)[0]

    @property
    def lines(self) -> list[str]:
        """Its telling lines: at most `LINES` from the key of its `look` on, without comments, until one is outside."""
        every = self.file.read_text(encoding="utf-8").splitlines()
        every = [line for line in every if line.strip() and not line.lstrip().startswith("#")]
        key = re.compile(rf"\s*(- )*{re.escape(self.look.first)}\b")
        start = next(k for k, line in enumerate(every) if key.match(line))
        depth = _depth(every[start])
        inside = itertools.takewhile(lambda line: _depth(line) >= depth, every[start : start + LINES])
        return textwrap.dedent("\n".join(inside)).splitlines()


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())


def entries() -> list[Entry]:
    """All tasks, then all examples, in the order of their names."""
    found = [Entry(path.stem, path, task=path) for path in sorted((ROOT / "tasks").glob("*.yaml"))]
    for folder in sorted(path for path in (ROOT / "examples").iterdir() if path.is_dir()):
        task, scripts, others = folder / "task.yaml", [*folder.glob("*.py")], [*folder.glob("*.yml")]
        if task.exists():
            found.append(Entry(folder.name, task, task=task))
        elif scripts:
            found.append(Entry(folder.name, scripts[0], script=scripts[0]))
        else:  # a workflow: it runs the task of another example
            found.append(Entry(folder.name, others[0], task=ROOT / _task_of(folder)))
    return found


def _task_of(folder: Path) -> str:
    """The task that the command of an example without a task file runs."""
    command = re.search(r"manipcli \w+ (examples/\w+)", (folder / "README.md").read_text(encoding="utf-8"))
    assert command is not None
    return f"{command.group(1)}/task.yaml"


def page(verdicts: Mapping[str, str]) -> str:
    """The page, with the verdict of each entry by name."""
    every = entries()
    named = {"Tasks": [e for e in every if not _example(e)], "Examples": [e for e in every if _example(e)]}
    index = "\n\n".join(f"**{title}**\n\n{_index(group)}" for title, group in named.items())
    sections = [f"## {title}\n\n{_sections(group, verdicts)}" for title, group in named.items()]
    return "\n\n".join([HEAD, index, *sections]) + "\n"


def _example(entry: Entry) -> bool:
    return entry.file.parent.name != "tasks"


def _index(group: Sequence[Entry]) -> str:
    rows = [group[k : k + COLUMNS] for k in range(0, len(group), COLUMNS)]
    cells = [[f"[![{e.name}](gallery/{e.name}.webp)](#{e.name})<br>[{e.name}](#{e.name})" for e in row] for row in rows]
    lines = [f"| {' | '.join(row + [''] * (COLUMNS - len(row)))} |" for row in cells]
    return "\n".join([lines[0], f"|{'---|' * COLUMNS}", *lines[1:]])


def _sections(group: Iterable[Entry], verdicts: Mapping[str, str]) -> str:
    return "\n\n".join(section(entry, verdicts[entry.name]) for entry in group)


def section(entry: Entry, verdict: str) -> str:
    """The section of one entry."""
    link = _relative(entry.file)
    kind = {".py": "python"}.get(entry.file.suffix, "yaml")
    lines = "\n".join(entry.lines)
    more = f" ([README]({_relative(entry.page)}))" if _example(entry) else ""
    return (
        f"### {entry.name}\n\n{entry.summary} [{link.removeprefix('../')}]({link}){more}\n\n"
        f"![{entry.name}](gallery/{entry.name}.webp)\n\n```{kind}\n{lines}\n```\n\n```text\n{verdict}\n```"
    )


def _relative(path: Path) -> str:
    return f"../{path.relative_to(ROOT).as_posix()}"


def verdict_line(verdict: Mapping[str, Any]) -> str:
    """The line of the verdict, as `run` prints it; of a live session, which is no run of its task, its steps.

    Args:
        verdict: the object of `judge --format json`.
    """
    if "live session" in verdict["text"]:
        steps = [f"{step['id']} {step['outcome']}" for step in verdict["steps"] if "@" in step["id"]]
        return f"{verdict['task']}, live session: {', '.join(steps)}"
    mark = "✓" if verdict["verdict"] == "passed" else "✗"
    return f"{mark} {verdict['task']} {verdict['verdict']}: {verdict['text']}"


def shown_verdicts(text: str) -> dict[str, str]:
    """The verdict of each section of a page."""
    found = re.findall(r"^### (\w+)$.*?^```text\n(.*?)\n```$", text, flags=re.DOTALL | re.MULTILINE)
    return dict(found)


def log_of(entry: Entry, logs: Path) -> Path:
    """The log of an entry, from a run if it is missing."""
    log = logs / f"{entry.name}.mcap"
    if log.exists():
        return log
    logs.mkdir(parents=True, exist_ok=True)
    if entry.task is not None:
        _call("manipcli", "run", str(entry.task), "--log", str(log), "--quiet", codes=(0, 1))
        return log
    with tempfile.TemporaryDirectory() as folder:
        _call(str(entry.script), cwd=Path(folder))
        (made,) = Path(folder).glob("runs/*.mcap")
        shutil.move(made, log)
    return log


def _call(*words: str, codes: Sequence[int] = (0,), cwd: Path = ROOT) -> str:
    """The output of a Python program: a script, or `-m` a module."""
    command = [sys.executable, *(("-m",) if words[0] == "manipcli" else ()), *words]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode not in codes:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def draw(entry: Entry, log: Path, verdict: Mapping[str, Any]) -> None:
    """The picture of an entry, as small as needed; `verdict` as of `verdict_line`."""
    look = entry.look
    at = str(verdict["simulated_time"])
    if look.step:
        step = next(step for step in verdict["steps"] if step["id"] == look.step)
        at = f"{step['started'] + look.share * (step['ended'] - step['started']):.3f}"
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        size = "x".join(map(str, SIZE))
        _call(
            "manipcli", "replay", str(log), "--picture", str(picture), "--at", at, "--size", size, "--view", look.view
        )
        with Image.open(picture) as drawn:
            small = next(data for data in _encoded(drawn.convert("RGB")) if len(data) <= MOST)
    PICTURES.mkdir(exist_ok=True)
    (PICTURES / f"{entry.name}.webp").write_bytes(small)


def _encoded(picture: Image.Image) -> Iterator[bytes]:
    for quality in (85, 75, 65, 50, 30):
        data = io.BytesIO()
        picture.save(data, "webp", quality=quality, method=6)
        yield data.getvalue()


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/gallery.md and its pictures.")
    parser.add_argument("names", nargs="*", help="entries with a new picture and verdict [default: all]")
    parser.add_argument("--logs", type=Path, default=ROOT / "runs" / "gallery", help="folder of the logs")
    arguments = parser.parse_args()
    verdicts = shown_verdicts(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else {}
    for entry in entries():
        if arguments.names and entry.name not in arguments.names:
            continue
        log = log_of(entry, arguments.logs.resolve())
        judged = json.loads(_call("manipcli", "judge", str(log), "--format", "json", codes=(0, 1)))
        verdicts[entry.name] = verdict_line(judged)
        draw(entry, log, judged)
        print(f"{entry.name}: {verdicts[entry.name]}")
    PAGE.write_text(page(verdicts), encoding="utf-8")


if __name__ == "__main__":
    main()
