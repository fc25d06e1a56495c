"""Text of messages: nearest known names, lists of names, escaping for terminals."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Iterable
from pathlib import PurePath

_UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Unicode categories: control, format (direction marks, zero-width spaces), surrogates, line separators."""
_LONG_WORD = re.compile(r"\S{241,}")
_SHORT = {"\n": "\\n", "\t": "\\t", "\r": "\\r"}


def nearest(name: str, known: Iterable[str], *, most: int = 1) -> tuple[str, ...]:
    """Up to `most` of the `known` names similar to `name`, nearest first; empty if none is similar.

    Case is ignored, so `Home` finds `home`; names of one or two letters match only by case or as a prefix.
    """
    names = list(dict.fromkeys(known))
    folded: dict[str, list[str]] = {}
    for candidate in names:
        folded.setdefault(candidate.casefold(), []).append(candidate)
    found: list[str] = []
    wanted = name.casefold()
    for close in difflib.get_close_matches(wanted, list(folded), n=most, cutoff=0.6):
        found.extend(folded[close])
    if len(found) < most and len(wanted) >= 2:
        found.extend(c for c in names if c not in found and _begins(c.casefold(), wanted))
    return tuple(found[:most])


def _begins(name: str, other: str) -> bool:
    return bool(name) and (name.startswith(other) or (len(name) >= 2 and other.startswith(name)))


def nearest_file(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """The `known` file most similar to `name`, at most one; a common suffix does not count as similarity."""
    names = list(known)
    stems = {PurePath(file).stem: file for file in names if PurePath(file).suffix == PurePath(name).suffix}
    alike = tuple(stems[stem] for stem in nearest(PurePath(name).stem, stems))
    return alike or nearest(name, [file for file in names if file not in stems.values()])


def did_you_mean(name: str, known: Iterable[str], *, kind: str = "known", most: int = 1) -> str | None:
    """The hint for an unknown name: the nearest of `known`, else the list of known names; None without known names.

    Args:
        name: the given name.
        known: the valid names.
        kind: plural of what the names are ("verbs", "joints"); the title of the list.
        most: maximum number of near names.
    """
    names = list(dict.fromkeys(known))
    close = nearest(name, names, most=most)
    if close:
        return f"did you mean {any_of(close)}?"
    return f"{kind}: {listed(names)}" if names else None


def any_of(names: Iterable[str]) -> str:
    """`'a', 'b' or 'c'`."""
    quoted = [f"'{escape(name)}'" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} or {quoted[-1]}"


def listed(names: Iterable[str], *, most: int = 12) -> str:
    """`a, b, c`; beyond `most` names, the number of the rest."""
    every = [escape(name) for name in names]
    rest = len(every) - most
    return ", ".join(every[:most]) + (f", and {rest} more" if rest > 0 else "")


def number_of(number: int, noun: str) -> str:
    """`1 file`, `2 files`, `2 processes`."""
    return f"{number} {noun}{'' if number == 1 else 'es' if noun.endswith('s') else 's'}"


def escape(text: str) -> str:
    r"""`text` on one line, with control and format characters escaped as `\x1b`, `\u202e`."""
    if text.isprintable():
        return text
    return "".join(_escaped(c) if unicodedata.category(c) in _UNSEEN else c for c in text)


def _escaped(character: str) -> str:
    code = ord(character)
    numeric = f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
    return _SHORT.get(character) or numeric


def one_line(text: str) -> str:
    """`text`, escaped, with the middle of words of more than 240 characters replaced by `...`."""
    return _LONG_WORD.sub(lambda match: f"{match.group()[:160]}...{match.group()[-60:]}", escape(text))


def shorten(text: str, *, width: int = 60) -> str:
    """`text`, escaped, and truncated with `...` if longer than `width`."""
    return _cut(escape(text), width)


def shorten_apart(first: str, second: str, *, width: int = 60) -> tuple[str, str]:
    """Both texts shortened; if they would look the same, both begin with `...` just before their first difference."""
    a, b = escape(first), escape(second)
    same = next((k for k, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    start = same - width // 3 if max(len(a), len(b)) > width and same > width // 2 else 0
    begins = "..." if start else ""
    return _cut(begins + a[start:], width), _cut(begins + b[start:], width)


def _cut(line: str, width: int) -> str:
    return line if len(line) <= width else line[: width - 3] + "..."


def digits(value: float) -> str:
    """Three significant digits, without exponent from 1e-4 to 1e5: `6000`, `0.084`, `164`."""
    return f"{float(f'{value:.3g}'):.5g}"


def distinguished(value: float, other: float, *, form: str = ".4g") -> tuple[str, str]:
    """Both numbers as text, with more digits than `form` where different numbers would look the same."""
    least, kind = int(form[1:-1]), form[-1]
    for many in range(least, least + 16):
        first, second = f"{value:.{many}{kind}}", f"{other:.{many}{kind}}"
        if first != second:
            break
    else:
        first, second = f"{value:{form}}", f"{other:{form}}"
    return first, second
