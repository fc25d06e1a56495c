"""`manipcli plot LOG... [TOPIC.FIELD...]`: curves of logs as a figure or a table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.log_files import is_log, one_file
from manipcli.cli.options import Format, OutputFormat
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.replay.curves import Chart

LOG_ENDINGS = (".mcap", ".partial")


def plot(
    context: typer.Context,
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG... [TOPIC.FIELD]...",
            help="MCAP logs of ROS 2 messages, and the fields to plot: joint_states.position[joint_1], "
            "tf[cup].translation.z, contacts.force; one panel each, or one panel for several joined by commas "
            "[default: an overview].",
            show_default=False,
        ),
    ],
    *,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a figure: .svg, .png or .pdf.", show_default=False),
    ] = None,
    csv: Annotated[
        str | None, typer.Option("--csv", metavar="FILE", help="Write a table; - is stdout.", show_default=False)
    ] = None,
    start: Annotated[str | None, typer.Option("--from", metavar="T", help="Start: seconds, or a step.")] = None,
    end: Annotated[str | None, typer.Option("--to", metavar="T", help="End: seconds, or a step.")] = None,
    fields: Annotated[bool, typer.Option("--fields", help="List the fields that can be plotted.")] = False,
    format_: Format = "text",
) -> ExitCode:
    """Plot fields of one log, or of several logs over each other.

    -o writes a figure, --csv a table, --fields lists the fields of a log. Works with any ROS 2 log.
    """
    logs = [context.with_resource(one_file(Path(word))) for word in words if _is_log(word)]
    asked = [word for word in words if not _is_log(word)]
    if not logs:
        hint = "run `manipcli plot LOG.mcap [TOPIC.FIELD]...`"
        raise InvalidInput([Diagnostic("USE060", f"LOG is missing: '{words[0]}' is not a file", hint=hint)])
    if fields:
        _list_fields(logs, format_)
        return ExitCode.PASSED
    if format_ == "json":
        message = "--format json has no effect without --fields"
        raise InvalidInput([Diagnostic("USE064", message, hint="add --fields, or use `--csv -` for the numbers")])
    if output is None and csv is None:
        hint = "add -o FILE.svg for a figure, --csv - for a table, --fields for a list of fields"
        raise InvalidInput(
            [Diagnostic("USE065", "an output is missing: expected --output, --csv or --fields", hint=hint)]
        )
    check_outputs(("--output", output), ("--csv", Path(csv) if csv not in (None, "-") else None), reads=logs)
    kind = None
    if output is not None:
        from manipcli.replay.figure import kind_of

        kind = kind_of(output)
    from manipcli.logs.plot import open_chart

    chart = open_chart(logs, asked, start=start, end=end)
    for note in chart.notes:
        console.talk(f"note: {note}")
    if output is not None and kind is not None:
        from manipcli.core.whole_file import whole_file
        from manipcli.replay.figure import render

        with whole_file(output) as partial:
            partial.write_bytes(render(chart, kind))
        console.talk(f"drawn: {output}")
    if csv is not None:
        _write_table(chart, csv)
    return ExitCode.PASSED


def _is_log(word: str) -> bool:
    """Whether a word names a file or a bag; no topic or field ends in `.mcap`."""
    return word.endswith(LOG_ENDINGS) or Path(word).is_file() or is_log(Path(word))


def _write_table(chart: Chart, csv: str) -> None:
    from io import StringIO

    from manipcli.core.whole_file import write_whole
    from manipcli.replay.curves import write_table

    stream = StringIO()
    write_table(chart, stream)
    if csv == "-":
        console.result(stream.getvalue().removesuffix("\n"))
    else:
        write_whole(Path(csv), stream.getvalue().encode())
        console.talk(f"written: {csv}")


def _list_fields(logs: list[Path], format_: OutputFormat) -> None:
    from manipcli.logs.plot import field_lines
    from manipcli.report.json import Json, dumps
    from manipcli.report.table import table

    found = {str(log): field_lines(log) for log in logs}
    if format_ == "json":
        listing: Json = [
            {"log": log, "fields": [{"name": line.name, "type": line.type, "messages": line.count} for line in lines]}
            for log, lines in found.items()
        ]
        console.result(dumps({"logs": listing}))
        return
    for log, lines in found.items():
        if len(logs) > 1:
            console.result(f"{log}:")
        rows = [[line.name, line.type, str(line.count)] for line in lines]
        console.result(table(("field", "type", "messages"), rows, right=("messages",)) if rows else "nothing")
