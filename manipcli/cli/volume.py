"""`--quiet` and `--verbose` of every command: how much is said on stderr."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, Final

import typer

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, InvalidInput

Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Say more on stderr.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result and errors.")]
_BOTH: Final = {"verbose": Verbose, "quiet": Quiet}


def with_volume(command: Callable[..., Any]) -> Callable[..., Any]:
    """The command with both options. Where it has one of its own, it receives it, too."""
    signature = inspect.signature(command, eval_str=True)
    own = signature.parameters
    missing = {name: option for name, option in _BOTH.items() if name not in own}

    @functools.wraps(command)
    def called(**values: Any) -> Any:
        console.set_volume(quiet=values["quiet"], verbose=values["verbose"])
        if values["quiet"] and values["verbose"]:
            raise InvalidInput([Diagnostic("USE092", "--quiet and --verbose exclude each other")])
        return command(**{name: value for name, value in values.items() if name not in missing})

    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option)
        for name, option in missing.items()
    ]
    shown = [*own.values(), *added]
    called.__signature__ = signature.replace(parameters=shown)  # type: ignore[attr-defined]  # Typer reads it
    called.__annotations__ = {each.name: each.annotation for each in shown}
    return called
