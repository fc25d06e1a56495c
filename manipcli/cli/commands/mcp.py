"""`manipcli mcp`: tools for clients with a language model, over stdio."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import option_defaults
from manipcli.cli.options import PackagePath, seconds
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput


def mcp(
    *,
    folder: Annotated[
        Path, typer.Option("--folder", metavar="DIR", help="Folder that the tools are confined to.")
    ] = Path(),
    limit: Annotated[
        str, typer.Option("--limit", metavar="TIME", help="End a tool after TIME (90s, 10min).")
    ] = "10min",
    package_path: PackagePath = None,
) -> ExitCode:
    """Serve tools to a client with a language model, over stdio (Model Context Protocol).

    The tools check, plan, run, judge and explain files of one folder; they write logs to its folder runs only. The
    client starts this command, and ends it by closing stdin.
    """
    from manipcli.mcp_server.child import Runner
    from manipcli.mcp_server.folder import Folder
    from manipcli.mcp_server.server import serve

    try:
        confined = Folder.of(folder)
    except OSError as error:
        message = f"--folder '{folder}' cannot be used: {error.strerror or error}"
        raise InvalidInput([Diagnostic("USE152", message, hint="name an existing folder")]) from None
    packages = tuple(path.resolve() for path in package_path or ())
    environment = {option_defaults.WITHOUT: "1", "NO_COLOR": "1"}
    serve(Runner(confined, packages, seconds(limit), environment))
    return ExitCode.PASSED
