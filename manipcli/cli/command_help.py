"""The end of the help of each command: its exit codes, and its page."""

from __future__ import annotations

from typing import Final

from manipcli.report.doc_pages import address

_DONE: Final = "0 done"
_REMOTE: Final = "0 done, 1 refused or no server"

EXIT_CODES: Final[dict[str, str]] = {
    "init": "0 created",
    "run": "0 passed, 1 failed or not plannable, or engines disagree",
    "test": "0 all passed, 1 some failed, 4 a file is invalid, whatever the others did, 5 no task",
    "sweep": "0 done, 1 the rate is below --at-least or the second sweep is significantly worse, 2 interrupted",
    "shrink": "0 found, 1 nothing fails, or not confirmed within the budget",
    "bless": "0 written, 1 a task failed, 4 a file is invalid: these keep their baselines; 5 no task",
    "check": "0 no error, 1 errors (with --strict also warnings), 4 a file is missing or unreadable",
    "check-urdf": "0 no error, 1 errors (with --strict also warnings), 4 missing file or wrong option",
    "explain": "0 explained, 4 unknown code or invalid task",
    "docs": "0 printed, 4 unknown page",
    "plan": "0 planned, 1 not plannable",
    "reach": "0 done, 1 no point can be planned, 2 interrupted",
    "tune": _DONE,
    "judge": "0 passed, 1 failed",
    "info": _DONE,
    "at": _DONE,
    "repair": _DONE,
    "diff": "0 the same, 1 different",
    "export": "0 written, 1 not plannable",
    "graph": _DONE,
    "plot": _DONE,
    "view": _DONE,
    "replay": "0 done; with --verify: 0 identical, 1 different",
    "serve": "0 ended, 1 the simulation failed",
    "topic list": _REMOTE,
    "topic info": _REMOTE,
    "topic echo": _REMOTE,
    "topic hz": _REMOTE,
    "topic pub": _REMOTE,
    "service list": _REMOTE,
    "service type": _REMOTE,
    "service call": _REMOTE,
    "action list": _REMOTE,
    "action send": "0 succeeded, 1 not, or no server, 2 canceled",
    "param list": _REMOTE,
    "param get": _REMOTE,
    "param set": _REMOTE,
    "mcp": _DONE,
    "list": _DONE,
    "schema": _DONE,
}
"""What the exit codes mean that a command has in normal use, by command; the others are those of every command."""

COMMON: Final = (
    "Exit codes: 0 passed, 1 failed or not plannable, 2 interrupted, 3 internal error, 4 usage or invalid file, "
    "5 nothing to run."
)

_PAGES: Final = {
    "test": "tests",
    "bless": "tests",
    "sweep": "sweeps",
    "shrink": "sweeps",
    "reach": "reach",
    "serve": "live",
    "mcp": "mcp",
}
"""Commands with a page of their own; the others have a section of `commands`."""


def page_of(command: str) -> str:
    """The page of a command, `sweeps`, or its section, `commands#run`."""
    return _PAGES.get(command, f"commands#{command.replace(' ', '-')}")


def epilog(command: str | None = None) -> str:
    """The end of the help of a command, or of manipcli."""
    # The mark keeps the address on a line of its own, unbroken.
    if command is None:
        return f"{COMMON}\n\n\b\nDocs: {address()}"
    return f"Exit codes: {EXIT_CODES[command]}.\n\n\b\nDocs: {address(page_of(command), subject=command)}"
