"""The pages of the documentation that are installed with manipcli, and their addresses in messages.

An address works without a network: `manipcli docs task#vary`. MANIPCLI_DOCS_URL, the address of a built site, turns
addresses into those of its pages; a value that is not an address has no effect.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic

URL: Final = "MANIPCLI_DOCS_URL"
_PACKAGE: Final = Path(__file__).parents[1]
_SITE: Final = re.compile(r"(https?|file)://[!-~]+")
_FENCE: Final = re.compile(r"^ *(`{3,}|~{3,})[^\n]*\n.*?^ *\1 *$", re.MULTILINE | re.DOTALL)
_HEADING: Final = re.compile(r"^(#{1,6}) +(.*?)[ #]*$", re.MULTILINE)


def doc_pages() -> dict[str, Path]:
    """The pages by name, part by part: `task`; where several have the name `live`, that of the reference has it, and
    the others are `how-to/live`. A README.md has the name of its folder. Pages of codes are left out."""
    paths = {name.removesuffix(".md").removesuffix("/README"): path for name, path in doc_files().items()}
    times = Counter(name.rpartition("/")[2] for name in paths)

    def short(name: str) -> str:
        last = name.rpartition("/")[2]
        return last if times[last] == 1 or name == f"reference/{last}" else name

    return {short(name): path for name, path in paths.items()}


def doc_files() -> dict[str, Path]:
    """The files of the pages by their path below docs/."""
    folder = _folder()
    found = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*.md"))}
    return {name: path for name, path in found.items() if path.parent.name != "codes" or path.name == "README.md"}


def _folder() -> Path:
    """`docs` in the installed package; in a checkout next to it. It need not exist."""
    beside = _PACKAGE.parent / "docs"
    return beside if (_PACKAGE.parent / "hatch_build.py").exists() else _PACKAGE / "docs"


def title_of(page: str) -> str:
    """The first heading of a page."""
    found = _HEADING.search(page)
    return found[2] if found else ""


def section_of(page: str, anchor: str) -> str | None:
    """The part of a page under the heading with this anchor; None without such a heading."""
    shown = _FENCE.sub(lambda fence: re.sub(r"[^\n]", " ", fence[0]), page)
    headings = list(_HEADING.finditer(shown))
    for k, heading in enumerate(headings):
        if anchor_of(heading[2]) == anchor:
            ends = (other.start() for other in headings[k + 1 :] if len(other[1]) <= len(heading[1]))
            return page[heading.start() : next(ends, len(page))].rstrip()
    return None


def anchors_of(page: str) -> list[str]:
    """The anchors of the headings of a page, in order."""
    return [anchor_of(heading[2]) for heading in _HEADING.finditer(_FENCE.sub("", page))]


def anchor_of(heading: str) -> str:
    """The anchor of a heading, as code hosts make it: letters, digits, `-` and `_` in lower case, `-` for a blank."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    plain = re.sub(r"(?<!\w)[*_]+|[*_]+(?!\w)", "", plain)
    return re.sub(r"[^\w\- ]", "", plain).strip().lower().replace(" ", "-")


def address(name: str = "", *, subject: str = "") -> str:
    """Where a page is read: a command, or an address of the site; without a name the list of pages.

    Args:
        name: `page` or `page#anchor`.
        subject: what `manipcli docs` also takes for it; "" for the name.
    """
    base = _site()
    if base is None:
        return f"manipcli docs {subject or name}".rstrip()
    page, mark, anchor = name.partition("#")
    path = doc_pages().get(page, _folder() / "index.md")
    file = path.relative_to(_folder()).with_suffix(".html").as_posix()
    return f"{base}/{file.replace('README.html', 'index.html')}{mark}{anchor}"


def code_url(code: str) -> str | None:
    """The page of a code on the site of MANIPCLI_DOCS_URL; None without one."""
    base = _site()
    return None if base is None else f"{base}/reference/codes/{code}.html"


def _site() -> str | None:
    """The address in MANIPCLI_DOCS_URL without `/` at its end; None without one."""
    given = os.environ.get(URL, "").strip()
    return given.rstrip("/") if _SITE.fullmatch(given) else None


def more_about(findings: Sequence[Diagnostic]) -> str | None:
    """The line at the end of a list of findings that says where codes are explained; None where that adds nothing.

    It names the code of the first error, else of the first warning. Findings about the command line say all in their
    hint, and notes ask for nothing.
    """
    of_files = [finding for finding in findings if not finding.code.startswith(("USE", "INT"))]
    for severity in ("error", "warning"):
        for finding in of_files:
            if finding.severity == severity:
                return f"more about a code: {code_url(finding.code) or f'manipcli explain {finding.code}'}"
    return None
