"""Self-contained HTML page of a run: verdict, cause, replay, expectations, steps, measurements."""

from __future__ import annotations

from importlib.resources import files

from manipcli.replay.player import POLICY, player_html
from manipcli.report.html import page_numbers as numbers
from manipcli.report.html import page_sections as sections
from manipcli.report.html.markup import Markup, document, element, joined
from manipcli.report.html.page_parts import heading
from manipcli.report.run_page import RunPage


def render_page(page: RunPage) -> str:
    """The HTML file; equal pages give equal bytes."""
    facts = page.facts
    measured = (numbers.grasps, numbers.joints, numbers.energy)
    grasps, joints, energy = (section(facts) if facts is not None else None for section in measured)
    shown = {
        "Cause": sections.causes(page),
        "Expectations": sections.expectations(page),
        "Warnings": sections.warnings(page),
        "Replay": _replay(page),
        "Steps": sections.steps(page),
        "Located": sections.located(page),
        "Grasps": grasps,
        "Joints": joints,
        "Energy": energy,
        "Files": sections.sources(page),
        "Provenance": sections.provenance(page),
    }
    back = element("a", "All runs", href=page.index) if page.index else None
    links = (element("a", name, href=f"#{name.lower()}") for name, section in shown.items() if section)
    own = files("manipcli.report.html").joinpath("page")
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
    about = "Drag to orbit, scroll to zoom, double-click to reset the view; click a curve or the timeline to seek."
    player = Markup(player_html(page.playback))
    return element("section", heading("replay", "Replay", about), joined(player))
