"""The report in a real browser: its buttons move the replay, nothing leaves the machine, nothing complains."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import pytest

from manipcli.logs.report import log_page
from manipcli.pipeline import run_task
from manipcli.report.html.render_page import render_page

ROOT = Path(__file__).parents[2]


class Page(Protocol):
    """What the fixture `browser` gives."""

    requests: list[str]
    complaints: list[str]

    def ask(self, method: str, **parameters: object) -> dict[str, object]: ...
    def open(self, url: str) -> None: ...
    def evaluate(self, script: str) -> object: ...
    def wait_for(self, script: str, seconds: float = 120.0) -> None: ...


@pytest.mark.slow
def test_the_report_of_a_failed_run_leads_to_its_moments(browser: Page, tmp_path: Path) -> None:
    task = next((ROOT / "examples" / "02_pick_a_block").glob("task*.yaml"))
    run = run_task(task, log=tmp_path / "run.mcap", overrides=["scene.block.friction=0.01"])
    file = tmp_path / "report.html"
    file.write_text(render_page(log_page(tmp_path / "run.mcap", meshes=run.meshes)), "utf-8")
    browser.open(file.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player')?.player")
    assert str(browser.evaluate("document.querySelector('.why h3').textContent")).startswith("✗ ")
    now = "document.querySelector('.mc-player').player.time"
    steps = "#steps ~ .scroll tbody tr"
    for which in (".why button[data-seek]", f"{steps}:nth-child(2) button[data-seek]", "figure[data-seek]", ".use"):
        at = float(str(browser.evaluate(f"document.querySelector('{which}').dataset.seek")))
        browser.evaluate(f"document.querySelector('{which}').click()")
        assert browser.evaluate(now) == pytest.approx(at, abs=1e-3), which
    browser.evaluate(f"document.querySelector('{steps} a.place').click()")
    assert browser.evaluate("document.querySelector('details:has(.source)').open") is True
    tables = "document.querySelectorAll('section:has(#expectations, #steps, #grasps, #joints) .scroll')"
    for width in (360, 800, 1280):
        browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=False)
        assert browser.evaluate("document.documentElement.scrollWidth <= window.innerWidth") is True, width
        assert browser.evaluate(f"[...{tables}].every(e => e.scrollWidth <= e.clientWidth)") is True, width
    assert browser.complaints == []
    assert [one for one in browser.requests if not one.startswith(("data:", "file:"))] == []
