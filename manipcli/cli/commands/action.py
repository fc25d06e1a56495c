"""`manipcli action list|send`: actions of a running robot, or of any other rosbridge server."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.remote_options import (
    LOCAL,
    ShowTypes,
    Timeout,
    Url,
    connected,
    message_of,
    patience,
    print_names,
    rooted,
)
from manipcli.core.errors import ExitCode

if TYPE_CHECKING:
    from manipcli.live.remote_goal import RemoteGoal


def list_(*, show_types: ShowTypes = False, url: Url = LOCAL) -> ExitCode:
    """List the actions."""
    with connected(url) as remote:
        from manipcli.live import remote_names

        names = remote_names.actions(remote)
        types = {name: remote_names.action_type(remote, name) if show_types else "" for name in names}
        print_names(types, show_types=show_types)
    return ExitCode.PASSED


def send(
    name: Annotated[str, typer.Argument(metavar="ACTION", help="Name of the action.", show_default=False)],
    kind: Annotated[str, typer.Argument(metavar="TYPE", help="Its type.", show_default=False)],
    goal: Annotated[
        str | None, typer.Argument(metavar="GOAL", help="Goal as YAML; fields left out are 0 or empty.")
    ] = None,
    *,
    feedback: Annotated[bool, typer.Option("--feedback", "-f", help="Print the feedback.")] = False,
    timeout: Timeout = None,
    url: Url = LOCAL,
) -> ExitCode:
    """Send a goal, and print its result as YAML; Ctrl-C cancels it.

    The exit code is 0 if the goal succeeded.
    """
    name, values, wait = rooted(name), message_of(goal), patience(timeout)
    with connected(url) as remote:
        from manipcli.live import remote_names
        from manipcli.live.remote import PATIENCE
        from manipcli.live.remote_goal import RemoteGoal

        own = remote_names.known_type(remote, remote_names.ACTIONS, name, kind)
        sent = RemoteGoal(remote, name, own, values, feedback=feedback)
        try:
            return ExitCode.PASSED if _watch(sent, wait) == "SUCCEEDED" else ExitCode.FAILED
        except KeyboardInterrupt:
            console.talk("canceling the goal")
            sent.cancel()
            _watch(sent, PATIENCE)
            return ExitCode.INTERRUPTED


def _watch(goal: RemoteGoal, wait: float | None) -> str:
    """Print feedback and result; returns the word of the status."""
    from manipcli.live.remote_goal import GoalResult
    from manipcli.spec.source.yaml_text import to_yaml

    for event in goal.events(wait):
        if isinstance(event, GoalResult):
            console.result(f"Result:\n{_indented(to_yaml(event.values))}")
            console.result(f"Goal finished with status: {event.status}")
            return event.status
        console.result(f"Feedback:\n{_indented(to_yaml(event))}")
    return ""


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())
