"""Writes the names of docs/reference/python.md from the docstrings and types of `manipcli.__all__`.

They are between `<!-- begin of names -->` and `<!-- end of names -->`; the text and the examples around them stay.

python docs/scripts/write_python.py
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import manipcli
from manipcli.task.load_task import FileOptions, LoadOptions

PAGE: Final = Path(__file__).parents[1] / "reference" / "python.md"
_NAMES: Final = re.compile(r"(<!-- begin of names -->\n).*(<!-- end of names -->)", re.DOTALL)
_SECTION: Final = re.compile(r"^(Args|Attributes|Returns|Raises):$")
_OPTIONS: Final[dict[str, tuple[type, ...]]] = {
    "FileOptions": (FileOptions,),
    "LoadOptions": (FileOptions, LoadOptions),
}
_SAMPLE: Final = "index of a sample of `vary:`, from 0; None for the task as written, or `sample:` of the file."
_KINDS: Final = ("Functions", "Classes", "Errors")


def page() -> str:
    """The whole text."""
    return renewed(PAGE.read_text(encoding="utf-8")).rstrip("\n")


def renewed(text: str) -> str:
    """The text of the page with its names as the code has them."""
    names = re.sub(r"\n{3,}", "\n\n", "\n".join(line for kind in _KINDS for line in _kind(kind))).strip()
    return _NAMES.sub(lambda found: f"{found[1]}\n{names}\n\n{found[2]}", text)


def _kind(kind: str) -> Iterator[str]:
    yield f"## {kind}"
    for name in manipcli.__all__:
        one = getattr(manipcli, name)
        if kind == _kind_of(one):
            yield ""
            yield from _entry(name, one)
    yield ""


def _kind_of(one: object) -> str:
    if not inspect.isclass(one):
        return "Functions"
    return "Errors" if issubclass(one, Exception) else "Classes"


def _entry(name: str, one: Any) -> Iterator[str]:
    yield f"### {name}\n"
    if not inspect.isclass(one):
        yield f"```python\n{_signature(name, one)}\n```\n"
    elif issubclass(one, Exception):
        base = one.__base__
        above = (
            f"`{base.__name__}`" if base and base.__module__ == "builtins" else f"[`{base.__name__}`](#manipclierror)"
        )
        yield f"A subclass of {above}; exit code {int(one.exit_code)}, code `{one.code}`.\n"
    told, sections = _parsed(inspect.getdoc(one) or "")
    if told:
        yield f"{told}\n"
    kind = re.search(r"Unpack\[(\w+)\]", "" if inspect.isclass(one) else str(inspect.signature(one)))
    options = _OPTIONS[kind[1]] if kind else ()
    for title, items in sections:
        if title == "Returns":
            yield f"Returns: {items[0][1]}\n"
            continue
        further = {name: told for block in options for name, told in _attributes(block)}
        rows = [row for row in items if not (options and row[0] == "options")]
        if title == "Args":
            rows = [(name, _SAMPLE if told == "see `LoadOptions`." else told) for name, told in rows]
            rows += further.items()
        head = {"Args": "argument", "Attributes": "attribute", "Raises": "raises"}[title]
        yield _table(head, rows)
    if inspect.isclass(one):
        members = list(_members(one))
        if members:
            yield _table("member", members)


def _signature(name: str, one: Any) -> str:
    """One parameter per line; defaults that are objects of the code are shown as `...`."""
    signature = inspect.signature(one)
    lines = []
    star = False
    for parameter in signature.parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and not star:
            lines.append("*")
            star = True
        text = f"{'**' if parameter.kind is parameter.VAR_KEYWORD else ''}{parameter.name}: {parameter.annotation}"
        if parameter.default is not parameter.empty:
            plain = isinstance(parameter.default, (bool, int, float, str, tuple, type(None)))
            text += f" = {parameter.default!r}" if plain else " = ..."
        lines.append(text)
    inner = "".join(f"    {line},\n" for line in lines)
    return f"{name}(\n{inner}) -> {signature.return_annotation}"


def _members(one: type) -> Iterator[tuple[str, str]]:
    """(name, what it does) of the properties and methods with a docstring."""
    for name, member in vars(one).items():
        called = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
        text = inspect.getdoc(called)
        if name.startswith("_") or not text or not (inspect.isfunction(called) or isinstance(member, property)):
            continue
        first = " ".join(text.split("\n\n")[0].split())
        yield (name if isinstance(member, property) else f"{name}()"), first


def _parsed(text: str) -> tuple[str, list[tuple[str, list[tuple[str, str]]]]]:
    """The text of a docstring without its sections, and (title, [(name, text)]) of each section."""
    told: list[str] = []
    sections: list[tuple[str, list[tuple[str, str]]]] = []
    inside = False
    for line in text.splitlines():
        if found := _SECTION.match(line):
            sections.append((found[1], []))
            inside = True
        elif inside and (not line or line.startswith("    ")):
            items = sections[-1][1]
            words = line.strip()
            if not words:
                continue
            name, colon, rest = words.partition(": ")
            begins = line.startswith("    ") and line[4:5] != " " and colon and sections[-1][0] != "Returns"
            if begins:
                items.append((name, rest))
            elif items:
                items[-1] = (items[-1][0], f"{items[-1][1]} {words}")
            else:
                items.append(("", words))
        else:
            inside = False
            told.append(line)
    return "\n".join(told).strip(), sections


def _attributes(block: type) -> list[tuple[str, str]]:
    """What the docstring of a block of options says of each of them."""
    return next((items for title, items in _parsed(inspect.getdoc(block) or "")[1] if title == "Attributes"), [])


def _table(head: str, rows: list[tuple[str, str]]) -> str:
    lines = [f"| {head} | meaning |", "|---|---|"]
    for names, text in rows:
        code = ", ".join(f"`{name}`" for name in names.split(", "))
        safe = "".join(
            part if k % 2 else part.replace("<", "&lt;").replace("*", "\\*")
            for k, part in enumerate(re.split(r"(`[^`]*`)", text))
        )
        lines.append(f"| {code} | {safe} |".replace("||", "|"))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page() + "\n", encoding="utf-8")
