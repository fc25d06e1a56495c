"""`manipcli param list|get|set`: parameters of a running robot, or of any other rosbridge server."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.remote_options import LOCAL, Url, connected, rooted, value_of
from manipcli.core.errors import ExitCode

Node = Annotated[str, typer.Argument(metavar="NODE", help="Name of the node, or NODE:NAME.", show_default=False)]


def list_(
    node: Annotated[str | None, typer.Argument(metavar="NODE", help="Only those of NODE.")] = None,
    *,
    url: Url = LOCAL,
) -> ExitCode:
    """List the parameters of all nodes, or of one."""
    with connected(url) as remote:
        from manipcli.live import remote_params

        found: dict[str, list[str]] = {}
        for name in remote_params.names(remote):
            own, _, parameter = name.rpartition(":")
            found.setdefault(own, []).append(parameter)
        for own in sorted(found):
            if node is None or own == rooted(node):
                console.result("\n".join([f"{own}:", *(f"  {parameter}" for parameter in sorted(found[own]))]))
    return ExitCode.PASSED


def get(
    node: Node,
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="Name of the parameter.")] = None,
    *,
    url: Url = LOCAL,
) -> ExitCode:
    """Print the value of a parameter."""
    whole = _joined(node, name)
    with connected(url) as remote:
        from manipcli.live import remote_params
        from manipcli.spec.source.yaml_text import to_yaml

        value = remote_params.get(remote, whole)
        console.result(value if isinstance(value, str) else to_yaml(value))
    return ExitCode.PASSED


def set_(
    node: Node,
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Its name; or the value, if NODE has the name.", show_default=False)
    ],
    value: Annotated[str | None, typer.Argument(metavar="VALUE", help="Value as YAML.")] = None,
    *,
    url: Url = LOCAL,
) -> ExitCode:
    """Set a parameter to a value, given as YAML."""
    whole, text = (_joined(node, None), name) if value is None else (_joined(node, name), value)
    given = json.dumps(value_of(text))
    with connected(url) as remote:
        from manipcli.live import remote_params

        remote_params.set_to(remote, whole, given)
        console.talk(f"set {whole} to {given}")
    return ExitCode.PASSED


def _joined(node: str, name: str | None) -> str:
    """`/node:name`, as rosapi names a parameter; without a name what was given."""
    return rooted(node) if name is None else f"{rooted(node)}:{name}"
