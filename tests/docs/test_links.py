"""Links of Markdown pages lead to files and headings that exist, and each page of the docs can be reached."""

from __future__ import annotations

import os
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
LINKS = runpy.run_path(str(DOCS / "scripts" / "links.py"))
FOLDERS = ("docs", "examples", "robots", "tasks", "controllers", "benchmarks")
PAGES = [*sorted(ROOT.glob("*.md")), *(path for name in FOLDERS for path in sorted((ROOT / name).rglob("*.md")))]


def test_no_link_is_dead() -> None:
    # Far more than 500, so the pages are found.
    assert sum(1 for page in PAGES for _ in LINKS["links"](page.read_text(encoding="utf-8"))) > 500
    assert [fault for page in PAGES for fault in LINKS["faults"](page)] == []


def test_every_page_of_the_docs_is_linked_from_the_readme_of_its_folder() -> None:
    for readme in sorted(DOCS.rglob("README.md")):
        linked = {path for _, path, _ in LINKS["local_targets"](readme.read_text(encoding="utf-8"))}
        there = {page.name for page in readme.parent.glob("*.md")} - {"README.md"}
        assert sorted(there - linked) == [], f"{readme} does not link to them"


@pytest.mark.parametrize(
    ("page", "fault"),
    [
        ("see [other](other.md#a-heading), ![picture](other.md) and [here](#here)\n\n## Here", None),
        ("see [other](nowhere.md)", "page.md:1: there is no nowhere.md"),
        ("\n![picture](nowhere.png)", "page.md:2: there is no nowhere.png"),
        ('<img src="nowhere.png">', "page.md:1: there is no nowhere.png"),
        ("[other]: nowhere.md", "page.md:1: there is no nowhere.md"),
        ("see [other](other.md#no-heading)", "page.md:1: other.md has no heading #no-heading"),
        ("see [here](#there)\n\n## Here", "page.md:1: page.md has no heading #there"),
        ("```\n# There\n[other](nowhere.md)\n```\n`[other](nowhere.md)` <!-- [other](nowhere.md) -->", None),
        ("[host](https://example.com/nowhere.md)", None),
    ],
)
def test_a_dead_link_is_found(page: str, fault: str | None, tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# A *heading*\n")
    (tmp_path / "page.md").write_text(page)
    found = LINKS["faults"](tmp_path / "page.md")
    assert [line.removeprefix(f"{tmp_path}{os.sep}") for line in found] == ([fault] if fault else [])


@pytest.mark.parametrize(
    ("heading", "anchor"),
    [
        ("Measured, believed, true", "measured-believed-true"),
        ("`--set` and [more](page.md#x)", "--set-and-more"),
        ("tool_speed", "tool_speed"),
        ("Where & when", "where--when"),
        ("*Bold* words", "bold-words"),
    ],
)
def test_an_anchor_is_that_of_code_hosts(heading: str, anchor: str) -> None:
    assert LINKS["slug_of"](heading) == anchor
    assert LINKS["anchors"](f"# {heading}\n\n## {heading}\n") == {anchor, f"{anchor}-1"}
