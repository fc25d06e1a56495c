"""Text for people: the nearest known name, lists of names, and text that cannot harm a terminal."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Iterable
from pathlib import PurePath

_UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of Unicode: control, format (direction marks, spaces of no width), surrogates, ends of lines."""
_LONG_WORD = re.compile(r"\S{241,}")
_SHORT = {"\n": "\\n", "\t": "\\t", "\r": "\\r"}


def nearest(name: str, known: Iterable[str], *, most: int = 1) -> tuple[str, ...]:
    """Up to `most` of the `known` names that look like `name`, the nearest first; empty when none does.

    Upper and lower case count as equal at first, so that `Home` finds `home`; names of one or two letters match
    only by case or as a prefix.
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


def _begins(one: str, other: str) -> bool:
    return bool(one) and (one.startswith(other) or (len(one) >= 2 and other.startswith(one)))


def nearest_file(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """The one of the `known` files that looks like `name`, if one does: an ending in common is no likeness."""
    names = list(known)
    stems = {PurePath(one).stem: one for one in names if PurePath(one).suffix == PurePath(name).suffix}
    alike = tuple(stems[stem] for stem in nearest(PurePath(name).stem, stems))
    return alike or nearest(name, [one for one in names if one not in stems.values()])


def did_you_mean(name: str, known: Iterable[str], *, kind: str = "known", most: int = 1) -> str | None:
    """The hint for an unknown name: the nearest of `known`, else the known names themselves; None when there are none.

    Args:
        name: what was given.
        known: what would have been right.
        kind: what the names are, in the plural ("verbs", "joints"); begins the list of them.
        most: how many near names to offer.
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
    """`a, b, c` and, beyond `most`, how many more there are."""
    every = [escape(name) for name in names]
    rest = len(every) - most
    return ", ".join(every[:most]) + (f", and {rest} more" if rest > 0 else "")


def number_of(number: int, noun: str) -> str:
    """`1 file`, `2 files`, `2 processes`."""
    return f"{number} {noun}{'' if number == 1 else 'es' if noun.endswith('s') else 's'}"


def escape(text: str) -> str:
    r"""`text` on one line, with what cannot be seen (control and format characters) written as `\x1b`, `\u202e`."""
    if text.isprintable():
        return text
    return "".join(_escaped(c) if unicodedata.category(c) in _UNSEEN else c for c in text)


def _escaped(character: str) -> str:
    code = ord(character)
    numeric = f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
    return _SHORT.get(character) or numeric


def one_line(text: str) -> str:
    """`text`, escaped, with the middle left out of words that nobody reads to their end: names of thousands of
    letters."""
    return _LONG_WORD.sub(lambda match: f"{match.group()[:160]}...{match.group()[-60:]}", escape(text))


def shorten(text: str, *, width: int = 60) -> str:
    """`text`, escaped, and cut in the middle of nowhere with `...` when longer than `width`."""
    return _cut(escape(text), width)


def shorten_apart(one: str, other: str, *, width: int = 60) -> tuple[str, str]:
    """Both as `shorten` has them; where they would look the same then, from `...` shortly before they differ on."""
    a, b = escape(one), escape(other)
    same = next((k for k, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    start = same - width // 3 if max(len(a), len(b)) > width and same > width // 2 else 0
    begins = "..." if start else ""
    return _cut(begins + a[start:], width), _cut(begins + b[start:], width)


def _cut(line: str, width: int) -> str:
    return line if len(line) <= width else line[: width - 3] + "..."


def digits(value: float) -> str:
    """Three digits, and no exponent from 1e-4 to 1e5: `6000`, `0.084`, `164`."""
    return f"{float(f'{value:.3g}'):.5g}"


def told_apart(one: float, other: float, *, form: str = ".4g") -> tuple[str, str]:
    """Both as text, with as many digits more than `form` has as it takes that numbers that differ look different."""
    least, kind = int(form[1:-1]), form[-1]
    for many in range(least, least + 16):
        first, second = f"{one:.{many}{kind}}", f"{other:.{many}{kind}}"
        if first != second:
            break
    else:
        first, second = f"{one:{form}}", f"{other:{form}}"
    return first, second
