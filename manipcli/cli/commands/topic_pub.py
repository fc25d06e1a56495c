"""`manipcli topic pub TOPIC TYPE MESSAGE`: publish a message once, or at a rate."""

from __future__ import annotations

import itertools
import time
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.remote_options import LOCAL, Topic, Url, connected, message_of, rooted
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput


def pub(
    name: Topic,
    type_: Annotated[str, typer.Argument(metavar="TYPE", help="Its type.", show_default=False)],
    message: Annotated[
        str | None, typer.Argument(metavar="MESSAGE", help="Message as YAML; fields left out are 0 or empty.")
    ] = None,
    *,
    once: Annotated[bool, typer.Option("--once", "-1", help="Publish one message.")] = False,
    rate: Annotated[float, typer.Option("--rate", "-r", metavar="HZ", help="Messages per second of wall time.")] = 1.0,
    times: Annotated[
        int | None, typer.Option("--times", "-t", metavar="N", min=1, help="End after N messages.", show_default=False)
    ] = None,
    url: Url = LOCAL,
) -> ExitCode:
    """Publish a message, repeatedly without --once; press Ctrl-C to end."""
    if not 0.0 < rate <= 1000.0:
        raise InvalidInput([Diagnostic("USE158", f"--rate is {rate:g}; expected a number above 0, at most 1000")])
    name, values, most = rooted(name), message_of(message), 1 if once else times
    with connected(url) as remote:
        from manipcli.live import remote_names

        remote_names.known_type(remote, remote_names.TOPICS, name, type_)
        remote.send(op="advertise", id=remote.id_for("advertise"), topic=name, type=type_)
        start = time.monotonic()
        try:
            for count in itertools.count(1) if most is None else range(1, most + 1):
                remote.publish(name, values)
                if count == 1 or count == most:
                    remote.settle()
                console.talk(f"published #{count}")
                if count != most:
                    for _ in remote.received(start + count / rate - time.monotonic()):
                        pass  # what the server refuses is raised here
        except KeyboardInterrupt:  # how it ends
            pass
    return ExitCode.PASSED
