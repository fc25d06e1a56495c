"""`manipcli topic echo TOPIC`: messages of a topic as YAML, JSON or CSV."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.remote_options import LOCAL, Timeout, Topic, Url, connected, patience, rooted
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput


def echo(
    name: Topic,
    type_: Annotated[
        str | None, typer.Argument(metavar="TYPE", help="Its type [default: asked from the server].")
    ] = None,
    *,
    field: Annotated[
        str | None, typer.Option("--field", metavar="PATH", help="Print one field, such as position[0].")
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="End after one message.")] = False,
    times: Annotated[
        int | None, typer.Option("--times", metavar="N", min=1, help="End after N messages.", show_default=False)
    ] = None,
    csv: Annotated[
        bool, typer.Option("--csv", help="Print comma-separated values, one line per message, after the field names.")
    ] = False,
    json_: Annotated[bool, typer.Option("--json", help="Print one JSON value per line.")] = False,
    timeout: Timeout = None,
    url: Url = LOCAL,
) -> ExitCode:
    """Print the messages of a topic as YAML; press Ctrl-C to end."""
    if csv and json_:
        raise InvalidInput([Diagnostic("USE163", "--csv and --json exclude each other")])
    name, wait, most = rooted(name), patience(timeout), 1 if once else times
    from manipcli.report.message_fields import FieldPath

    path = None if field is None else FieldPath(field)
    lines = _lines(csv=csv, json_=json_, prefix=field or "")
    with connected(url) as remote:
        from manipcli.live import remote_names

        try:
            kind = remote_names.known_type(remote, remote_names.TOPICS, name, type_)
            for count, message in enumerate(remote.messages(name, kind, patience=wait), 1):
                console.result("\n".join(lines(message if path is None else path.of(message))))
                if count == most or console.reader_is_gone():
                    break
        except KeyboardInterrupt:  # how it ends
            pass
    return ExitCode.PASSED


def _lines(*, csv: bool, json_: bool, prefix: str) -> Callable[[object], list[str]]:
    """Makes the lines of a message."""
    if csv:
        from manipcli.report.message_fields import CsvTable

        return CsvTable(prefix).lines
    if json_:
        return lambda value: [json.dumps(value)]
    from manipcli.spec.source.yaml_text import to_yaml

    return lambda value: [to_yaml(value), "---"]
