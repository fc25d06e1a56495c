"""`manipcli explain CODE`: what a code of a finding means, with a faulty and a sound example."""

from __future__ import annotations

from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import Format
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import did_you_mean


def explain(
    code: Annotated[str, typer.Argument(metavar="CODE", help="Code of a finding: TASK203.", show_default=False)],
    *,
    format_: Format = "text",
) -> ExitCode:
    """Explain a code: what it reports, why, and an example with and without the defect."""
    from dataclasses import asdict

    from manipcli.report.codes.code_page import code_pages, render_text, similar
    from manipcli.report.json import dumps

    page = code_pages().get(code.upper())
    if page is None:
        hint = did_you_mean(code.upper(), similar(code), kind="codes")
        raise InvalidInput([Diagnostic("USE094", f"there is no code '{code}'", hint=hint)])
    console.result(dumps(asdict(page)) if format_ == "json" else render_text(page))
    return ExitCode.PASSED
