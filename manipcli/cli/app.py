"""The command line: its commands, and the only place that turns an error into a message and an exit code."""

from __future__ import annotations

import errno
import os
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any, Final, cast

import typer
from typer.core import TyperCommand
from typer.exceptions import TyperException
from typer.main import get_command

from manipcli.cli import command_help, console, option_defaults
from manipcli.cli.commands import (
    action,
    at,
    bless,
    check,
    check_urdf,
    diff,
    docs,
    explain,
    export,
    graph,
    info,
    init,
    judge,
    mcp,
    param,
    plan,
    plot,
    reach,
    repair,
    replay,
    run,
    schema,
    serve,
    service,
    shrink,
    sweep,
    test,
    topic,
    topic_echo,
    topic_pub,
    tune,
    view,
)
from manipcli.cli.commands import list as list_
from manipcli.cli.volume import with_volume
from manipcli.core import collector
from manipcli.core.activity import announced_to
from manipcli.core.errors import Diagnostic, ExitCode, ManipcliError
from manipcli.core.version import __version__
from manipcli.record.faults import RecordingFailed

_INTERRUPTED_BY_TYPER = 130
"""What Typer returns for Ctrl-C instead of letting KeyboardInterrupt through."""

_COMPLETION = "_MANIPCLI_COMPLETE"
"""The environment variable by which a shell asks Typer for completions."""

_FULL = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is exceeded",
    errno.EFBIG: "the file size limit is exceeded",
}

_JARGON = (
    (": Value error, ", ": "),
    ("Input should be a valid integer.*", "expected a whole number"),
    ("Input should be a valid number.*", "expected a number"),
    ("Input should be greater than or equal to ", "must be at least "),
    ("Input should be less than or equal to ", "must be at most "),
)
"""Wording of pydantic in messages of Typer, and its replacement."""

GROUPS: Final = {
    "topic": "List, print, measure and publish topics of a running robot.",
    "service": "List and call services of a running robot.",
    "action": "List actions of a running robot, and send goals.",
    "param": "List, print and set parameters of a running robot.",
}
"""Commands with sub-commands."""
COMMANDS: Final[dict[str, Callable[..., object]]] = {
    "init": init.init,
    "run": run.run,
    "test": test.test,
    "sweep": sweep.sweep,
    "shrink": shrink.shrink,
    "bless": bless.bless,
    "check": check.check,
    "check-urdf": check_urdf.check_urdf,
    "explain": explain.explain,
    "docs": docs.docs,
    "plan": plan.plan,
    "reach": reach.reach,
    "tune": tune.tune,
    "judge": judge.judge,
    "info": info.info,
    "at": at.at,
    "repair": repair.repair,
    "diff": diff.diff,
    "export": export.export,
    "graph": graph.graph,
    "plot": plot.plot,
    "view": view.view,
    "replay": replay.replay,
    "serve": serve.serve,
    "topic list": topic.list_,
    "topic info": topic.info,
    "topic echo": topic_echo.echo,
    "topic hz": topic.hz,
    "topic pub": topic_pub.pub,
    "service list": service.list_,
    "service type": service.type_,
    "service call": service.call,
    "action list": action.list_,
    "action send": action.send,
    "param list": param.list_,
    "param get": param.get,
    "param set": param.set_,
    "mcp": mcp.mcp,
    "list": list_.list_,
    "schema": schema.schema,
}


_LIST: Final = r"^-(?=\s)"
YAML_WITH_HYPHEN: Final[dict[str, str]] = {
    "param set": r"^-(?=[\s.\d])",
    "topic pub": _LIST,  # -1 is --once
    "service call": _LIST,
    "action send": _LIST,
}
"""Commands with arguments in YAML, and the beginnings of those that look like options."""


def _app(words: Sequence[str]) -> typer.Typer:
    """The Typer app for a command line of these words.

    Typer reads the parameters of every registered command, at 2 ms each. Only the called command is registered with
    its parameters, or all of them where a shell asks for completions; the help needs only names and first sentences.
    """
    app = typer.Typer(
        name="manipcli",
        help="Check, plan, simulate, record and judge manipulation tasks.",
        # Rich help doubles the time of --help; plain help is within 10 % of importing typer.
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(epilog=command_help.epilog())(_root)
    called = _called(words)
    groups: dict[str, typer.Typer] = {}
    for name, function in COMMANDS.items():
        shown = name == called or _COMPLETION in os.environ
        group, _, last = name.rpartition(" ")
        if group and group not in groups:
            groups[group] = typer.Typer(rich_markup_mode=None, help=GROUPS[group])
            app.add_typer(groups[group], name=group)
        command = with_volume(function) if shown else _without_parameters(function)
        end = command_help.epilog(name) if shown else None
        (groups[group] if group else app).command(last, epilog=end)(command)
    return app


def command_named(name: str) -> TyperCommand:
    """A command with its arguments and options, such as `topic echo`."""
    words = name.split()
    command: Any = get_command(_app(words))
    for word in words:
        command = command.commands[word]
    return cast(TyperCommand, command)


def _called(words: Sequence[str]) -> str | None:
    """The called command: `check`, or `topic echo` with its group."""
    names = [word for word in words if not word.startswith("-")]
    return " ".join(names[: 2 if names and names[0] in GROUPS else 1]) or None


def _with_yaml(words: Sequence[str]) -> list[str]:
    """The words, where YAML that begins with a hyphen (-30, -.inf, a list) is not read as options.

    A line break before it keeps the parser off, and changes neither YAML nor a number.
    """
    pattern = YAML_WITH_HYPHEN.get(_called(words) or "")
    return [*words] if pattern is None else [re.sub(pattern, "\n-", word) for word in words]


def _defaults(words: Sequence[str]) -> tuple[dict[str, object], tuple[str, ...]]:
    """Defaults of the called command from a file, as Typer takes them, and a line for each; told with --verbose.

    Raises:
        InvalidInput: the file is invalid.
    """
    from pathlib import Path

    called = _called(words)
    if called not in COMMANDS or option_defaults.WITHOUT in os.environ:
        return {}, ()
    try:
        found = option_defaults.defaults_of(called, COMMANDS, folder=Path.cwd())
    except FileNotFoundError:  # the working directory has been removed, which the command tells
        return {}, ()
    if {"-v", "--verbose"} & {*words}:
        for line in found.told:
            console.error(f"default: {line}")
    values: dict[str, object] = dict(found.values)
    for word in reversed(called.split()):
        values = {word: values}
    return values, found.told


def _without_parameters(function: Callable[..., object]) -> Callable[[], None]:
    def command() -> None: ...

    command.__doc__ = function.__doc__
    return command


def _version(wanted: bool) -> None:
    if wanted:
        console.result(f"manipcli {__version__}")
        raise typer.Exit()


def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command line and returns its exit code; prints no traceback unless MANIPCLI_DEBUG is set."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if arguments is None:  # the process of the command, not a call from Python
        collector.spare()
        if not os.environ.get("MANIPCLI_DEBUG"):
            warnings.simplefilter("ignore")  # findings report what numpy warns of
    console.prepare()
    told: tuple[str, ...] = ()
    try:
        with announced_to(console.talk):
            defaults, told = _defaults(words)
            asked = _with_yaml(words) if words and "".join(words) not in GROUPS else [*words, "--help"]
            code = _app(words)(args=asked, prog_name="manipcli", standalone_mode=False, default_map=defaults)
        if code == _INTERRUPTED_BY_TYPER:
            raise KeyboardInterrupt
        return int(code or ExitCode.PASSED)
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 (the last resort: one message and an exit code)
        return _fail(error, format_=_wanted_format(words), told=told)


def _is_interrupt(error: BaseException) -> bool:
    """Whether this is Ctrl-C, or an error that it caused during start-up: Python 3.11 wraps an interrupt in the
    creation of a class, pydantic one in the creation of a model."""
    of_a_model = type(error).__name__ == "SchemaError" and KeyboardInterrupt.__name__ in str(error)
    return of_a_model or isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt)


def _fail(error: BaseException, *, format_: str, told: Sequence[str]) -> ExitCode:
    """Prints an error: as text on stderr; or as one JSON object, or SARIF, on stdout.

    `told`: a line for each default from a file, which a usage error names.
    """
    code, findings = _classify(error)
    if isinstance(error, TyperException):
        for line in told:
            if f"'{line.split()[0]}'" in findings[0].message:
                findings = (replace(findings[0], hint=f"it is a default: {line}"),)
    try:
        from manipcli.report import json, text
    except ImportError:  # an interrupt in the import of a library, which then cannot be imported any more
        console.error("\n".join(finding.message for finding in findings))
        return code
    if os.environ.get("MANIPCLI_DEBUG"):
        console.error("".join(traceback.format_exception(error)).rstrip())
    try:
        written = not (isinstance(error, OSError) and error.filename == console.STDOUT)
        if format_ == "sarif" and written:
            from manipcli.report import sarif

            console.result(sarif.render(findings, ()))
        elif format_ == "json" and written:
            known = error.known if isinstance(error, RecordingFailed) else {}
            console.result(json.render_errors(findings, "failed" if code is ExitCode.FAILED else "error", known=known))
        else:
            console.error(text.render_errors(findings))
    except OSError:
        return ExitCode.INTERNAL  # no stream is left to print to
    return code


def _classify(error: BaseException) -> tuple[ExitCode, tuple[Diagnostic, ...]]:
    """The exit code of an error, and its findings."""
    if isinstance(error, ManipcliError):
        return error.exit_code, error.findings
    if isinstance(error, TyperException):
        context = getattr(error, "ctx", None)
        command = context.command_path if context is not None else "manipcli"
        finding = Diagnostic(
            code="USE001", message=_without_jargon(error.format_message()), hint=f"run `{command} --help` for the usage"
        )
        return ExitCode.USAGE, (finding,)
    if _is_interrupt(error):
        return ExitCode.INTERRUPTED, (Diagnostic(code="USE002", message="interrupted"),)
    if isinstance(error, OSError) and error.errno in _FULL:
        where = "output" if error.filename is None else str(error.filename)
        message = f"{where}: {_FULL[error.errno]} ({error.strerror})"
        return ExitCode.INTERNAL, (Diagnostic(code="INT001", message=message),)
    if isinstance(error, OSError) and error.filename is not None:
        return ExitCode.USAGE, (Diagnostic(code="USE003", message=f"'{error.filename}': {error.strerror}"),)
    if isinstance(error, FileNotFoundError):  # without a name: of the working directory, or from `tempfile`
        if error.strerror == os.strerror(errno.ENOENT):
            finding = Diagnostic(
                "USE004", "the working directory has been removed", hint="change to an existing directory"
            )
        else:
            finding = Diagnostic("USE006", str(error.strerror or error), hint="set TMPDIR to a writable folder")
        return ExitCode.USAGE, (finding,)
    if isinstance(error, UnicodeEncodeError) and error.encoding == sys.getfilesystemencoding() != "utf-8":
        message = f"'{error.object}' cannot be a file name: the encoding of the locale is {error.encoding}"
        return ExitCode.USAGE, (Diagnostic("USE005", message, hint="set LC_ALL=C.UTF-8"),)
    finding = Diagnostic(
        code=ManipcliError.code,
        message=f"{type(error).__name__}: {error}".replace("\n", " "),
        hint="this is a bug in manipcli; set MANIPCLI_DEBUG=1 for the traceback",
    )
    return ExitCode.INTERNAL, (finding,)


def _without_jargon(message: str) -> str:
    """Typer's message without the prefix of pydantic, and with plain words for numbers."""
    for pattern, replacement in _JARGON:
        message = re.sub(pattern, replacement, message, count=1)
    return message


def _wanted_format(words: Sequence[str]) -> str:
    """The value of `--format` in the words of a command line, which usage errors follow, too."""
    formats = [second for first, second in pairwise(words) if first == "--format"]
    formats += [word.removeprefix("--format=") for word in words if word.startswith("--format=")]
    return next((name for name in ("json", "sarif") if name in formats), "text")
