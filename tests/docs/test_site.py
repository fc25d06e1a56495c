"""The site has every page, and its check finds dead links and what comes from another host; .ci/run builds it."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS / "scripts")
    spec = importlib.util.spec_from_file_location("docs_site", DOCS / "scripts" / "site.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_menu_has_every_page_but_those_of_codes(site: ModuleType) -> None:
    def pages(entry: Any) -> list[str]:
        if isinstance(entry, str):
            return [entry]
        return [page for child in (entry.values() if isinstance(entry, dict) else entry) for page in pages(child)]

    there = {str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md")}
    codes = {name for name in there if name.startswith("reference/codes/")}
    shown = pages(site.menu())
    assert set(shown) == there - codes | {"reference/codes/README.md"}
    assert len(shown) == len(set(shown))


def test_what_pages_link_to_outside_the_docs_gets_a_page(site: ModuleType, tmp_path: Path) -> None:
    site._stage(tmp_path / "docs")
    task = (tmp_path / "docs" / "files" / "tasks" / "pour.yaml.md").read_text(encoding="utf-8")
    assert (DOCS.parent / "tasks" / "pour.yaml").read_text(encoding="utf-8") in task
    page = (tmp_path / "docs" / "reference" / "task.md").read_text(encoding="utf-8")
    assert "(../files/tasks/pour.yaml.md)" in page and "../../tasks" not in page


@pytest.mark.parametrize(
    ("html", "fault"),
    [
        (
            '<a href="b.html#there">b</a> <a href="https://example.com">c</a> <img src="data:,">',
            None,
        ),
        ('<a href="c.html">c</a>', "a.html: there is no c.html"),
        ('<a href="b.html#nowhere">b</a>', "a.html: b.html#nowhere has no such anchor"),
        ('<img src="c.png">', "a.html: there is no c.png"),
        ('<script src="https://example.com/a.js"></script>', "a.html: loads https://example.com/a.js"),
        ('<link rel="stylesheet" href="//example.com/a.css">', "a.html: loads //example.com/a.css"),
    ],
)
def test_its_check_finds(site: ModuleType, html: str, fault: str | None, tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(html)
    (tmp_path / "b.html").write_text('<h1 id="there">b</h1>')
    assert site.faults(tmp_path) == ([fault] if fault else [])


def test_the_menu_is_written_as_toml(site: ModuleType) -> None:
    import tomllib

    menu = [{"Home": "index.md"}, {"Part": ["a.md", {"Group": ["b.md"]}]}]
    assert tomllib.loads(f"nav = {site._toml(menu)}")["nav"] == json.loads(json.dumps(menu))
