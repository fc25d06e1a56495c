"""`manipcli topic list|echo|pub`: topics of a live session, or of another rosbridge server."""

from __future__ import annotations

import json
from typing import Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput


def topic(
    action: Annotated[Literal["list", "echo", "pub"], typer.Argument(help="list, echo or pub.", show_default=False)],
    name: Annotated[str | None, typer.Argument(metavar="[TOPIC]", help="Topic of echo and pub.")] = None,
    type_: Annotated[str | None, typer.Argument(metavar="[TYPE]", help="Its type, for pub.")] = None,
    message: Annotated[str | None, typer.Argument(metavar="[MESSAGE]", help="Message as YAML, for pub.")] = None,
    *,
    url: Annotated[
        str, typer.Option("--url", metavar="URL", help="Address of the server, with its token.")
    ] = "ws://127.0.0.1:9090",
    once: Annotated[bool, typer.Option("--once", help="pub: one message (needed); echo: end after one.")] = False,
) -> ExitCode:
    """List the topics of a running robot, print their messages, or publish one.

    Messages are printed as one JSON object per line. `serve` prints the URL; publishing needs its token.
    """
    if action != "list" and name is None:
        raise InvalidInput([Diagnostic("USE135", f"topic {action} needs a TOPIC", hint="manipcli topic list")])
    if action == "pub" and (type_ is None or message is None or not once):
        hint = "manipcli topic pub --once TOPIC TYPE 'YAML'"
        raise InvalidInput([Diagnostic("USE135", "topic pub needs --once, a TYPE and a MESSAGE", hint=hint)])
    from manipcli.cli.interrupts import Interrupts
    from manipcli.live.remote import Remote
    from manipcli.report.table import table
    from manipcli.spec.source.tree import plain
    from manipcli.spec.source.yaml import parse

    with Interrupts():
        given = None
        if message is not None:
            node = parse(message, "MESSAGE")
            given = {} if node is None else plain(node)
        with Remote(url) as remote:
            if action == "list":
                console.result(table(("topic", "type"), [*remote.topics().items()]))
            elif action == "pub":
                remote.publish(str(name), str(type_), given)
                console.talk(f"published on {name}")
            else:
                for found in remote.messages(str(name)):
                    console.result(json.dumps(found))
                    if once:
                        break
    return ExitCode.PASSED
