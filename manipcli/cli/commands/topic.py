"""`manipcli topic list|info|hz`: topics of a running robot, or of any other rosbridge server."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.remote_options import LOCAL, ShowTypes, Topic, Url, connected, print_names, rooted
from manipcli.core.errors import ExitCode

REPORT_PERIOD = 1.0
"""[s] Of wall time between two reports of `hz`."""


def list_(*, show_types: ShowTypes = False, url: Url = LOCAL) -> ExitCode:
    """List the topics."""
    with connected(url) as remote:
        from manipcli.live import remote_names

        print_names(remote_names.topics(remote), show_types=show_types)
    return ExitCode.PASSED


def info(name: Topic, *, url: Url = LOCAL) -> ExitCode:
    """Print the type of a topic, and the nodes that publish and subscribe it."""
    name = rooted(name)
    with connected(url) as remote:
        from manipcli.live import remote_names

        kind = remote_names.known_type(remote, remote_names.TOPICS, name)
        console.result(f"Type: {kind or 'unknown'}")
        for word, nodes in remote_names.nodes_of_topic(remote, name).items():
            console.result(f"{word} count: {len(nodes)}" + (f" ({', '.join(nodes)})" if nodes else ""))
    return ExitCode.PASSED


def hz(
    name: Topic,
    *,
    window: Annotated[
        int, typer.Option("--window", "-w", metavar="N", min=2, help="Number of the last messages that count.")
    ] = 10_000,
    once: Annotated[bool, typer.Option("--once", help="End after one report.")] = False,
    url: Url = LOCAL,
) -> ExitCode:
    """Print the rate at which messages arrive, in wall time, each second; press Ctrl-C to end."""
    name = rooted(name)
    with connected(url) as remote:
        from manipcli.live import remote_names
        from manipcli.live.rate import Rate
        from manipcli.live.remote import is_message

        rate = Rate(window)
        try:
            remote.subscribe(name, remote_names.known_type(remote, remote_names.TOPICS, name))
            while True:
                for frame in remote.received(REPORT_PERIOD):
                    if is_message(frame, name):
                        rate.arrived(time.monotonic())
                console.result(rate.report())
                if once or console.reader_is_gone():
                    break
        except KeyboardInterrupt:  # how it ends
            pass
    return ExitCode.PASSED
