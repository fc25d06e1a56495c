"""Defaults of options from a file: `manipcli.toml`, or the table `tool.manipcli` of `pyproject.toml`.

    package-path = ["vendor"]     # for every command that has the option

    [test]
    samples = 10

    [topic.echo]                  # a command with a sub-command
    url = "ws://robot.lan:9090"

The nearest such file of the working directory and the folders above is read. It may come with somebody's task, so it
cannot lift a protection, and its paths, relative to it, stay below its folder.
"""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, get_args, get_origin

from typer.models import OptionInfo

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import did_you_mean, escape, shorten

OWN: Final = "manipcli.toml"
PROJECT: Final = "pyproject.toml"
REFUSED: Final = ("force", "allow-outside", "allow-env", "help", "version")
"""Options that a person gives: they lift a protection."""
LARGEST: Final = 1_000_000
"""[bytes] A larger file is not read."""


WITHOUT: Final = "MANIPCLI_NO_DEFAULTS"
"""The environment variable with which no such file is read."""

Commands = Mapping[str, Callable[..., object]]


@dataclass(frozen=True, slots=True)
class Option:
    """An option of a command: the name of its parameter, and whether it is a flag, repeatable, or a path."""

    parameter: str
    flag: bool
    repeatable: bool
    path: bool


def options_of(command: Callable[..., object]) -> dict[str, Option]:
    """The options of a command, by name without `--`; by its letter where an option has no other name."""
    found = {}
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        kind, *marks = get_args(parameter.annotation) or (None,)
        for mark in marks:
            if isinstance(mark, OptionInfo):
                kinds = {kind, *get_args(kind)}
                kinds |= {inner for each in kinds for inner in get_args(each)}
                repeatable = any(get_origin(each) is list for each in kinds)
                option = Option(parameter.name, kind is bool, repeatable, Path in kinds)
                words = [
                    word.lstrip("-") for word in (mark.default, *(mark.param_decls or ())) if isinstance(word, str)
                ]
                long = [word for word in words if len(word) > 1]
                found.update(dict.fromkeys(long or words, option))
    return found


@dataclass(frozen=True, slots=True)
class OptionDefaults:
    """The defaults of one command.

    Attributes:
        values: by parameter.
        told: a line for each: `--samples 10 (manipcli.toml:5)`.
    """

    values: Mapping[str, object]
    told: tuple[str, ...] = ()


def defaults_of(command: str, commands: Commands, *, folder: Path) -> OptionDefaults:
    """The defaults of `command` in the file that applies in `folder`; none without a file.

    Args:
        command: its name.
        commands: all commands, by name.
        folder: the working directory.

    Raises:
        InvalidInput: all errors of the file.
    """
    file = next((found for place in (folder, *folder.parents) if (found := _file(place)) is not None), None)
    if file is None:
        return OptionDefaults({})
    file = replace(file, table=dict(_sections(file.table, commands)))
    return _Reader(file, {name: options_of(function) for name, function in commands.items()}).read(command)


def _file(folder: Path) -> _File | None:
    """The file in this folder, if it has one with our settings."""
    for name in (OWN, PROJECT):
        path = folder / name
        try:
            if not path.is_file() or path.stat().st_size > LARGEST:
                continue
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            continue
        if name == PROJECT and "tool.manipcli" not in text:
            continue
        import tomllib  # only where there is a file: 5 ms

        try:
            table: object = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            raise InvalidInput([_syntax(path, str(error))]) from None
        if name == PROJECT:
            table = table.get("tool", {}) if isinstance(table, dict) else {}
            table = table.get("manipcli") if isinstance(table, dict) else None
        if isinstance(table, dict):
            return _File(path, text, table)
    return None


def _sections(table: Mapping[str, Any], commands: Commands) -> Iterator[tuple[str, Any]]:
    """The entries of a file; the table of a sub-command, `[topic.echo]`, becomes the section `topic echo`."""
    for key, value in table.items():
        names = [name for name in value if f"{key} {name}" in commands] if isinstance(value, dict) else []
        yield from ((f"{key} {name}", value[name]) for name in names)
        if not names:
            yield key, value
        elif others := {name: each for name, each in value.items() if name not in names}:
            yield key, others


def _syntax(path: Path, cause: str) -> Diagnostic:
    where = re.search(r"\(at line (\d+), column (\d+)\)", cause)
    line, column = (int(where[1]), int(where[2])) if where else (0, 0)
    message = re.sub(r" \(at .*\)$", "", cause) or "nested too deeply"
    return Diagnostic("USE093", f"not TOML: {message}", Place(str(path), line, column))


@dataclass(frozen=True, slots=True)
class _File:
    path: Path
    text: str
    table: Mapping[str, Any]

    def place(self, section: str, key: str) -> Place:
        """Place of a key, by a search in the text; `tomllib` tells none."""
        at = ""
        for number, line in enumerate(self.text.splitlines(), 1):
            head = re.fullmatch(r"\s*\[\s*(?:tool\.manipcli)?\.?([\w.-]*)\s*\]\s*(?:#.*)?", line)
            at = head[1].replace(".", " ") if head is not None else at
            entry = re.match(rf"""(\s*)["']?{re.escape(key)}["']?\s*=""", line)
            if entry is not None and at == section:
                return Place(str(self.path), number, len(entry[1]) + 1)
            if head is not None and not section and at == key:
                return Place(str(self.path), number, line.index(key) + 1)
        return Place(str(self.path), 1, 1)


class _Reader:
    def __init__(self, file: _File, options: Mapping[str, Mapping[str, Option]]) -> None:
        self._file = file
        self._options = options
        self._errors: list[Diagnostic] = []

    def read(self, command: str) -> OptionDefaults:
        """
        Raises:
            InvalidInput: all errors.
        """
        everywhere = {name for options in self._options.values() for name in options}
        values: dict[str, object] = {}
        told: dict[str, str] = {}
        for section, key, value in self._entries(everywhere):
            owners = [section] if section else [name for name, own in self._options.items() if key in own]
            option = self._options[owners[0]].get(key)
            if option is None:
                hint = did_you_mean(key, self._options[section], kind="options")
                self._error(section, key, f"`manipcli {section}` has no option --{escape(key)}", hint)
                continue
            read = self._value(section, key, value, option)
            if command in owners and read is not None:
                values[option.parameter] = read
                place = self._file.place(section, key)
                told[option.parameter] = f"--{key} {shorten(str(value))} ({place.file}:{place.line})"
        if self._errors:
            raise InvalidInput(self._errors)
        return OptionDefaults(values, tuple(told.values()))

    def _entries(self, everywhere: Collection[str]) -> Iterator[tuple[str, str, object]]:
        """Section ("" for every command), option and value, those for every command first."""
        for key, value in self._file.table.items():
            if isinstance(value, dict) and key in self._options:
                continue
            if key in REFUSED:
                self._error(
                    "", key, f"--{key} cannot be set here: it lifts a protection", "give it on the command line"
                )
            elif key not in everywhere:
                known = [*everywhere, *self._options]
                hint = did_you_mean(key, known)
                if key == "tool" and self._file.path.name == OWN:
                    hint = f"in {OWN} write `[check]` instead of `[tool.manipcli.check]`"
                self._error("", key, f"there is no option or command '{escape(key)}'", hint)
            else:
                yield "", key, value
        for section, table in self._file.table.items():
            for key, value in table.items() if isinstance(table, dict) and section in self._options else ():
                if key in REFUSED:
                    self._refused(section, key)
                else:
                    yield section, key, value

    def _value(self, section: str, key: str, value: object, option: Option) -> object:
        """The value as the parser of options takes it; None if it is refused."""
        items = value if isinstance(value, list) else [value]
        if isinstance(value, list) and not option.repeatable:
            self._error(section, key, f"--{key} takes one value, not a list")
        elif any(isinstance(item, (dict, list)) or not isinstance(item, (str, int, float)) for item in items):
            self._error(section, key, f"--{key} takes text, a number or true/false")
        elif option.flag != isinstance(value, bool):
            self._error(section, key, f"--{key} is {'true or false' if option.flag else 'not a flag'}, not {value!r}")
        elif option.path:
            paths = [self._path(section, key, str(item)) for item in items]
            return None if None in paths else paths if option.repeatable else paths[0]
        elif option.flag:
            return value
        else:
            return [str(item) for item in items] if option.repeatable else str(value)
        return None

    def _path(self, section: str, key: str, word: str) -> str | None:
        folder = Path(os.path.realpath(self._file.path.parent))
        try:
            path = Path(os.path.realpath(folder / word))
            below = path.is_relative_to(folder)
        except (OSError, ValueError):
            below = False
        if not below:
            hint = f"put the file that names it into a folder above, or give --{key} on the command line"
            self._error(section, key, f"'{shorten(word)}' is not below '{folder}'", hint)
            return None
        return str(path)

    def _refused(self, section: str, key: str) -> None:
        message = f"--{key} cannot be set here: it lifts a protection"
        self._error(section, key, message, "give it on the command line")

    def _error(self, section: str, key: str, message: str, hint: str | None = None) -> None:
        self._errors.append(Diagnostic("USE093", message, self._file.place(section, key), hint=hint))
