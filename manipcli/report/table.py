"""Text tables with aligned columns."""

from __future__ import annotations

from collections.abc import Sequence
from io import StringIO


def table(headers: Sequence[str], rows: Sequence[Sequence[str]], *, right: Sequence[str] = ()) -> str:
    """Columns two spaces apart, as wide as their widest cell; those named in `right` are right-aligned.

    Rich measures the cells, with the terminal width of wide and combining characters. Its console is wide enough that
    it never truncates a cell.
    """
    from rich.cells import cell_len
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    widths = [max(cell_len(row[k]) for row in (headers, *rows)) for k in range(len(headers))]
    drawn = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for header, width in zip(headers, widths, strict=True):
        drawn.add_column(Text(header), justify="right" if header in right else "left", no_wrap=True, min_width=width)
    for row in rows:
        drawn.add_row(*(Text(cell) for cell in row))
    text = StringIO()
    Console(file=text, width=sum(widths) + 2 * len(widths), color_system=None, force_terminal=False).print(drawn)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines())
