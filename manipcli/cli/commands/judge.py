"""`manipcli judge LOG`: the verdict, computed from the log alone."""

from __future__ import annotations

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, LogFile, PackagePath
from manipcli.cli.outputs import JunitFile, Outputs, ReportFile
from manipcli.core.errors import ExitCode, InvalidInput


def judge(
    log: LogFile,
    *,
    report: ReportFile = None,
    junit: JunitFile = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    format_: Format = "text",
) -> ExitCode:
    """Judge a run from its log.

    Reads only the log, and ignores the verdict stored in it; --report also reads the meshes.
    """
    outputs = Outputs(report, junit, others=(log,))
    from manipcli import pipeline
    from manipcli.report import json, text
    from manipcli.report.run_report import exit_code

    try:
        verdict = pipeline.judge_log(log)
    except InvalidInput as invalid:
        outputs.of_invalid(invalid.findings, log=log)
        raise
    render = json.render_verdict if format_ == "json" else text.render_verdict
    console.result(render(verdict, str(log)))
    if outputs.wanted:
        outputs.of_log(log, verdict, package_path=tuple(package_path or ()), allow_outside=allow_outside)
    return exit_code(verdict)
