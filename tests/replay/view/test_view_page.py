"""The page of `view` in a real browser."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from PIL import Image

from manipcli.replay.view.view import View
from manipcli.task.load_view import load_sight

ROOT = Path(__file__).parents[3]
SCALE = 0.5
"""Pixels of the screen for one of the page."""
PLACE = """(label => {
  const found = [...document.querySelectorAll("label, button, [role=tab]")].find(
    e => e.textContent.trim() === label && e.getBoundingClientRect().width > 0);
  if (!found) return null;
  const box = found.getBoundingClientRect();
  return JSON.stringify([box.x + box.width / 2, box.y + box.height / 2]);
})"""


class Page(Protocol):
    """What the fixture `browser` gives."""

    requests: list[str]
    complaints: list[str]

    def open(self, url: str) -> None: ...
    def evaluate(self, script: str) -> object: ...
    def wait_for(self, script: str, seconds: float = 120.0) -> None: ...
    def screenshot(self) -> bytes: ...
    def ask(self, method: str, **parameters: object) -> dict[str, object]: ...


def _click(page: Page, label: str) -> None:
    """Tabs follow the mouse, not `click()`."""
    page.wait_for(f"{PLACE}({label!r}) !== null")
    x, y = json.loads(str(page.evaluate(f"{PLACE}({label!r})")))
    page.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    for kind in ("mousePressed", "mouseReleased"):
        page.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)


def _pixels(page: Page) -> np.ndarray:
    """The left part of the page, which the panel does not cover and the notice of slow rendering neither."""
    image = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)
    return image[int(160 * SCALE) :, : int(900 * SCALE)]


def _until(page: Page, condition: Callable[[np.ndarray], bool], seconds: float = 300.0) -> np.ndarray:
    end = time.monotonic() + seconds
    while not condition(seen := _pixels(page)):
        assert time.monotonic() < end, "the picture did not become what it should"
        time.sleep(0.5)
    return seen


def _is_orange(image: np.ndarray) -> bool:
    """The collision shapes, all but transparent over the arm."""
    r, g, b = (image[..., k] for k in range(3))
    return bool(((r > 150) & (r - b > 60) & (r > g)).sum() > 10_000 * SCALE**2)


@pytest.mark.slow
def test_the_page_shows_the_robot_and_obeys_its_panel(browser: Page) -> None:
    sight = load_sight(ROOT / "robots" / "arm7_hand3" / "robot.yaml")
    with View(sight.robot, port=0) as view:
        # A quarter of the pixels: they are drawn in software.
        browser.ask("Emulation.setDeviceMetricsOverride", width=1280, height=800, deviceScaleFactor=SCALE, mobile=False)
        browser.open(view.url)
        browser.wait_for("document.querySelector('canvas') !== null")
        # Something dark (hand and joints) on a light ground, once the page has faded in.
        home = _until(browser, lambda image: (image.max(axis=2) < 60).sum() > 2_000 * SCALE**2)
        assert not _is_orange(home)
        names = [joint.name for joint in sight.robot.joints if joint.independent]
        shown = str(browser.evaluate("document.body.innerText"))
        assert [name for name in names if name not in shown] == []
        assert not any(joint.name in shown.split() for joint in sight.robot.joints if joint.mimic is not None)

        _click(browser, "zero")
        _until(browser, lambda image: np.abs(image - home).max(axis=2).mean() > 5.0)
        assert view.joints.position == pytest.approx(view.joints.named("zero"))

        assert "no collision" in shown
        assert "opening 88.0 mm" in shown  # as `check` prints it
        _click(browser, "Show")
        _click(browser, "collision shapes")
        _until(browser, _is_orange)

        _click(browser, "Camera")
        isometric = _until(browser, _is_orange)
        _click(browser, "top")
        _until(browser, lambda image: np.abs(image - isometric).max(axis=2).mean() > 5.0)

        outside = [url for url in browser.requests if not url.split(":", 1)[1].startswith(f"//127.0.0.1:{view.port}")]
        assert [url for url in outside if not url.startswith(("data:", "blob:"))] == []
        assert browser.complaints == []
