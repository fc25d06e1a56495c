"""Colours of all pages in light and dark, and the switch between them."""

from __future__ import annotations

from importlib.resources import files

_THEME = files("manipcli.replay").joinpath("page", "theme")


def colours() -> str:
    """CSS: the colour variables and the look of the switch."""
    return _THEME.joinpath("colours.css").read_text("utf-8")


def switch() -> str:
    """HTML: the switch, as the first element of a body, with its script."""
    script = _THEME.joinpath("scheme.js").read_text("utf-8")
    return f'<button type="button" class="scheme" aria-label="dark colours">◐</button>\n<script>\n{script}</script>\n'
