"""`manipcli service list|type|call`: services of a running robot, or of any other rosbridge server."""

from __future__ import annotations

from typing import Annotated

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
    value_of,
)
from manipcli.core.errors import ExitCode

Service = Annotated[str, typer.Argument(metavar="SERVICE", help="Name of the service.", show_default=False)]


def list_(*, show_types: ShowTypes = False, url: Url = LOCAL) -> ExitCode:
    """List the services."""
    with connected(url) as remote:
        from manipcli.live import remote_names

        names = remote_names.services(remote)
        types = {name: remote_names.service_type(remote, name) if show_types else "" for name in names}
        print_names(types, show_types=show_types)
    return ExitCode.PASSED


def type_(name: Service, *, url: Url = LOCAL) -> ExitCode:
    """Print the type of a service."""
    with connected(url) as remote:
        from manipcli.live import remote_names

        console.result(remote_names.known_type(remote, remote_names.SERVICES, rooted(name)) or "unknown")
    return ExitCode.PASSED


def call(
    name: Service,
    kind: Annotated[str | None, typer.Argument(metavar="TYPE", help="Its type; may be left out.")] = None,
    request: Annotated[
        str | None, typer.Argument(metavar="REQUEST", help="Request as YAML; fields left out are 0 or empty.")
    ] = None,
    *,
    timeout: Timeout = "10s",
    url: Url = LOCAL,
) -> ExitCode:
    """Call a service and print its response as YAML."""
    if request is None and kind is not None and not isinstance(value_of(kind), str):
        kind, request = None, kind
    name, values, wait = rooted(name), message_of(request), patience(timeout)
    with connected(url) as remote:
        from manipcli.live import remote_names
        from manipcli.spec.source.yaml_text import to_yaml

        remote_names.known_type(remote, remote_names.SERVICES, name, kind)
        console.result(to_yaml(remote.call(name, values, patience=wait or 10.0)))
    return ExitCode.PASSED
