"""The gallery has every task and example, with lines that their files have and the verdict that a run gives."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "gallery.md"
GALLERY = runpy.run_path(str(ROOT / "docs" / "scripts" / "gallery.py"), run_name="gallery")
ENTRIES = GALLERY["entries"]()
TOLD = "run `python docs/scripts/gallery.py` and look at the pictures"


def page() -> str:
    return PAGE.read_text(encoding="utf-8")


def test_the_entries_are_all_tasks_and_examples() -> None:
    tasks = {path.stem for path in (ROOT / "tasks").glob("*.yaml")}
    examples = {path.name for path in (ROOT / "examples").iterdir() if path.is_dir()}
    names = [entry.name for entry in ENTRIES]
    assert set(names) == tasks | examples
    assert len(names) == len(tasks) + len(examples)


def test_the_page_is_what_the_files_and_its_verdicts_give() -> None:
    verdicts = GALLERY["shown_verdicts"](page())
    assert verdicts.keys() == {entry.name for entry in ENTRIES}, TOLD
    assert page() == GALLERY["page"](verdicts), TOLD


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_its_lines_are_in_its_file(entry: Any) -> None:
    there = [line.strip() for line in entry.file.read_text(encoding="utf-8").splitlines()]
    shown = [line.strip() for line in entry.lines]
    assert 3 <= len(shown) <= GALLERY["LINES"]
    assert "\n".join(entry.lines) in page()
    first = there.index(shown[0])
    assert [line for line in there[first:] if line in shown][: len(shown)] == shown  # in their order


def test_each_picture_is_there_and_small() -> None:
    pictures = {path.stem: path for path in (ROOT / "docs" / "gallery").iterdir()}
    assert pictures.keys() == {entry.name for entry in ENTRIES}, TOLD
    for path in pictures.values():
        assert path.stat().st_size <= GALLERY["MOST"]
        with Image.open(path) as picture:
            assert picture.size == GALLERY["SIZE"]


@pytest.mark.slow
def test_a_run_gives_the_verdict_that_the_page_shows(pour_run: Any, call_cli: Any) -> None:
    judged = json.loads(call_cli("judge", pour_run.log, "--format", "json", cwd=ROOT).out)
    (entry,) = (entry for entry in ENTRIES if entry.name == "pour")
    assert GALLERY["section"](entry, GALLERY["verdict_line"](judged)) in page()


def test_a_live_session_is_told_by_its_steps() -> None:
    steps = [{"id": "pick_1", "outcome": "not_run"}, {"id": "pick@1", "outcome": "done"}]
    judged = {
        "task": "t",
        "verdict": "failed",
        "text": "x; live session, without the steps of the task",
        "steps": steps,
    }
    assert GALLERY["verdict_line"](judged) == "t, live session: pick@1 done"
