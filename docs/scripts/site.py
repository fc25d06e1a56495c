"""Builds the site from docs/: python docs/scripts/site.py OUT

OUT must not exist, or be a site of before. The build fails on a dead link or anchor, and on anything that a page would
load from another host. Files outside docs/ that pages link to, such as examples, become pages below `files/`. The
menu has the pages of each part in the order in which the README.md of the part names them.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Final
from urllib.parse import unquote, urlsplit

import links

ROOT: Final = Path(__file__).resolve().parents[2]
DOCS: Final = ROOT / "docs"
PARTS: Final = {
    "Tutorial": "tutorial",
    "How-to": "how-to",
    "Reference": "reference",
    "Explanation": "explanation",
}
FILES: Final = "files"
_TEXT: Final = {".yaml": "yaml", ".py": "python", ".xacro": "xml", ".urdf": "xml", ".xml": "xml", ".toml": "toml"}
WORKER: Final = Path(__file__).with_name("file_worker.js")
STYLE: Final = Path(__file__).with_name("site.css")
_SHIM: Final = "https://unpkg.com/iframe-worker/shim"
_COLOUR: Final = re.compile(r"\x1b\[[0-9;]*m")


def build(out: Path) -> list[str]:
    """Builds the site into a folder, and returns a line for each fault."""
    with TemporaryDirectory() as name:
        work = Path(name)
        _stage(work / "docs")
        config = (ROOT / "zensical.toml").read_text(encoding="utf-8")
        (work / "zensical.toml").write_text(config.replace("nav = []", f"nav = {_toml(menu())}"), encoding="utf-8")
        zensical = Path(sys.executable).with_name("zensical")
        done = subprocess.run([zensical, "build", "--strict"], cwd=work, capture_output=True, text=True, check=False)
        if done.returncode:
            return [_COLOUR.sub("", done.stdout + done.stderr).partition("Traceback")[0]]
        if out.exists():
            shutil.rmtree(out)
        shutil.move(work / "site", out)
    _take_worker_from_here(out)
    return faults(out)


def _take_worker_from_here(site: Path) -> None:
    """Zensical's pages load what lets search run without a server from another host; ours comes with the site."""
    shutil.copy(WORKER, site / "assets" / "javascripts")
    for page in site.rglob("*.html"):
        up = "../" * (len(page.relative_to(site).parts) - 1)
        text = page.read_text(encoding="utf-8")
        page.write_text(text.replace(_SHIM, f"{up}assets/javascripts/{WORKER.name}"), encoding="utf-8")


def menu() -> list[object]:
    """The `nav` of the site."""
    parts = [{title: pages} for title, folder in PARTS.items() if (pages := _pages(folder))]
    gallery = [{"Gallery": "gallery.md"}] if (DOCS / "gallery.md").exists() else []
    return [{"Home": "index.md"}, *parts, *gallery]


def _pages(folder: str) -> list[object]:
    """README.md of a part, then the pages of the part that it links to, in a group for each of its headings.

    Without README.md, its pages by name.
    """
    readme = DOCS / folder / "README.md"
    if not readme.exists():
        return [f"{folder}/{page.name}" for page in sorted((DOCS / folder).glob("*.md"))]
    top, *sections = re.split(r"^## +", readme.read_text(encoding="utf-8"), flags=re.MULTILINE)
    pages: list[object] = [f"{folder}/README.md", *_linked(top, folder)]
    for section in sections:
        if found := _linked(section, folder):
            pages.append({section.splitlines()[0].strip(): found})
    return pages


def _linked(text: str, folder: str) -> list[str]:
    paths = [path for _, path, _ in links.local_targets(text) if path.endswith(".md") and not path.startswith("..")]
    return [f"{folder}/{path}" for path in dict.fromkeys(paths)]


def _toml(value: object) -> str:
    return json.dumps(value, separators=(", ", " = "))


def _stage(target: Path) -> None:
    """Copies docs/, and below `files/` what its pages link to outside."""
    shutil.copytree(DOCS, target, ignore=shutil.ignore_patterns("scripts", "__pycache__"))
    shutil.copy(STYLE, target)
    waiting = [path.relative_to(target) for path in sorted(target.rglob("*.md"))]
    sources = {page: DOCS / page for page in waiting}
    while waiting:
        page = waiting.pop()
        source = sources[page]

        def change(link: str, page: Path = page, source: Path = source) -> str:
            path, mark, anchor = link.partition("#")
            outside = (source.parent / path).resolve()
            if not path or urlsplit(link).scheme or not outside.is_relative_to(ROOT):
                return link
            staged = _place(outside)
            if not outside.is_relative_to(DOCS) and staged not in sources:
                sources[staged] = _written(outside, target / staged)
                if staged.suffix == ".md":
                    waiting.append(staged)
            return os.path.relpath(staged, page.parent) + mark + anchor

        text = (target / page).read_text(encoding="utf-8")
        (target / page).write_text(links.relinked(text, change), encoding="utf-8")


def _place(path: Path) -> Path:
    """The place of a file or folder of the repository in the staged docs."""
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS) / ("README.md" if path.is_dir() else "")
    place = Path(FILES) / path.relative_to(ROOT)
    if path.is_dir():
        return place / "README.md"
    return place.with_name(f"{place.name}.md") if path.suffix in _TEXT else place


def _written(path: Path, place: Path) -> Path:
    """Writes the page of a file or folder, and returns the file whose folder its links begin in."""
    place.parent.mkdir(parents=True, exist_ok=True)
    title = path.relative_to(ROOT)
    if path.is_dir():
        readme = path / "README.md"
        text = f"{readme.read_text(encoding='utf-8')}\n" if readme.exists() else f"# {title}\n\n"
        found = sorted(child for child in path.iterdir() if child.name[0] not in "._" and child != readme)
        items = [f"- [{child.name}]({child.name})" if child.suffix in _TEXT else f"- {child.name}" for child in found]
        heading = "## Files\n\n" if readme.exists() else ""
        place.write_text(f"{text}{heading}" + "\n".join(items) + "\n", encoding="utf-8")
        return readme
    if path.suffix in _TEXT:
        code = path.read_text(encoding="utf-8")
        place.write_text(f"# {title}\n\n~~~~{_TEXT[path.suffix]}\n{code}~~~~\n", encoding="utf-8")
    else:
        shutil.copy(path, place)
    return path


class _Page(HTMLParser):
    """The ids of a page, its links, and what it loads."""

    def __init__(self) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: set[str] = set()
        self.loads: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value for name, value in attrs if value is not None}
        self.ids |= {values[name] for name in ("id", "name") if name in values}
        loads = tag not in ("a", "link") or (tag == "link" and values.get("rel") not in ("canonical", "next", "prev"))
        for name in ("href", "src"):
            if name in values:
                (self.loads if loads else self.links).add(values[name])


def faults(site: Path) -> list[str]:
    """A line for each link of a built page that leads nowhere, and for each load from another host."""
    pages = {}
    for path in sorted(site.rglob("*.html")):
        pages[path] = _Page()
        pages[path].feed(path.read_text(encoding="utf-8"))
    found = []
    for path, page in pages.items():
        name = PurePosixPath(path.relative_to(site))
        for target in sorted(page.links | page.loads):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                if target in page.loads and parts.scheme != "data":
                    found.append(f"{name}: loads {target}")
                continue
            # The page for a wrong address can be shown at any depth; its paths begin at the root.
            place = site / parts.path.lstrip("/") if parts.path.startswith("/") else path.parent / unquote(parts.path)
            place = path if not parts.path else place.resolve()
            place = place / "index.html" if place.is_dir() else place
            anchor = unquote(parts.fragment)
            if not place.exists():
                found.append(f"{name}: there is no {target}")
            elif anchor and place in pages and anchor not in pages[place].ids:
                found.append(f"{name}: {target} has no such anchor")
    return found


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = Path(sys.argv[1]).resolve()
    if folder.exists() and not (folder / "sitemap.xml").exists() and not (folder / "404.html").exists():
        sys.exit(f"{folder} exists and is not a site; name another folder")
    if wrong := build(folder):
        sys.exit("\n".join(wrong))
    print(f"{folder / 'index.html'}")
