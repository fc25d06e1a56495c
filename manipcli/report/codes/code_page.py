"""What every code of a finding means, with a faulty and a sound example: for `manipcli explain CODE` and the docs.

The texts are in one TOML file per area beside this module: `task.toml` has TASK200 and the others. Checks of
descriptions bring title, reason and the faulty example themselves (`description/lint/checks/`).
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Final, Literal, cast, get_args

from manipcli.description.lint.checks import CHECKS
from manipcli.report.codes.xml_lines import broken

Kind = Literal["task", "robot", "controllers", "urdf", "xacro", "srdf", "command", "python", "situation"]
"""What an example is: keys of a file, which stand in a complete one; a whole description; a command line; Python; or
words."""

_LANGUAGE: Final[Mapping[str, str]] = {
    "task": "yaml", "robot": "yaml", "controllers": "yaml", "urdf": "xml", "xacro": "xml", "srdf": "xml",
    "command": "sh", "python": "python", "situation": "text",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class CodePage:
    """One code.

    Attributes:
        code: `TASK203`.
        title: the defect in a few words.
        what: when it is reported.
        why: what would go wrong without it, or why it is a rule.
        kind: what the examples are.
        bad: an example that gets the code; "" for none.
        good: the same without the defect; "" for none.
        files: further files of the examples, by path relative to them.
    """

    code: str
    title: str
    what: str
    why: str
    kind: Kind
    bad: str
    good: str
    files: Mapping[str, str] = field(default_factory=dict)


@cache
def code_pages() -> dict[str, CodePage]:
    """The pages of all codes, in their order."""
    found: dict[str, CodePage] = {
        check.code: CodePage(
            check.code, check.summary, "", check.reason, _kind_of(check.bad), broken(check.bad, width=0), ""
        )
        for check in CHECKS
    }
    for file in files("manipcli.report.codes").iterdir():
        if file.name.endswith(".toml"):
            for code, table in tomllib.loads(file.read_text(encoding="utf-8")).items():
                found[code] = _page(code, table, found.get(code))
    return dict(sorted(found.items()))


def _kind_of(description: str) -> Kind:
    return "xacro" if "xacro" in description else "urdf"


def _page(code: str, table: Mapping[str, object], before: CodePage | None) -> CodePage:
    """A page of a TOML table; what the table lacks is that of `before`."""
    kind = table.get("kind", before.kind if before is not None else "situation")
    assert kind in get_args(Kind), f"{code}: kind = {kind!r}"
    texts = {
        name: str(table.get(name, getattr(before, name, ""))).strip("\n")
        for name in ("title", "what", "why", "bad", "good")
    }
    return CodePage(code, kind=cast(Kind, kind), files=cast(Mapping[str, str], table.get("files", {})), **texts)


def similar(code: str) -> tuple[str, ...]:
    """All codes of the same area; all codes for an unknown area."""
    area = "".join(re.findall("^[A-Z]+", code.upper()))
    return tuple(each for each in code_pages() if re.sub(r"\d+$", "", each) == area) or tuple(code_pages())


def render_text(page: CodePage) -> str:
    """The page for a terminal."""
    blocks = [f"{page.code}: {page.title}", page.what, page.why]
    for title, example in ((f"This raises {page.code}:", page.bad), ("This is right:", page.good)):
        if example:
            blocks.append(_indented(title, example))
    blocks += [_indented(f"with {name}:", text.strip()) for name, text in page.files.items()]
    return "\n\n".join(block for block in blocks if block)


def _indented(title: str, text: str) -> str:
    return "\n".join([title, *(f"    {line}".rstrip() for line in text.split("\n"))])


def render_markdown(page: CodePage) -> str:
    """The page for the docs."""
    blocks = [f"# {page.code}: {page.title}", page.what, page.why]
    for title, example in ((f"This raises {page.code}:", page.bad), ("This is right:", page.good)):
        if example:
            blocks.append(f"{title}\n\n```{_LANGUAGE[page.kind]}\n{example}\n```")
    for name, text in page.files.items():
        blocks.append(f"with `{name}`:\n\n```\n{text.strip()}\n```")
    return "\n\n".join(block for block in blocks if block) + "\n"
