"""The page of a sweep in a browser: a click on a sample shows its values and its command where they are seen."""

from __future__ import annotations

import re
from pathlib import Path

from benchmarks.browser import Page
from manipcli.sweep.analysis import Analysis
from manipcli.sweep.sweep import Sweep
from manipcli.sweep.sweep_page import render_page
from tests.sweep.test_analysis import cube, result


def test_a_click_on_a_sample_shows_its_command_beside_the_plots(tmp_path: Path, browser: Page) -> None:
    folder = tmp_path / "it's a folder"
    folder.mkdir()
    sampling = cube(folder, "")
    results = tuple(result(k, 0.01 * (k - 5), passed=k >= 5) for k in range(12))
    page = folder / "page.html"
    page.write_text(render_page(Analysis(Sweep(sampling, results, 12, "", 0.0, 0)), folder))
    browser.ask("Emulation.setDeviceMetricsOverride", width=1200, height=700, deviceScaleFactor=1, mobile=False)
    browser.open(page.as_uri())
    browser.wait_for("document.querySelectorAll('#map g').length == 12")
    assert browser.evaluate("document.querySelectorAll('#small svg').length") == 3
    assert browser.evaluate("[...document.querySelectorAll('figcaption')].map((one) => one.textContent)") == [
        *(f"{one.column.name} [m]" for one in Analysis(Sweep(sampling, results, 12, "", 0.0, 0)).influences)
    ]
    click = "dispatchEvent(new Event('click'))"
    browser.evaluate(f"document.querySelector('#small g[aria-label=\"sample 3, failed\"]').{click}")
    assert browser.evaluate("document.querySelector('#sample pre').textContent") == sampling.job(3).command()
    assert "it'\"'\"'s a folder" in sampling.job(3).command()
    assert browser.evaluate("document.querySelectorAll('g.chosen').length") == 4  # in all plots
    assert re.search(r"\bf\t−20 mm", str(browser.evaluate("document.getElementById('sample').innerText")))
    box = "document.getElementById('sample').getBoundingClientRect()"
    for plots, block in (("small", "start"), ("map", "end")):
        browser.evaluate(f"document.getElementById('{plots}').scrollIntoView({{block: '{block}'}})")
        assert browser.evaluate(f"(({{top, bottom}}) => top >= 0 && bottom <= innerHeight)({box})")
    assert browser.requests == [page.as_uri()]
    assert browser.complaints == []


def test_labels_of_plots_are_not_cut(tmp_path: Path, browser: Page) -> None:
    sampling = cube(tmp_path, "")
    results = tuple(result(k, 0.0012345 * (k - 5), passed=k >= 5) for k in range(12))
    page = tmp_path / "page.html"
    page.write_text(render_page(Analysis(Sweep(sampling, results, 12, "", 0.0, 0)), tmp_path))
    browser.ask("Emulation.setDeviceMetricsOverride", width=1200, height=700, deviceScaleFactor=1, mobile=False)
    browser.open(page.as_uri())
    browser.wait_for("document.querySelectorAll('#map g').length == 12")
    texts = "[...document.querySelectorAll('svg.plot text')]"
    assert browser.evaluate(f"Math.max(...{texts}.map((one) => one.textContent.length))") == len("−0.006172")
    assert browser.evaluate(f"Math.min(...{texts}.map((one) => one.getBBox().x))") >= 0.0
