"""Building blocks of the page sections: seek buttons, links to lines, bars, tables, numbers."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence

from manipcli.core.units import readable
from manipcli.replay.cause import Written
from manipcli.report.display_quantity import quantity
from manipcli.report.html.markup import Markup, element, joined
from manipcli.report.run_page import Picture


def heading(name: str, title: str, about: str = "") -> Markup:
    """The heading of a section with the anchor `#name`."""
    return joined(element("h2", title, id=name), element("p", about, class_="about") if about else None)


def seek(at: float | None, label: str = "", *, playable: bool = True) -> Markup:
    """A button that seeks the replay to `at` [s]; plain text if the page has no replay."""
    if at is None:
        return joined("–")
    text = label or f"{at:.2f} s"
    if not playable:
        return element("span", text)
    return element("button", f"▸ {text}", type="button", data_seek=f"{at:.6f}", title="show this moment")


def line_link(written: Written) -> Markup | None:
    """Where something is written, as a link to its line on the page."""
    name = written.place or (f"{written.file}:{written.line}" if written.line else "")
    if not name:
        return None
    if not written.line:
        return element("span", name, class_="place")
    return element("a", name, class_="place", href=f"#{anchor(written.file, written.line)}", title="in the files below")


def anchor(file: str, line: int) -> str:
    """The id of a line."""
    return f"{file}-{line}"


def meter(share: float, *, label: str, mark: bool = True) -> Markup:
    """A bar of the used `share` of a limit: filled up to 1, hatched beyond, with a mark at the limit if `mark`."""
    shown = min(max(share, 0.0), 1.25)
    whole = 1.25 if share > 1.0 else 1.0
    parts = [element("i", style=f"width:{100.0 * min(shown, 1.0) / whole:.2f}%")]
    if share > 1.0:
        left, width = 100.0 / whole, 100.0 * (shown - 1.0) / whole
        parts.append(element("i", class_="over", style=f"left:{left:.2f}%;width:{width:.2f}%"))
    if mark:
        parts.append(element("b", style=f"left:{100.0 / whole:.2f}%"))
    return element("span", *parts, class_="meter", role="img", aria_label=label, title=label)


def table(
    headers: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Sequence[str] = (), stacks: bool = False
) -> Markup:
    """A table that scrolls sideways on a narrow page, or with `stacks` becomes a list of its rows.

    Columns named in `numbers` are right-aligned.
    """
    right = [header in numbers for header in headers]
    head = [
        element("th" if name.strip() else "td", name, class_="n" if is_n else None)
        for name, is_n in zip(headers, right, strict=True)
    ]
    body = [
        element(
            "tr",
            *(
                element("td", cell, class_="n" if is_n else None, data_label=header if stacks else None)
                for cell, is_n, header in zip(row, right, headers, strict=True)
            ),
        )
        for row in rows
    ]
    whole = element("table", element("thead", element("tr", *head)), element("tbody", *body))
    # What scrolls takes the focus, so that keys scroll it.
    return element(
        "div", whole, class_="scroll stacks" if stacks else "scroll", tabindex="0", role="group", aria_label="table"
    )


def image(picture: Picture, label: str) -> Markup:
    """A picture embedded in the page."""
    data = base64.b64encode(picture.data).decode()
    width, height = picture.size
    return element("img", src=f"data:image/webp;base64,{data}", alt=label, width=str(width), height=str(height))


def mark(good: bool, word: str, *, excused: bool = False) -> Markup:
    """`✓ done`, `✗ failed`, `– not run`, `– skipped`; with a dash also what is `excused`."""
    if word in ("not_run", "skipped") or excused:
        return element("span", f"– {word.replace('_', ' ')}", class_="idle")
    return element("span", f"{'✓' if good else '✗'} {word.replace('_', ' ')}", class_="yes" if good else "no")


def signed(value: float, unit: str) -> str:
    """`+4.1 mm`, `−16 mm`: with an explicit sign; zero has none."""
    sign = "+" if value > 0.0 else "−" if value < 0.0 else ""
    return f"{sign}{quantity(abs(value), unit)}"


def percent(share: float) -> str:
    """`97 %`; one decimal below 10 %."""
    return f"{100.0 * share:.0f} %" if share >= 0.0995 else f"{100.0 * share:.1f} %"


def number(value: float, unit: str) -> str:
    """`123 J`, `7.7 J`, `0.05 J`: 0 below 0.005."""
    size = abs(value)
    return f"{value:.{0 if size >= 99.95 else 1 if size >= 0.995 else 2}f} {unit}" if size >= 0.005 else f"0 {unit}"


def of_limit(value: float, limit: float, unit: str) -> str:
    """`6.3 of 20 mm`: both in the unit of the limit, rounded to about 1 %."""
    shown, _, name = readable(limit, unit).partition(" ")
    digits = min(max(2 - math.floor(math.log10(abs(float(shown)))), 0), 3)
    text = f"{value / limit * float(shown):.{digits}f}"
    text = text if float(text) else text.lstrip("-")
    return f"{text} of {shown} {name}".replace("-", "−")
