"""Findings as SARIF 2.1.0, which code hosts show next to the line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import quote

from manipcli.core.errors import Diagnostic
from manipcli.core.version import __version__
from manipcli.description.lint.check import Check
from manipcli.report.doc_pages import code_url
from manipcli.report.json import Json, dumps

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def render(findings: Sequence[Diagnostic], checks: Iterable[Check]) -> str:
    """One SARIF run: every check as a rule, every finding as a result."""
    rules = list(checks)
    index = {check.code: k for k, check in enumerate(rules)}
    driver: dict[str, Json] = {
        "name": "manipcli",
        "version": __version__,
        "rules": [_rule(check) for check in rules],
    }
    run: dict[str, Json] = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, index) for finding in findings],
    }
    return dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]})


def _rule(check: Check) -> Json:
    url = code_url(check.code)
    return {
        "id": check.code,
        "name": check.name,
        "shortDescription": {"text": check.summary},
        "fullDescription": {"text": check.reason},
        **({"helpUri": url} if url else {}),
        "defaultConfiguration": {"level": check.severity},
        "properties": {"tags": [check.tier]},
    }


def _result(finding: Diagnostic, index: dict[str, int]) -> Json:
    text = f"{finding.message}. Hint: {finding.hint}" if finding.hint else finding.message
    result: dict[str, Json] = {"ruleId": finding.code, "level": finding.severity, "message": {"text": text}}
    if finding.code in index:
        result["ruleIndex"] = index[finding.code]
    place = finding.place
    if place is not None:
        physical: dict[str, Json] = {"artifactLocation": {"uri": _uri(place.file)}}
        if place.line > 0:
            physical["region"] = {"startLine": place.line, "startColumn": max(place.column, 1)}
        result["locations"] = [{"physicalLocation": physical}]
    return result


def _uri(file: str) -> str:
    """URI of a file: relative to the working folder if its path is, else absolute."""
    path = Path(file)
    if path.is_absolute():
        return path.as_uri()
    return quote(path.as_posix(), safe="/", errors="surrogateescape")
