"""Whether the extra `manipcli[rerun]` is installed."""

from __future__ import annotations

from importlib.util import find_spec

from manipcli.core.errors import InvalidArgument


def check_installed(option: str) -> None:
    """
    Args:
        option: what needs it, for the message.

    Raises:
        InvalidArgument: rerun-sdk is not installed.
    """
    if find_spec("rerun") is None:
        hint = "run `pip install 'manipcli[rerun]'`, or `manipcli replay LOG`, which needs no extra"
        raise InvalidArgument("REPLAY017", f"{option} needs the extra 'rerun'", hint=hint)
