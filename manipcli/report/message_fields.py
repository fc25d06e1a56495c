"""Fields of ROS messages as plain values: one field by its path, and all numbers and texts as columns of a table."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, shorten

_PART: Final = re.compile(r"(?:^|\.)([A-Za-z]\w*)|\[(\d+)\]")


class FieldPath:
    """The path of a field, such as `points[0].positions`.

    Raises:
        InvalidInput: USE160 it is not a path.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        parts: list[str | int] = []
        end = 0
        while end < len(text):
            found = _PART.match(text, end)
            if found is None:
                break
            parts.append(found[1] if found[1] is not None else int(found[2]))
            end = found.end()
        if end < len(text) or not parts or isinstance(parts[0], int):
            message = f"'{shorten(text)}' is not the path of a field"
            raise InvalidInput([Diagnostic("USE160", message, hint="write position, position[0] or header.stamp.sec")])
        self._parts = parts

    def of(self, message: object) -> object:
        """The field of a message.

        Raises:
            InvalidInput: USE161 the message has no such field.
        """
        found, path = message, ""
        for part in self._parts:
            if isinstance(part, int):
                if not isinstance(found, list) or part >= len(found):
                    size = f"has {len(found)} elements" if isinstance(found, list) else "is not a list"
                    raise InvalidInput([Diagnostic("USE161", f"'{path}' {size}; there is no [{part}]")])
                found, path = found[part], f"{path}[{part}]"
            else:
                if not isinstance(found, dict) or part not in found:
                    where = f"'{path}'" if path else "the message"
                    hint = did_you_mean(part, found, kind="fields") if isinstance(found, dict) else None
                    raise InvalidInput([Diagnostic("USE161", f"{where} has no field '{part}'", hint=hint)])
                found, path = found[part], f"{path}.{part}" if path else part
        return found


def columns(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Name and value of each number and text below a value: `header.stamp.sec`, `position[0]`."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from columns(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from columns(item, f"{path}[{k}]")
    else:
        yield path, value


class CsvTable:
    """Lines of comma-separated values, after a line with the names of the columns.

    Args:
        path: prefix of the names; "" for whole messages.
    """

    def __init__(self, path: str = "") -> None:
        self._path = path
        self._names: list[str] = []

    def lines(self, value: object) -> list[str]:
        """The line of a message; for the first one also the names. NaN, null in JSON, is empty.

        Raises:
            InvalidInput: USE162 other columns than those of the first message.
        """
        found = dict(columns(value, self._path))
        first = not self._names
        if first:
            self._names = [*found]
        elif [*found] != self._names:
            raise InvalidInput([self._other(found.keys() ^ set(self._names))])
        return [*([_line(self._names)] if first else []), _line([*found.values()])]

    def _other(self, names: set[str]) -> Diagnostic:
        message = f"a message has other columns than the first one, such as '{sorted(names)[0]}'"
        return Diagnostic("USE162", message, hint="print a part with --field, or all without --csv")


def _line(values: Sequence[object]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(
        [("true" if value else "false") if isinstance(value, bool) else value for value in values]
    )
    return text.getvalue()
