"""HTML that cannot be broken by what is put into it: text is escaped unless it is `Markup` already."""

from __future__ import annotations

import html
import os
from pathlib import Path
from urllib.parse import quote

from manipcli.core.text import escape

Attribute = str | float | bool | None
_EMPTY = frozenset({"br", "img", "line", "link", "meta", "rect", "polygon"})
"""Elements that have no end."""


class Markup(str):
    """HTML. Any other text is not."""

    __slots__ = ()


def document(title: str, *body: str | None, style: Markup, policy: str) -> str:
    """A whole page that asks for nothing from elsewhere; `policy`: its Content-Security-Policy."""
    whole = element(
        "html",
        element(
            "head",
            element("meta", charset="utf-8"),
            element("meta", http_equiv="Content-Security-Policy", content=policy),
            element("meta", name_="viewport", content="width=device-width, initial-scale=1"),
            element("title", title),
            element("link", rel="icon", href="data:,"),
            element("style", style),
        ),
        element("body", *body),
        lang="en",
    )
    return f"<!DOCTYPE html>\n{whole}\n"


def element(name: str, *children: str | None, **attributes: Attribute) -> Markup:
    """`<name attribute="...">children</name>`.

    Args:
        name: of the element.
        children: `Markup` as it is, other text escaped, None left out.
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
    """Parts behind each other; what is no `Markup` is escaped."""
    return Markup("".join(part if isinstance(part, Markup) else html.escape(escape(part)) for part in parts if part))


def link(target: Path | str, folder: Path) -> str:
    """The address of a file as seen from a page in `folder`; of a name that is no text its bytes."""
    return quote(os.path.relpath(target, folder), errors="surrogateescape")


def _text(value: str | float) -> str:
    return escape(value) if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)
