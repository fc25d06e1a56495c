"""A run as one page for a person: what came of it, why, and where to look. No other file, nothing fetched."""

from __future__ import annotations

from importlib.resources import files

from manipcli.replay.player import POLICY, player_html
from manipcli.report import html_numbers as numbers
from manipcli.report import html_sections as sections
from manipcli.report.html_parts import heading
from manipcli.report.markup import Markup, document, element, joined
from manipcli.report.run_page import RunPage

_NAMES = (
    ("cause", "Cause"),
    ("expectations", "Expectations"),
    ("warnings", "Warnings"),
    ("replay", "Replay"),
    ("steps", "Steps"),
    ("grasps", "Grasps"),
    ("joints", "Joints"),
    ("energy", "Energy"),
    ("files", "Files"),
    ("provenance", "Provenance"),
)


def render_page(page: RunPage) -> str:
    """The file. The same value gives the same bytes."""
    facts = page.facts
    shown = {
        "cause": sections.causes(page),
        "expectations": sections.expectations(page),
        "warnings": sections.warnings(page),
        "replay": _replay(page),
        "steps": sections.steps(page),
        "grasps": numbers.grasps(facts) if facts is not None else None,
        "joints": numbers.joints(facts) if facts is not None else None,
        "energy": numbers.energy(facts) if facts is not None else None,
        "files": sections.sources(page),
        "provenance": sections.provenance(page),
    }
    back = element("a", "All runs", href=page.index) if page.index else None
    links = (element("a", word, href=f"#{name}") for name, word in _NAMES if shown[name])
    own = files("manipcli.report").joinpath("page")
    style, script = (Markup(own.joinpath(name).read_text("utf-8")) for name in ("report.css", "report.js"))
    verdict = page.verdict
    title = f"{'✓' if verdict.verdict == 'passed' else '✗'} {verdict.task} {verdict.verdict}"
    return document(
        title,
        sections.head(page),
        element("nav", back, *links, aria_label="sections"),
        element("main", *shown.values()),
        element("script", script),
        style=style,
        policy=POLICY,
    )


def _replay(page: RunPage) -> Markup | None:
    if page.playback is None:
        return None
    about = "Drag to turn, wheel to come nearer, double click to come back; click a curve or the timeline to go there."
    player = Markup(player_html(page.playback))
    return element("section", heading("replay", "Replay", about), joined(player))
