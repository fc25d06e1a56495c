"""`manipcli docs [PAGE]`: a page of the documentation."""

from __future__ import annotations

import re
from typing import Annotated, Final

import typer

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

_CODE: Final = re.compile(r"[A-Z]+[0-9]{3}")


def docs(
    page: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PAGE]", help="Name of a page, PAGE#HEADING, or a command.", show_default=False),
    ] = None,
) -> ExitCode:
    """Print a page of the documentation, or the list of pages.

    `docs task` prints the page about task files, `docs task#vary` its part under this heading, and `docs plot` what
    the command plot can do. The pages are Markdown and are installed with manipcli.
    """
    from manipcli.report.doc_pages import doc_pages, title_of
    from manipcli.report.table import table

    pages = doc_pages()
    if page:
        console.result(_text(" ".join(page)))
    else:
        rows = [(name, title_of(path.read_text(encoding="utf-8"))) for name, path in pages.items()]
        console.result(table(("page", "title"), rows))
    return ExitCode.PASSED


def _text(wanted: str) -> str:
    """The page, its part under a heading, or the section of a command.

    Raises:
        InvalidInput: there is none.
    """
    from manipcli.cli.command_help import EXIT_CODES, page_of
    from manipcli.core.text import did_you_mean
    from manipcli.report.doc_pages import anchors_of, doc_pages, section_of

    pages = doc_pages()
    name, _, anchor = wanted.partition("#")
    name = name.removesuffix(".md")
    if name not in pages and wanted in EXIT_CODES:
        name, _, anchor = page_of(wanted).partition("#")
    if name not in pages:
        hint = did_you_mean(name, [*pages, *EXIT_CODES], kind="pages")
        if _CODE.fullmatch(name.upper()):
            hint = f"a code: run `manipcli explain {name.upper()}`"
        raise InvalidInput([Diagnostic("USE204", f"there is no page '{wanted}'", hint=hint)])
    text = pages[name].read_text(encoding="utf-8").rstrip()
    if not anchor:
        return text
    section = section_of(text, anchor)
    if section is None:
        hint = did_you_mean(anchor, anchors_of(text), kind="headings")
        raise InvalidInput([Diagnostic("USE205", f"page '{name}' has no heading '#{anchor}'", hint=hint)])
    return section
