"""Writes docs/reference/codes/: a page for each code, and their list.

python docs/scripts/write_codes.py
"""

from __future__ import annotations

from pathlib import Path

from manipcli.report.codes.code_page import code_pages, render_markdown

FOLDER = Path(__file__).parents[1] / "reference" / "codes"


def pages() -> dict[Path, str]:
    """The text of each file."""
    found = {FOLDER / f"{code}.md": render_markdown(page) for code, page in code_pages().items()}
    rows = "\n".join(f"| [{code}]({code}.md) | {page.title} |" for code, page in code_pages().items())
    head = (
        "# Codes of findings\n\n`manipcli explain CODE` prints a page of this list.\n\n| code | finding |\n|---|---|\n"
    )
    return {**found, FOLDER / "README.md": f"{head}{rows}\n"}


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for old in FOLDER.glob("*.md"):
        old.unlink()
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
