"""Result of `check-urdf`: findings and a summary of the description, as text and as JSON."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from manipcli.core.errors import Diagnostic
from manipcli.core.text import listed, number_of, shorten
from manipcli.description.lint.check import Check
from manipcli.description.lint.guess_groups import GuessedGroup
from manipcli.description.lint.summary import Summary
from manipcli.report.json import Json, dumps, picked, plain
from manipcli.report.table import table
from manipcli.report.text import FAIL, PASS, describe


def render_text(
    file: str,
    findings: Sequence[Diagnostic],
    summary: Summary | None,
    *,
    passed: bool,
    left_out: Sequence[tuple[str, int]] = (),
    tree: Sequence[str] = (),
) -> str:
    """Findings, summary, link tree if given, and the verdict in the last line."""
    lines = [text for group in alike(findings) for text in _described(group)]
    lines += [f"... and {number} more of {code}" for code, number in left_out]
    if lines:
        lines.append("")
    if summary is not None:
        lines += [*_summary(summary), ""]
    if tree:
        lines += [*tree, ""]
    mark, word = (PASS, "passed") if passed else (FAIL, "failed")
    counts = [
        number_of(sum(finding.severity == severity for finding in findings), severity)
        for severity in ("error", "warning", "note")
    ]
    more = f", {sum(number for _, number in left_out)} more not shown" if left_out else ""
    return "\n".join([*lines, f"{mark} {word}: {file}: {', '.join(counts)}{more}"])


MOST_ALIKE = 3
"""More findings with one cause than this are shown as one."""
_PATH = re.compile(r"'(?:\w+://)?/?[^' ]*/[^' ]*'|(?<= )/[^ ]*|(?<=searched )[^ ]+|(?<=from )[^ ]+:\d+:\d+")
"""Files in messages; those outside the working directory have absolute paths, those below it relative ones."""


def alike(findings: Sequence[Diagnostic]) -> list[list[Diagnostic]]:
    """Groups of findings that differ only in the file they name, in the order of their first ones."""
    groups: dict[object, list[Diagnostic]] = {}
    for k, finding in enumerate(findings):
        cause = _PATH.sub("''", finding.message)
        hint = None if finding.hint is None else _PATH.sub("''", finding.hint)
        key = k if cause == finding.message else (finding.code, finding.severity, cause, hint)
        groups.setdefault(key, []).append(finding)
    return list(groups.values())


def _described(group: Sequence[Diagnostic]) -> list[str]:
    """The lines of findings with one cause: the first one, and all files that they name."""
    if len(group) <= MOST_ALIKE:
        return [*map(describe, group)]
    named = [found[0].strip("'") for finding in group if (found := _PATH.search(finding.message))]
    folder = _common_folder(named)
    more = f" (x {len(group)}{f', all below {folder}' if folder else ''})"
    first = group[0]
    files = dict.fromkeys(uri.removeprefix(f"{folder}/") for uri in named)
    return [describe(replace(first, message=first.message + more)), f"  files: {', '.join(files)}"]


def _common_folder(uris: Sequence[str]) -> str:
    """The folder that all these are in; empty if there is none."""
    parts = [uri.split("/")[:-1] for uri in uris]
    same = [names[0] for names in zip(*parts, strict=False) if len({*names}) == 1]
    shared = []
    for k, name in enumerate(same):
        if any(len(own) <= k or own[k] != name for own in parts):
            break
        shared.append(name)
    return "/".join(shared)


def render_explanation(check: Check) -> str:
    """What a code means, why it matters, and an example description with the defect."""
    return "\n".join(
        [
            f"{check.code} {check.name} ({check.tier}, {check.severity})",
            "",
            f"{check.summary}.",
            *textwrap.wrap(check.reason, 100),
            "",
            "for example:",
            *(f"  {line}" for line in _lines(check.bad)),
        ]
    )


def _lines(xml: str) -> list[str]:
    """One line per element of the top levels; a long example is shortened."""
    lines = _TOP.sub(">\n<", xml).splitlines()
    return [shorten(line, width=110) for line in lines[:20]] + (["..."] if len(lines) > 20 else [])


def render_checks(checks: Iterable[Check]) -> str:
    """A table of the checks, one per line, with the reason of each."""
    rows = [
        (check.code, check.name, check.tier, check.severity, check.summary, " ".join(check.reason.split()))
        for check in checks
    ]
    return table(("code", "name", "tier", "severity", "what is wrong", "why it matters"), rows)


_TOP = re.compile(r"><(?=/?(robot|link|joint|material|inertial|visual|collision|xacro:|transmission|ros2)\b)")


def _summary(summary: Summary) -> list[str]:
    types = ", ".join(f"{number} {kind or 'without type'}" for kind, number in summary.types)
    rows = {
        "robot": summary.name + (f", root link '{summary.root}'" if summary.root else ""),
        "links": str(summary.links),
        "joints": f"{summary.joints}" + (f" ({types})" if types else ""),
        "moving": f"{summary.moving}: {number_of(summary.dof, 'degree')} of freedom"
        + (f", {number_of(summary.mimics, 'mimic joint')}" if summary.mimics else ""),
        "transmissions": str(summary.transmissions),
        "mass": f"{summary.mass:.4g} kg"
        + (f"; {number_of(summary.massless, 'moving link')} without mass" if summary.massless else ""),
    }
    if summary.reach:
        rows["reach"] = f"about {summary.reach:.3g} m from the first joint of the longest chain to its tip"
    if summary.meshes:
        rows["meshes"] = f"{summary.meshes_found} of {summary.meshes} found"
    width = max(map(len, rows)) + 2
    lines = [f"{name + ':':<{width}}{value}" for name, value in rows.items()]
    if summary.groups:
        lines.append("groups, guessed:")
        lines += [f"  {_group(group)}" for group in summary.groups]
    return lines


def _group(group: GuessedGroup) -> str:
    where = f"{group.base} -> {group.tip}" if group.tip else f"at {group.base}"
    own = listed(group.joints, most=8) or "no joints"
    follow = f"; follow: {listed(group.mimics, most=8)}" if group.mimics else ""
    return f"{group.kind} of {len(group.joints)}, {where}: {own}{follow}"


def render_json(
    file: str,
    findings: Sequence[Diagnostic],
    summary: Summary | None,
    *,
    passed: bool,
    left_out: Sequence[tuple[str, int]] = (),
    tree: Sequence[str] = (),
) -> str:
    """The JSON object of `check` with `summary` (null if the file cannot be expanded), `left_out` and `tree`."""
    return dumps(
        {
            "verdict": "passed" if passed else "failed",
            "files": [file],
            "findings": plain(findings),
            "left_out": dict(left_out),
            "summary": _summary_object(summary) if summary is not None else None,
            "tree": list(tree),
        }
    )


def _summary_object(summary: Summary) -> Mapping[str, Json]:
    return {
        "name": summary.name,
        "root": summary.root or None,
        **picked(summary, "links joints"),
        "joint_types": {kind or "": number for kind, number in summary.types},
        "moving_joints": summary.moving,
        "dof": summary.dof,
        "mimic_joints": summary.mimics,
        "transmissions": summary.transmissions,
        "groups": [{**picked(group, "kind joints mimics base"), "tip": group.tip or None} for group in summary.groups],
        "mass": _finite(summary.mass),
        "moving_links_without_mass": summary.massless,
        "reach": _finite(summary.reach),
        **picked(summary, "meshes meshes_found"),
    }


def _finite(value: float) -> float | None:
    return round(value, 9) if abs(value) < 1e300 else None
