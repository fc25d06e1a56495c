"""Options and arguments of the commands that talk to the server of a running robot."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live.names import DEFAULT_PORT

if TYPE_CHECKING:
    from manipcli.live.remote import Remote

LOCAL = f"ws://127.0.0.1:{DEFAULT_PORT}"

Url = Annotated[
    str,
    typer.Option("--url", metavar="URL", envvar="MANIPCLI_URL", help="Address of the server, with its token."),
]
Timeout = Annotated[
    str | None, typer.Option("--timeout", metavar="TIME", help="Fail after TIME of the wall clock without an answer.")
]
ShowTypes = Annotated[bool, typer.Option("--show-types", "-t", help="Print the types, too.")]
Topic = Annotated[str, typer.Argument(metavar="TOPIC", help="Name of the topic.", show_default=False)]


def patience(word: str | None) -> float | None:
    """[s] The value of `--timeout`; None without the option.

    Raises:
        InvalidInput: it is not a time above 0.
    """
    if word is None:
        return None
    from manipcli.cli.options import seconds

    found = seconds(word)
    if not 0.0 < found <= 1e6:
        raise InvalidInput([Diagnostic("USE158", f"--timeout is '{word}'; expected a time above 0", hint="write 10s")])
    return found


def message_of(text: str | None) -> object:
    """The message, request or goal that a user wrote as YAML or JSON; an empty one without a text.

    Raises:
        InvalidInput: it is not YAML, or no mapping.
    """
    if text is None or not text.strip():
        return {}
    found = value_of(text)
    if not isinstance(found, dict):
        message = f"the message is {'a list' if isinstance(found, list) else f'{found!r}'}; expected its fields"
        raise InvalidInput([Diagnostic("USE159", message, hint="write '{field: value, ...}'")])
    return found


def value_of(text: str) -> object:
    """The value of a YAML text.

    Raises:
        InvalidInput: it is not YAML, with its line and column.
    """
    from manipcli.spec.source.tree import plain
    from manipcli.spec.source.yaml import parse

    node = parse(text, "MESSAGE")
    return None if node is None else plain(node)


def rooted(name: str) -> str:
    """A name with its leading slash, which the user may leave out."""
    return name if name.startswith("/") else f"/{name}"


@contextmanager
def connected(url: str) -> Iterator[Remote]:
    """A connection to the server; its warnings are printed."""
    from manipcli.cli.interrupts import Interrupts
    from manipcli.live.remote import Remote

    with Interrupts(), Remote(url, warn=lambda text: console.talk(f"warning: {text}")) as remote:
        yield remote


def print_names(names: dict[str, str], *, show_types: bool) -> None:
    """Names in alphabetical order, one per line, with their types in brackets."""
    for name in sorted(names):
        console.result(f"{name} [{names[name]}]" if show_types else name)
