"""The page in a real browser: somebody drags a slider, and stops the robot."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pytest

from manipcli.live.page.options import PageOptions
from manipcli.live.source import recorded_commands
from manipcli.logs.replay import open_playback
from manipcli.run.observer import SILENT
from tests.live.sessions import TOKEN, serving

ROOT = Path(__file__).parents[3]
CLICK = """(label => {
  const found = [...document.querySelectorAll("button")].find(e => e.textContent.trim() === label);
  if (found) found.click();
  return !!found;
})"""


VALUE = "[...document.querySelectorAll('.mantine-Slider-thumb')].map(e => +e.getAttribute('aria-valuenow'))"
TIME = "+document.body.innerText.match(/t = ([0-9.]+) s/)[1]"


class Page(Protocol):
    """What the fixture `browser` gives."""

    requests: list[str]
    complaints: list[str]

    def ask(self, method: str, **parameters: object) -> dict[str, object]: ...
    def open(self, url: str) -> None: ...
    def evaluate(self, script: str) -> object: ...
    def wait_for(self, script: str, seconds: float = 120.0) -> None: ...


class Told:
    """A display that keeps the messages."""

    def __init__(self) -> None:
        self.messages: list[str] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(SILENT, name)

    def message(self, text: str, *, detail: bool) -> None:
        self.messages.append(text)


def _drag(page: Page, slider: int, share: float) -> None:
    """Drag a slider to a share of its length, in five moves."""
    thumb, track = (
        json.loads(str(page.evaluate(f"JSON.stringify(document.querySelectorAll({name!r})[{slider}].{box})")))
        for name, box in (
            (".mantine-Slider-thumb", "getBoundingClientRect()"),
            (".mantine-Slider-root", "getBoundingClientRect()"),
        )
    )
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    end = track["x"] + share * track["width"]
    pressed = {"button": "left", "buttons": 1, "clickCount": 1}
    page.ask("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **pressed)
    for k in range(1, 6):
        page.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x + (end - x) * k / 5, y=y, **pressed)
    page.ask("Input.dispatchMouseEvent", type="mouseReleased", x=end, y=y, button="left", clickCount=1)


@pytest.mark.slow
def test_a_slider_moves_the_arm_and_the_emergency_stop_holds_it(browser: Page, tmp_path: Path) -> None:
    told = Told()

    async def use(socket: str) -> None:
        (url,) = [text.removeprefix("page: ") for text in told.messages if text.startswith("page: ")]
        browser.ask("Emulation.setDeviceMetricsOverride", width=1000, height=900, deviceScaleFactor=0.25, mobile=False)
        browser.open(url)
        port = url.split(":")[2].split("/")[0]
        browser.wait_for("document.querySelectorAll('.mantine-Slider-thumb').length >= 13")
        browser.wait_for("document.body.innerText.includes('real-time factor')")
        assert browser.evaluate(f"{CLICK}('zero')")
        browser.wait_for(f"{VALUE}[3] > -17")
        _drag(browser, 0, 0.75)
        browser.wait_for(f"{VALUE}[0] > 57")
        now = float(str(browser.evaluate(TIME)))
        browser.wait_for(f"{TIME} > {now + 4.0}")
        assert browser.evaluate(f"{CLICK}('EMERGENCY STOP')")
        browser.wait_for("document.body.innerText.includes('brakes hold the joints')")
        browser.wait_for("[...document.querySelectorAll('.mantine-Slider-thumb')].some(e => e.dataset.disabled)")
        outside = [one for one in browser.requests if not one.split(":", 1)[1].startswith(f"//127.0.0.1:{port}")]
        assert [one for one in outside if not one.startswith(("data:", "blob:"))] == []
        assert browser.complaints == []

    log = serving(tmp_path, use, speed=1.0, outlets=[PageOptions(TOKEN, 0)], progress=told)
    schedule = recorded_commands(log, 0.001, failed=True)
    names = [command.name for tick in range(10**6) for command in schedule.take(tick)]
    assert set(names[:-2]) >= {"/arm_controller/joint_trajectory", "/hand_controller/gripper_cmd"}
    assert names.count("/emergency_stop") == 1
    shown = open_playback(log, package_path=[ROOT / "robots"])
    arm = shown.position[:, [shown.joint_names.index(name) for name in ("joint_1", "joint_4")]]
    assert arm[0, 1] < -1.5
    np.testing.assert_allclose(arm[-1], [1.48, 0.0], atol=0.1)  # where the slider and the pose have it, held by brakes
