"""A found change as a task file of its own: the task, whose only sample is the change.

The text of the task stays, with its comments; `vary:`, `sample:`, `task:` and the paths of the robot and the
controllers are replaced. The file is loaded before it gets its name and compared with the task, so that a text that
cannot be edited (flow style, anchors in `vary:`) is found, and written from the values instead.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import escape, shorten
from manipcli.core.whole_file import whole_file
from manipcli.spec.load import read_bytes
from manipcli.spec.resolved import resolved, yaml_text, yaml_word
from manipcli.spec.source.tree import MappingNode, Plain
from manipcli.spec.source.yaml import parse
from manipcli.sweep.journal import changes, identity
from manipcli.task.load_task import WrittenTask, load_written

SUFFIX: Final = "_shrunk"
_KEYS: Final = ("task", "robot", "controllers", "sample", "vary")
"""Keys of the file that may differ from those of the task."""
_LINE: Final = re.compile(r"^([^:]+:\s*)(\"[^\"]*\"|'[^']*'|[^#]*?)(\s+#.*|\s*)$")
"""A key, its value and its comment."""
_LONGEST: Final = 100
"""Characters of the name of a task."""


@dataclass(frozen=True, slots=True)
class TaskFile:
    """A task file to write.

    Attributes:
        written: the task.
        path: where.
        mark: end of the name of the task, `_1`.
    """

    written: WrittenTask
    path: Path
    mark: str = ""

    def write(self, comment: Sequence[str], vary: Mapping[str, Plain], sample: int) -> None:
        """Writes the file, whole or not at all.

        Args:
            comment: lines above it.
            vary: the block with one sample.
            sample: number of this sample.

        Raises:
            InvalidInput: the task cannot be written there: it names a file that is not found from there.
            OSError: the file cannot be written.
        """
        with whole_file(self.path) as partial:
            self._try(partial, comment, vary, sample)

    def check(self, vary: Mapping[str, Plain]) -> None:
        """Writes and removes it.

        Raises:
            InvalidInput, OSError: as `write`.
        """
        partial = self.path.with_name(f".{self.path.name}.{os.getpid()}.partial")
        try:
            self._try(partial, (), vary, 0)
        finally:
            with suppress(OSError):
                partial.unlink()

    def _try(self, partial: Path, comment: Sequence[str], vary: Mapping[str, Plain], sample: int) -> None:
        head = "".join(f"# {escape(line)}".rstrip() + "\n" for line in comment)
        tail = yaml_text({"vary": dict(vary), "sample": sample})
        failure = ""
        for body in (self._edited(), self._from_values()):
            partial.write_text(f"{head}{body}{tail}", encoding="utf-8", newline="\n")
            try:
                there = load_written(partial, **self.written.options)
            except InvalidInput as invalid:
                failure = failure or invalid.findings[0].message
                continue
            if not (found := changes(_known(self.written), _known(there))):
                return
            failure = failure or found
        message = f"'{escape(str(self.path))}' would not be the same task: {shorten(failure, width=160)}"
        hint = f"write it next to the task: -o {self.written.path.with_name(self.path.name)}"
        raise InvalidInput([Diagnostic("USE200", message, hint=hint)])

    @property
    def _values(self) -> dict[str, str]:
        """The values of keys that change."""
        spec, folder = self.written.task.spec, self.written.path.parent
        end = f"{SUFFIX}{self.mark}"
        values = {"task": f"{spec.task[: _LONGEST - len(end)].rstrip(' .')}{end}"}
        moved = os.path.realpath(folder) != os.path.realpath(self.path.parent)
        for key, name in (("robot", spec.robot), ("controllers", spec.controllers)) if moved else ():
            if not Path(name).is_absolute() and "://" not in name:
                values[key] = Path(os.path.relpath(folder / name, self.path.parent)).as_posix()
        return values

    def _edited(self) -> str:
        """The text of the task without `vary:` and `sample:`, with the values that change; "" if it is not in block
        style."""
        data = read_bytes(self.written.path)
        root = parse(data, str(self.written.path))
        lines = data.decode("utf-8-sig").splitlines()
        if not isinstance(root, MappingNode) or any(entry.key_place.column != 1 for entry in root.entries.values()):
            return ""
        rows = sorted(entry.key_place.line - 1 for entry in root.entries.values())
        for key, value in self._values.items():
            if key in root.entries:
                row = root.entries[key].key_place.line - 1
                lines[row] = _LINE.sub(_value(value), lines[row])
        dropped: set[int] = set()
        for key in ("vary", "sample"):
            if key in root.entries:
                row = root.entries[key].key_place.line - 1
                end = next((other for other in rows if other > row), len(lines))
                while end > row + 1 and re.fullmatch(r"\s*(#.*)?", lines[end - 1]):
                    end -= 1  # a comment above the next key is about that key
                dropped |= {*range(row, end)}
        kept = [line for k, line in enumerate(lines) if k not in dropped]
        return "".join(f"{line}\n" for line in kept)

    def _from_values(self) -> str:
        """The task as values with defaults, without comments."""
        spec = self.written.task.spec.model_copy(update={**self._values, "vary": {}, "sample": None})
        return resolved(spec).replace("\nvary: {}\n", "\n")


def _value(text: str) -> Callable[[re.Match[str]], str]:
    """Puts a text in the place of the value in a line, before its comment."""
    return lambda found: f"{found[1]}{yaml_word(text)}{found[3] or ''}"


def _known(written: WrittenTask) -> dict[str, str]:
    """What the results of a task depend on, but for `_KEYS`; meshes by their content."""
    known = identity(written)
    kept = {
        key: value for key, value in known.items() if key.partition(".")[0] not in _KEYS or key.startswith("robot.")
    }
    meshes = sorted(kept.pop(key) for key in [*kept] if key.startswith("mesh "))
    return {**kept, "meshes": " ".join(meshes)}
