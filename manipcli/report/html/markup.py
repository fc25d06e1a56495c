"""HTML elements that escape their text, except text that is already `Markup`."""

from __future__ import annotations

import html
import os
from pathlib import Path
from urllib.parse import quote

from manipcli.core.text import escape
from manipcli.replay.theme import colours, switch

Attribute = str | float | bool | None
_EMPTY = frozenset({"br", "img", "line", "link", "meta", "rect", "polygon"})
"""Elements without an end tag."""


class Markup(str):
    """Text that is HTML and needs no escaping."""

    __slots__ = ()


def document(title: str, *body: str | None, style: Markup, policy: str) -> str:
    """A whole HTML page, light or dark, that loads no other file; `policy` is its Content-Security-Policy."""
    whole = element(
        "html",
        element(
            "head",
            element("meta", charset="utf-8"),
            element("meta", http_equiv="Content-Security-Policy", content=policy),
            element("meta", name_="viewport", content="width=device-width, initial-scale=1"),
            element("title", title),
            element("link", rel="icon", href="data:,"),
            element("style", Markup(colours() + style)),
        ),
        element("body", Markup(switch()), *body),
        lang="en",
    )
    return f"<!DOCTYPE html>\n{whole}\n"


def element(name: str, *children: str | None, **attributes: Attribute) -> Markup:
    """`<name attribute="...">children</name>`.

    Args:
        name: tag of the element.
        children: `Markup` is kept, other text is escaped, None is left out.
        attributes: `class_` is `class`, `data_seek` is `data-seek`; None and False are left out, True has no value.
    """
    words = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        word = key.rstrip("_").replace("_", "-")
        words.append(word if value is True else f'{word}="{html.escape(_text(value))}"')
    head = " ".join(words)
    return Markup(f"<{head} />" if name in _EMPTY else f"<{head}>{joined(*children)}</{name}>")


def joined(*parts: str | None) -> Markup:
    """Concatenated parts; text that is not `Markup` is escaped, None is left out."""
    return Markup("".join(part if isinstance(part, Markup) else html.escape(escape(part)) for part in parts if part))


def link(target: Path | str, folder: Path) -> str:
    """The relative URL of a file from a page in `folder`; a name that is not valid text is quoted as bytes."""
    return quote(os.path.relpath(target, folder), errors="surrogateescape")


def _text(value: str | float) -> str:
    return escape(value) if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)
