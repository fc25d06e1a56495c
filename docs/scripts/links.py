"""Links and anchors of Markdown pages, as code hosts read them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

_FENCE: Final = r"^ *(`{3,}|~{3,})[^\n]*\n.*?^ *\1 *$"
_CODE: Final = re.compile(rf"{_FENCE}|(`+)[^`].*?\2|<!--.*?-->", re.MULTILINE | re.DOTALL)
"""Fences, code between backticks, and comments: nothing there is a link."""
_TITLE: Final = r"(?: +\"[^\"]*\")?"
_LINK: Final = re.compile(
    rf"\]\((?P<inline><[^>\n]*>|[^()\s]*){_TITLE}\)|^\[[^\]]+\]: *(?P<reference>\S+)", re.MULTILINE
)
_TAG: Final = re.compile(r"<(?:a|img)\b[^>]*?\b(?:href|src)=\"(?P<tag>[^\"]*)\"")
_HEADING: Final = re.compile(r"^#{1,6} +(.*?)[ #]*$", re.MULTILINE)
_ID: Final = re.compile(r"<\w+\b[^>]*\b(?:id|name)=\"([^\"]+)\"")
_ELSEWHERE: Final = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def without_code(page: str) -> str:
    """The text of a page, of the same length, with blanks for its code and comments."""
    return _CODE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), page)


def links(page: str) -> Iterator[re.Match[str]]:
    """The links and pictures of a page; the last group of each is its target."""
    text = without_code(page)
    yield from _LINK.finditer(text)
    yield from _TAG.finditer(text)


def relinked(page: str, change: Callable[[str], str]) -> str:
    """The text of a page with the target of each link as `change` gives it."""
    for found in sorted(links(page), key=lambda found: found.start(), reverse=True):
        group = str(found.lastgroup)
        page = page[: found.start(group)] + change(found[group]) + page[found.end(group) :]
    return page


def local_targets(page: str) -> Iterator[tuple[int, str, str]]:
    """(line, path, anchor) of each link that leads to a file or to a heading; an absent path or anchor is ""."""
    for found in links(page):
        target = str(found[str(found.lastgroup)]).strip("<>")
        if not _ELSEWHERE.match(target):
            path, _, anchor = target.partition("#")
            yield page.count("\n", 0, found.start()) + 1, path, anchor


def anchors(page: str) -> set[str]:
    """What links may name after `#`: the headings of a page and its HTML ids."""
    text = re.sub(_FENCE, "", page, flags=re.MULTILINE | re.DOTALL)
    found: set[str] = set(_ID.findall(text))
    for heading in _HEADING.findall(text):
        slug = slug_of(heading)
        number = next(k for k in range(len(found) + 1) if (f"{slug}-{k}" if k else slug) not in found)
        found.add(f"{slug}-{number}" if number else slug)
    return found


def slug_of(heading: str) -> str:
    """The anchor of a heading: its letters, digits, `-` and `_` in lower case, and `-` for each blank."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    plain = re.sub(r"(?<!\w)[*_]+|[*_]+(?!\w)", "", plain)
    return re.sub(r"[^\w\- ]", "", plain).strip().lower().replace(" ", "-")


def faults(page: Path) -> list[str]:
    """A line for each link of a page that leads nowhere."""
    text = page.read_text(encoding="utf-8")
    found = []
    for line, path, anchor in local_targets(text):
        target = (page.parent / path).resolve() if path else page
        if not target.exists():
            found.append(f"{page}:{line}: there is no {path}")
        elif anchor and target.suffix == ".md" and anchor not in anchors(target.read_text(encoding="utf-8")):
            found.append(f"{page}:{line}: {path or page.name} has no heading #{anchor}")
    return found
