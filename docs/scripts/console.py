"""Pages whose commands run: `python docs/scripts/console.py [--write] PAGE...`.

A fence of the language `console` holds commands after `$ ` and what a terminal shows for them, stdout and stderr in
their order. A fence with a title is a file, which is written when the page reaches it: ```yaml title="tasks/mine.yaml".
A page runs from top to bottom in one shell, in a fresh folder, with this Python's programs first on PATH.

- A command that ends with a backslash goes on in the next line.
- A line of only `...` matches any lines. Numbers that the clock decides match each other (`CLOCK`), nothing else does.
- A command that fails is followed by `[exit status 1]`.
- `<!-- console: after 1_first.md -->` goes on where that page ends: its folder, its shell.
- `<!-- console: with tasks robots -->` begins with copies of these folders of the project.

`--write` puts the real output into the pages, and the pictures that commands made beside the pages that show them.
Without it, the exit code is 1 if an output differs.
"""

from __future__ import annotations

import difflib
import os
import re
import secrets
import shlex
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

ROOT: Final = Path(__file__).parents[2]
HOME: Final = "/home/you"
"""What pages show as the folder in which they run."""
PATIENCE: Final = 300.0
"""[s] A command that takes longer is ended."""
CLOCK: Final = (
    (re.compile(r"\d+(\.\d+)? s real\b"), "0 s real"),
    (re.compile(r"\d+(\.\d+)? x real time"), "0 x real time"),
    (re.compile(r"(::\S+) +\d+\.\d+ s\b"), r"\1 0 s"),
    (re.compile(r"\b(passed|failed|invalid|crashed) in \d+(\.\d+)? s\b"), r"\1 in 0 s"),  # of `manipcli test`
    (re.compile(r"=+ (.*) in \d+\.\d+s =+"), r"\1 in 0 s"),  # of pytest
)
"""Times that differ from run to run, and what they are compared as."""
ELSEWHERE: Final = 0.25
"""Share by which numbers of a simulation differ on a processor that rounds differently."""
NOISE: Final = 0.02
"""Numbers below are equal where numbers may differ: angles and distances of things at rest."""
COUNTS: Final = 100
"""Whole numbers below are counts, of steps or samples."""
LARGEST_PICTURE: Final = 80_000
"""[bytes]"""

_FENCE = re.compile(r"^( *)(`{3,})([\w+-]*)(.*)$")
_TITLE = re.compile(r"""\btitle=(["'])(.+?)\1""")
_DIRECTIVE = re.compile(r"<!-- console: (after|with) (.+?) -->")
_PICTURE = re.compile(r"!\[[^\]]*\]\(([^)#?:]+)\)")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\w)")
_STATUS = re.compile(r"^\[exit status (\d+)\]$")


@dataclass(frozen=True)
class Fence:
    """A fence of a page: its language, its title, its lines without their indentation, the index of the first one."""

    language: str
    title: str | None
    lines: tuple[str, ...]
    first: int
    indent: str


@dataclass(frozen=True)
class Command:
    """A command of a page, the output that the page shows, and the indices of these lines: from `first` to `last`."""

    text: str
    shown: tuple[str, ...]
    first: int
    last: int
    indent: str


@dataclass(frozen=True)
class Ran:
    """A command, and the lines that it printed."""

    command: Command
    printed: tuple[str, ...]

    def agrees(self, share: float = 0.0) -> bool:
        """Whether the page shows this; `share`: see `matches`."""
        return matches(self.command.shown, self.printed, share=share)


class PageError(Exception):
    """A page cannot be run."""


def fences(text: str) -> Iterator[Fence]:
    """All fences of a page, in order."""
    lines = text.splitlines()
    start = 0
    while start < len(lines):
        opened = _FENCE.match(lines[start])
        start += 1
        if opened is None:
            continue
        indent, marks, language, rest = opened.groups()
        end = start
        while end < len(lines) and lines[end].strip() != marks:
            end += 1
        title = _TITLE.search(rest)
        body = tuple(line.removeprefix(indent) for line in lines[start:end])
        yield Fence(language, title[2] if title else None, body, start, indent)
        start = end + 1


def commands(fence: Fence) -> list[Command]:
    """The commands of a `console` fence.

    Raises:
        PageError: the fence does not begin with a command.
    """
    found: list[Command] = []
    starts = [index for index, line in enumerate(fence.lines) if line.startswith("$ ")]
    if starts[:1] != [0]:
        raise PageError(f"line {fence.first + 1}: a console fence begins with `$ ` and a command")
    for start, end in zip(starts, [*starts[1:], len(fence.lines)], strict=True):
        last = start
        while fence.lines[last].endswith("\\") and last + 1 < end:
            last += 1
        text = "\n".join([fence.lines[start][2:], *fence.lines[start + 1 : last + 1]])
        span = fence.first + last + 1, fence.first + end
        found.append(Command(text, fence.lines[last + 1 : end], *span, fence.indent))
    return found


def matches(shown: Sequence[str], printed: Sequence[str], *, share: float = 0.0) -> bool:
    """Whether a page shows what was printed: `...` is any lines but an exit status, times are equal.

    Args:
        shown, printed: lines.
        share: by which numbers may differ, of the larger one. Spaces may then differ, too.
    """
    if _status(shown) != _status(printed):
        return False
    ends = {0}  # how many of the printed lines the shown ones so far can be
    for line in shown:
        if line == "...":
            ends = {*range(min(ends, default=len(printed) + 1), len(printed) + 1)}
        else:
            ends = {end + 1 for end in ends if end < len(printed) and _same(line, printed[end], share)}
    return len(printed) in ends


def _same(one: str, other: str, share: float) -> bool:
    one, other = _timeless(one), _timeless(other)
    if one == other or not share:
        return one == other
    words = [" ".join(_NUMBER.sub(" # ", text).split()) for text in (one, other)]
    numbers = zip(_NUMBER.findall(one), _NUMBER.findall(other), strict=False)
    return words[0] == words[1] and all(_close(a, b, share) for a, b in numbers)


def _close(one: str, other: str, share: float) -> bool:
    """Whether two numbers may be those of two processors; counts are equal."""
    larger = max(abs(float(one)), abs(float(other)))
    if larger < COUNTS and "." not in one + other:
        return one == other
    return larger < NOISE or abs(float(one) - float(other)) <= share * larger


def _timeless(line: str) -> str:
    for pattern, value in CLOCK:
        line = pattern.sub(value, line)
    return line.rstrip()


def _status(lines: Sequence[str]) -> tuple[str, ...]:
    return tuple(line for line in lines[-1:] if _STATUS.match(line))


def renewed(shown: Sequence[str], printed: Sequence[str]) -> list[str]:
    """What a page shows after a change of the output: the lines most like the old ones, with the same `...`."""
    if matches(shown, printed):
        return [*shown]
    if "..." not in shown:
        return [*printed]
    status = _status(printed)
    printed = printed[: len(printed) - len(status)]
    parts: list[list[str]] = [[]]
    for line in shown[: len(shown) - len(_status(shown))]:
        if line == "...":
            parts.append([])
        else:
            parts[-1].append(line)
    kept: list[str] = []
    begin = 0
    for number, part in enumerate(parts):
        spare = len(printed) - len(part)
        if number == 0:
            places = range(1)
        elif number == len(parts) - 1:
            places = range(max(begin, spare), max(begin, spare) + 1)
        else:
            places = range(begin, max(begin, spare) + 1)
        begin = max(places, key=lambda place: (_likeness(part, printed[place : place + len(part)]), -place))
        kept += ["..."] * (number > 0) + [*printed[begin : begin + len(part)]]
        begin += len(part)
    return [*kept, *status]


def _likeness(one: Sequence[str], other: Sequence[str]) -> float:
    return sum(difflib.SequenceMatcher(None, a, b).ratio() for a, b in zip(one, other, strict=False))


class Shell:
    """One bash in a folder: directory, variables and background jobs last from command to command."""

    def __init__(self, folder: Path) -> None:
        kept = {
            name: value for name, value in os.environ.items() if not re.match("MANIPCLI_|PYTEST_|FORCE_COLOR", name)
        }
        cache = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))  # matplotlib takes seconds without it
        programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
        own = {"PATH": programs, "HOME": str(folder), "XDG_CACHE_HOME": cache, "COLUMNS": "100", "NO_COLOR": "1"}
        self._process = subprocess.Popen(
            ["bash", "--noprofile", "--norc"],
            cwd=folder,
            env=kept | own | {"LC_ALL": "C.UTF-8", "TERM": "dumb"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            encoding="utf-8",
            errors="replace",
        )
        self.folder = self.directory = folder

    def run(self, text: str) -> tuple[str, ...]:
        """The lines that a command prints, and its exit status if that is not 0.

        Raises:
            PageError: it took too long, or it ended the shell.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        end = secrets.token_hex(8)
        self._process.stdin.write(f'eval {shlex.quote(text)} </dev/null\nprintf \'\\n{end} %d %s\\n\' "$?" "$PWD"\n')
        self._process.stdin.flush()
        timer = threading.Timer(PATIENCE, self.close)
        timer.start()
        printed = ""
        for line in self._process.stdout:
            if line.startswith(end):
                break
            printed += line
        else:
            raise PageError(f"`{text}` ended the shell, or took more than {PATIENCE:g} s")
        timer.cancel()
        _, status, directory = line.rstrip("\n").split(" ", 2)
        self.directory = Path(directory)
        printed = re.sub(r"^bash: line \d+: ", "bash: ", printed.removesuffix("\n"), flags=re.MULTILINE)
        lines = [line.rstrip() for line in printed.replace(str(self.folder), HOME).splitlines()]
        return (*lines, *([f"[exit status {status}]"] if status != "0" else []))

    def write(self, title: str, lines: Sequence[str]) -> None:
        """Writes a file of the page, relative to the directory of the shell.

        Raises:
            PageError: it is outside the folder of the page.
        """
        path = (self.directory / title).resolve()
        if not path.is_relative_to(self.folder.resolve()):
            raise PageError(f"'{title}' is outside the folder of the page")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")

    def close(self) -> None:
        """Ends the shell and what it still runs."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


def before(page: Path) -> list[Path]:
    """The pages that a page goes on from, the first one first, and the page itself."""
    for kind, value in _DIRECTIVE.findall(page.read_text(encoding="utf-8")):
        if kind == "after":
            return [*before(page.parent / value), page]
    return [page]


def run(page: Path, *, write: Sequence[Path] = ()) -> dict[Path, list[Ran]]:
    """Runs a page and those before it in a fresh folder; gives the commands of each. Updates the pages in `write`.

    Raises:
        PageError: a page cannot be run, or a picture that it shows is too large.
    """
    done: dict[Path, list[Ran]] = {}
    with TemporaryDirectory(prefix="page-", ignore_cleanup_errors=True) as temporary:
        folder = Path(temporary).resolve() / "you"
        folder.mkdir()
        shell = Shell(folder)
        try:
            for each in before(page):
                text = each.read_text(encoding="utf-8")
                done[each] = list(_run(text, shell))
                for made, shown in _pictures(text, each.parent, folder):
                    if each in write:
                        _copy(made, shown)
                    if shown.exists() and shown.stat().st_size > LARGEST_PICTURE:
                        raise PageError(f"{shown.name} has {shown.stat().st_size} bytes, more than {LARGEST_PICTURE}")
                if each in write:
                    each.write_text(_rewritten(text, done[each]), encoding="utf-8")
        except PageError as error:
            raise PageError(f"{each}: {error}") from None
        finally:
            shell.close()
    return done


def _run(text: str, shell: Shell) -> Iterator[Ran]:
    for kind, value in _DIRECTIVE.findall(text):
        for name in value.split() if kind == "with" else ():
            shutil.copytree(ROOT / name, shell.folder / name)
    for fence in fences(text):
        if fence.language == "console":
            for command in commands(fence):
                yield Ran(command, shell.run(command.text))
        elif fence.title is not None:
            shell.write(fence.title, fence.lines)


def _pictures(text: str, beside: Path, folder: Path) -> Iterator[tuple[Path, Path]]:
    """The pictures that a page shows and a command made: the made file, and the shown one."""
    for link in _PICTURE.findall(text):
        for made in sorted(folder.rglob(Path(link).name))[:1]:
            yield made, beside / link


def _copy(made: Path, shown: Path) -> None:
    """Copies a picture; a PNG with 128 colours, which makes it three times smaller."""
    if made.suffix != ".png":
        shutil.copy(made, shown)
        return
    from PIL import Image

    with Image.open(made) as picture:
        picture.convert("RGB").quantize(128, dither=Image.Dither.NONE).save(shown, optimize=True)


def _rewritten(text: str, ran: Sequence[Ran]) -> str:
    lines = text.splitlines()
    for one in reversed(ran):
        shown = renewed(one.command.shown, one.printed)
        lines[one.command.first : one.command.last] = [f"{one.command.indent}{line}".rstrip() for line in shown]
    return "".join(f"{line}\n" for line in lines)


def differences(page: Path, ran: Sequence[Ran], *, share: float = 0.0) -> list[str]:
    """One text for each command whose output is not the one that the page shows; `share`: see `matches`."""
    return [
        "\n".join(
            [
                f"{page}:{one.command.first}: $ {one.command.text}",
                *difflib.unified_diff(one.command.shown, one.printed, "shown", "printed", n=1, lineterm=""),
            ]
        )
        for one in ran
        if not one.agrees(share)
    ]


def main(words: Sequence[str]) -> int:
    """Runs the pages; the exit code."""
    pages = [Path(word) for word in words if word != "--write"]
    write = pages if "--write" in words else []
    code = 0
    for page in pages:
        if any(page in before(other)[:-1] for other in pages):
            continue  # it runs with the page that goes on from it
        try:
            for each, ran in run(page, write=write).items():
                found = differences(each, ran) if each in pages else []
                print(f"{each}: {len(ran)} commands, {len(found)} differ{' (written)' if write and found else ''}")
                if not write:
                    print("\n".join(found))
                    code = code or bool(found)
        except PageError as error:
            print(error)
            code = 1
    return int(code)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
