"""The page of a run in a real browser: from a file and from the server of `replay`."""

from __future__ import annotations

import io
import json
import re
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from PIL import Image

from manipcli.core.geometry import Transform, matrix_from_quat
from manipcli.judge.verdict import StepOutcome
from manipcli.logs.replay import open_playback
from manipcli.pipeline import run_task
from manipcli.render.drawing import draw
from manipcli.replay.cause import Cause, Written
from manipcli.replay.ghost import ghost_of
from manipcli.replay.level_of_detail import POSITION, ROTATION
from manipcli.replay.page_server import PageServer
from manipcli.replay.pixels import from_image
from manipcli.replay.playback import RATE, Playback, PlaybackStep
from manipcli.replay.player import player_html, player_page
from manipcli.replay.sensed import CameraFeed, PictureStream, RayFeed, Sensed, TaxelFeed, counted

ROOT = Path(__file__).parents[2]
PLOT = "document.querySelector('[data-part=plot]')"
CLICK = """(text => {
  const found = [...document.querySelectorAll("label, button")].find(e => e.textContent.includes(text));
  if (found) found.click();
  return !!found;
})"""


class Page(Protocol):
    """What the fixture `browser` gives."""

    requests: list[str]
    complaints: list[str]

    def ask(self, method: str, **parameters: object) -> dict[str, object]: ...
    def open(self, url: str) -> None: ...
    def evaluate(self, script: str) -> object: ...
    def wait_for(self, script: str, seconds: float = 120.0) -> None: ...
    def screenshot(self) -> bytes: ...


@pytest.fixture(scope="module")
def playback(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    """A pick of examples: a table, a block, contacts."""
    folder = tmp_path_factory.mktemp("run")
    task = next((ROOT / "examples" / "02_pick_a_block").glob("task*.yaml"))
    run_task(task, log=folder / "run.mcap", overrides=["simulation.engine=pybullet"])
    return open_playback(folder / "run.mcap", package_path=[ROOT / "robots"])


def _picture(page: Page) -> np.ndarray:
    """The left part of the page, which no panel covers and no notice."""
    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)[170:560, :700]


def _until(page: Page, condition: Callable[[np.ndarray], bool], seconds: float = 120.0) -> np.ndarray:
    end = time.monotonic() + seconds
    while not condition(seen := _picture(page)):
        assert time.monotonic() < end, "the picture did not become what it should"
        time.sleep(0.5)
    return seen


def _is_drawn(image: np.ndarray) -> bool:
    """The table, in a colour that neither the background nor an empty page has."""
    return bool((np.ptp(image, axis=2) > 50).sum() > 10_000)


@pytest.mark.slow
def test_ghosts_are_where_the_other_run_was(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """Oracle: our kinematics of another run, with its bodies 10 cm aside and its joints turned by 0.1 rad."""
    aside = playback.body_position + np.array([0.0, 0.1, 0.0])
    other = replace(playback, position=playback.position + 0.1, body_position=aside)
    path = tmp_path / "ghost.html"
    path.write_text(player_html(playback, ghosts=[ghost_of("mujoco", other, playback)], whole_page=True), "utf-8")
    browser.open(path.as_uri())
    player = "document.querySelector('.mc-player').player"
    browser.wait_for(f"!!{player}")
    poses = other.poses()
    for k in (0, len(playback.times) // 2):
        time_of = float(playback.times[k])
        (found,) = json.loads(str(browser.evaluate(f"JSON.stringify({player}.ghosts({time_of!r}))")))
        np.testing.assert_allclose([one["p"] for one in found], poses.position[k], atol=1.01 * POSITION)
    assert browser.evaluate(f"{CLICK}('mujoco')"), "its switch"
    assert not browser.complaints


@pytest.mark.slow
def test_the_list_groups_steps_by_block_and_tells_the_skipped(
    browser: Page, playback: Playback, tmp_path: Path
) -> None:
    assert playback.verdict is not None
    ids = ("sort[0]/pick_1", "sort[0]/if_1/place_1", "sort[0]/if_1/else/place_1", "sort[1]/pick_1")
    judged = tuple(StepOutcome(id, id.rpartition("/")[2][:-2], "done", 0.0, 1.0, 1.0) for id in ids)
    judged = (judged[0], replace(judged[1], outcome="skipped", text="took else"), *judged[2:])
    done = [step for step in judged if step.outcome == "done"]
    steps = tuple(PlaybackStep(one.id, one.verb, one.label, float(k), k + 1.0, "done") for k, one in enumerate(done))
    path = tmp_path / "blocks.html"
    path.write_text(
        player_page(replace(playback, steps=steps, verdict=replace(playback.verdict, steps=judged))), "utf-8"
    )
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player').player")
    rows = "[...document.querySelector('.steps').children]"
    told = str(browser.evaluate(f"{rows}.map(e => (e.querySelector('.label') || e).textContent).join()"))
    assert told.split(",") == ["sort[0]", "pick_1", "if_1", "place_1", "else/place_1", "sort[1]", "pick_1"]
    assert str(browser.evaluate(f"{rows}.map(e => parseInt(e.style.marginLeft) / 14 || 0).join()")) == "0,1,1,2,2,0,1"
    assert browser.evaluate(f"{rows}[3].textContent") == "–place_1skipped"
    assert browser.evaluate(f"{rows}[3].title") == "sort[0]/if_1/place_1: skipped\ntook else"
    track = str(browser.evaluate("[...document.querySelectorAll('.track .step')].map(e => e.textContent).join()"))
    assert track == "pick_1,place_1,pick_1"
    browser.evaluate("document.querySelector('.mc-player').player.seek(1.5)")
    browser.wait_for(f"{rows}[4].classList.contains('now')")
    assert not browser.complaints


@pytest.mark.slow
def test_the_page_of_its_own_plays(browser: Page, playback: Playback, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    path.write_text(player_page(playback), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player').player")
    player = "document.querySelector('.mc-player').player"
    start = _until(browser, _is_drawn)

    # The browser's kinematics against ours, on the times of the run and between them.
    drawing = draw(playback.robot, playback.scene)
    poses = playback.poses()
    for k in np.linspace(0, len(playback.times) - 1, 4).astype(int).tolist():
        found = json.loads(str(browser.evaluate(f"JSON.stringify({player}.poses({float(playback.times[k])!r}))")))
        np.testing.assert_allclose([one["p"] for one in found], poses.position[k], atol=1.01 * POSITION)
        turned = matrix_from_quat([one["q"] for one in found])
        np.testing.assert_allclose(turned, matrix_from_quat(poses.quat_xyzw[k]), atol=1.01 * ROTATION)
    assert len(found) == len(drawing.frames)

    # Numbers that round to nothing have no sign.
    legend = "document.querySelector('[data-part=legend]').textContent"
    told = [str(browser.evaluate(f"{player}.seek({time}), {legend}")) for time in (0.0, 0.01, 0.5, 1.0)]
    assert " rad" in told[0]
    assert not [text for text in told if re.search(r"-0\.0+ ", text)]

    labels = [step.label for step in playback.steps]
    shown = browser.evaluate("[...document.querySelectorAll('.steps button')].map(e => e.innerText).join('\\n')")
    assert all(label in str(shown) for label in labels)
    chosen = playback.steps[2]
    assert browser.evaluate(f"{CLICK}({json.dumps(chosen.label)})")
    browser.wait_for(f"Math.abs({player}.time - {chosen.start}) < 1e-6")
    browser.wait_for(f"document.querySelector('.steps .now').innerText.includes({json.dumps(chosen.label)})")
    _until(browser, lambda image: np.abs(image - start).max(axis=2).mean() > 1.0)

    assert browser.evaluate(f"{player}.seek(0)") is None
    browser.evaluate("document.querySelector('[data-part=play]').click()")
    browser.wait_for(f"{player}.time > 0.5")
    assert browser.evaluate(f"{player}.playing")
    browser.evaluate("document.querySelector('[data-part=play]').click()")
    assert not browser.evaluate(f"{player}.playing")

    assert [url for url in browser.requests if url != path.as_uri()] == []
    assert browser.complaints == []


@pytest.mark.slow
def test_sensors_are_shown_in_step_with_the_time(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """A picture that turns from red to blue at 1 s, depth of two levels, a grid of two taxels and one ray."""
    red, blue = (np.full((12, 16, 3), colour, dtype=np.uint8) for colour in ((220, 20, 20), (20, 20, 220)))
    times, none = np.array([0.2, 1.0]), np.full(2, np.nan)
    shots = tuple(from_image("rgb8", 16, 12, 48, memoryview(each.tobytes())).data for each in (red, blue))
    deep = np.full((12, 16), 1000, dtype="<u2")
    deep[:, 8:] = 3000
    depth = from_image("16UC1", 16, 12, 32, memoryview(deep.tobytes()))
    limits = np.array([[depth.low] * 2, [depth.high] * 2])
    streams = (
        PictureStream("image_raw", "colour", (16, 12), times, shots, none, none, "2 of 9 pictures"),
        PictureStream("depth", "depth", (16, 12), times, (depth.data,) * 2, *limits),
    )
    counts, unit = counted(np.array([[0.0, 1.0], [4.0, 2.0]]))
    far, metre = counted(np.array([[0.5], [0.75]]))
    X_PS = Transform.of(xyz=(0.1, 0.2, 0.3), rpy=(0.0, 0.0, np.pi / 2.0))
    sensed = Sensed(
        cameras=(CameraFeed("eye", streams),),
        taxels=(TaxelFeed("tip", 1, 2, (1e-3, 1e-3), times, counts, unit),),
        rays=(RayFeed("scan", "world", X_PS, np.zeros(1), times, times, far, metre),),
        notes=("/x: <b>frame</b>",),
    )
    path = tmp_path / "sensors.html"
    path.write_text(player_page(replace(playback, sensed=lambda frames: sensed)), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player').player")
    canvas, figure = "document.querySelectorAll('.senses canvas')", "document.querySelectorAll('.senses figure')"

    def pixel(number: int, x: int) -> list[int]:
        data = f"{canvas}[{number}].getContext('2d').getImageData({x}, 6, 1, 1).data"
        return list(json.loads(str(browser.evaluate(f"JSON.stringify([...{data}])"))))[:3]

    browser.wait_for(f"{figure}[0].textContent.includes('nothing arrived yet')")
    for time_of, arrived, brightest, force in ((0.2, 0.2, 0, "1.00"), (0.99, 0.2, 0, "1.00"), (1.0, 1.0, 2, "6.00")):
        browser.evaluate(f"document.querySelector('.mc-player').player.seek({time_of})")
        browser.wait_for(f"Math.abs(Number({figure}[0].dataset.shown) - {arrived}) < 1e-6")
        seen = pixel(0, 8)
        assert seen[brightest] > 180
        assert sum(seen) - seen[brightest] < 120
        assert f"sum {force} N" in str(browser.evaluate(f"{figure}[1].textContent"))
    assert "2 of 9 pictures" in str(browser.evaluate(f"{figure}[0].textContent"))
    assert browser.evaluate("document.querySelector('.senses > .note').textContent") == "/x: <b>frame</b>"
    # The strong cell is the dark one.
    assert sum(pixel(1, 5)) < sum(pixel(1, 450)) - 50
    choose = "(e => { e.value = 1; e.dispatchEvent(new Event('change')); })"
    browser.evaluate(f"{choose}(document.querySelector('.senses select'))")
    browser.wait_for(f"{figure}[0].textContent.includes('1.00 m') && {figure}[0].textContent.includes('3.00 m')")
    assert sum(pixel(0, 3)) > sum(pixel(0, 13)) + 200
    # The pose of the range finder turns x to y.
    (beam,) = json.loads(str(browser.evaluate("JSON.stringify(document.querySelector('.mc-player').beams(1.5))")))
    assert beam == pytest.approx([0.1, 0.2, 0.3, 0.1, 0.95, 0.3], abs=1e-4)
    assert browser.complaints == []
    assert [url for url in browser.requests if url != path.as_uri()] == []


def _press(page: Page, key: str, code: str, number: int) -> None:
    text = {"text": key} if len(key) == 1 else {}
    about = {"key": key, "code": code, "windowsVirtualKeyCode": number}
    page.ask("Input.dispatchKeyEvent", type="keyDown", **about, **text)
    page.ask("Input.dispatchKeyEvent", type="keyUp", **about)


@pytest.mark.slow
def test_the_camera_goes_where_the_pointer_is(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """Laws of the camera: zooming keeps the point below the pointer; a double click makes it the target; from above, x
    of the world is up; a parallel projection has parallel lines of sight; what is followed keeps its place."""
    path = tmp_path / "run.html"
    path.write_text(player_page(playback), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player').player")
    player = "document.querySelector('.mc-player').player"

    def ask(script: str) -> np.ndarray:
        return np.array(json.loads(str(browser.evaluate(f"JSON.stringify({player}.{script})"))), dtype=float)

    def settled() -> None:
        browser.wait_for(f"new Promise(done => setTimeout(() => done({player}.camera.glide === null), 50))")

    left, top, wide, high = json.loads(
        str(
            browser.evaluate(
                "JSON.stringify((b => [b.x, b.y, b.width, b.height])"
                "(document.querySelector('[data-part=canvas]').getBoundingClientRect()))"
            )
        )
    )
    # Somewhere on the screen something is drawn beside the middle.
    places = [(x, y) for x in (-0.3, -0.15, 0.15, 0.3) for y in (-0.3, 0.3, 0.0)]
    x, y = next(place for place in places if browser.evaluate(f"{player}.pick({place[0]}, {place[1]}) !== null"))
    mouse = {"x": left + (x + 1.0) / 2.0 * wide, "y": top + (1.0 - y) / 2.0 * high}
    point, distance = ask(f"pick({x}, {y}).point"), ask("camera.distance")
    for _ in range(3):
        browser.ask("Input.dispatchMouseEvent", type="mouseWheel", deltaX=0, deltaY=-100, **mouse)
    browser.wait_for(f"{player}.camera.distance < {0.75 * float(distance)}")
    # A pixel of the view is 2 to 3 mm wide there, and the surface may be steep.
    np.testing.assert_allclose(ask(f"pick({x}, {y}).point"), point, atol=0.02)

    for count in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            browser.ask("Input.dispatchMouseEvent", type=kind, button="left", clickCount=count, **mouse)
    settled()
    np.testing.assert_allclose(ask("camera.target"), point, atol=0.02)

    assert browser.evaluate(f"{CLICK}('top')")
    settled()
    up = ask("pointAt(0, 0.5)") - ask("pointAt(0, 0)")
    np.testing.assert_allclose(up / np.linalg.norm(up), [1.0, 0.0, 0.0], atol=1e-9)
    assert browser.evaluate(f"{CLICK}('parallel')")
    np.testing.assert_allclose(ask("pointAt(0.5, 0.2, 1)") - ask("pointAt(0.5, 0.2, 3)"), [0.0, 0.0, 2.0], atol=1e-9)

    choose = "(e => { e.value = 'tool'; e.dispatchEvent(new Event('change')); })"
    browser.evaluate(f"{choose}(document.querySelector('.views select'))")
    settled()
    tool = playback.tool_path()
    for k in (0, len(playback.times) // 2, len(playback.times) - 1):
        browser.evaluate(f"{player}.seek({float(playback.times[k])!r})")
        browser.wait_for(
            f"new Promise(done => requestAnimationFrame(() => setTimeout(() => done({player}.time >= 0), 50)))"
        )
        np.testing.assert_allclose(ask("camera.target"), tool[k], atol=1e-3)

    # Every layer can be drawn.
    boxes = "[...document.querySelectorAll('.layer-panel input[type=checkbox]')]"
    assert int(str(browser.evaluate(f"{boxes}.length"))) > 10
    browser.evaluate(f"{boxes}.forEach(box => box.click())")
    browser.wait_for("document.querySelectorAll('.tag.frame').length > 10")
    error = "document.querySelector('[data-part=canvas]').getContext('webgl2').getError()"
    assert browser.evaluate(f"new Promise(done => setTimeout(() => done({error}), 500))") == 0
    assert browser.complaints == []


@pytest.mark.slow
def test_the_page_of_its_own_takes_keys(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """What has the focus gets its own keys; behind a click on a step they are for the time."""
    path = tmp_path / "run.html"
    path.write_text(player_page(playback), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player').player")
    player, space = "document.querySelector('.mc-player').player", (" ", "Space", 32)
    place = json.loads(
        str(
            browser.evaluate(
                "JSON.stringify(document.querySelector('.steps button:nth-child(2)').getBoundingClientRect())"
            )
        )
    )
    for kind in ("mousePressed", "mouseReleased"):
        where = {"x": place["x"] + 20, "y": place["y"] + 8, "button": "left", "clickCount": 1}
        browser.ask("Input.dispatchMouseEvent", type=kind, **where)
    browser.wait_for(f"Math.abs({player}.time - {playback.steps[1].start}) < 1e-6")
    _press(browser, *space)
    assert browser.evaluate(f"{player}.playing")
    _press(browser, *space)
    assert not browser.evaluate(f"{player}.playing")

    for key, code, number, then in (("End", "End", 35, playback.end), ("Home", "Home", 36, playback.start)):
        browser.evaluate("document.activeElement.blur()")
        _press(browser, key, code, number)
        assert browser.evaluate(f"{player}.time") == pytest.approx(then, abs=1e-6)

    browser.evaluate("document.querySelector('.layer-panel').open = true")
    for name in ("loop", "show-path"):
        box = f"document.querySelector('[data-part={name}]')"
        before = browser.evaluate(f"{box}.focus(), {box}.checked")
        _press(browser, *space)
        assert browser.evaluate(f"{box}.checked") is not before
        assert not browser.evaluate(f"{player}.playing")

    track = "document.querySelector('[data-part=track]')"
    browser.evaluate(f"{track}.focus()")
    assert browser.evaluate(f"document.activeElement === {track}")
    for key, code, number, then in (
        ("End", "End", 35, playback.end),
        ("ArrowDown", "ArrowDown", 40, playback.end - 0.1),
        ("Home", "Home", 36, playback.start),
        ("ArrowRight", "ArrowRight", 39, playback.start + 0.1),
    ):
        _press(browser, key, code, number)
        assert browser.evaluate(f"{player}.time") == pytest.approx(then, abs=1e-6)
    ends = [browser.evaluate(f"Number({track}.getAttribute('aria-value{name}'))") for name in ("min", "max")]
    assert ends == pytest.approx([playback.start, playback.end], abs=0.005)
    browser.wait_for(f"{track}.getAttribute('aria-valuetext').startsWith('0.10 s')")
    assert browser.complaints == []


@pytest.mark.slow
def test_the_page_opens_at_the_failure_with_its_cause(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """The failed step is marked, what did not begin is listed, and the margin of a missed expectation is chosen."""
    assert playback.verdict is not None
    (curve, *_) = playback.margins
    failed, missed = playback.steps[1], curve.outcome.name
    steps = (playback.steps[0], replace(failed, outcome="failed"))
    rest = tuple(replace(step, outcome="not_run", started=None, ended=None) for step in playback.verdict.steps[2:])
    causes = (
        Cause("step failed", "it slipped", failed.end, Written("task.yaml:7"), "hold it", step=failed.id),
        Cause("expectation fails", "too far", 1.5, expectation=missed),
    )
    verdict = replace(playback.verdict, verdict="failed", steps=(*playback.verdict.steps[:2], *rest))
    path = tmp_path / "failed.html"
    path.write_text(player_page(replace(playback, steps=steps, verdict=verdict, causes=causes)), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player')?.player")
    player = "document.querySelector('.mc-player').player"
    assert browser.evaluate(f"{player}.time") == pytest.approx(failed.end, abs=1e-3)
    browser.wait_for(f"document.querySelector('.steps .now')?.textContent.includes({json.dumps(failed.label)})")
    panel = str(browser.evaluate("document.querySelector('.causes').innerText"))
    assert all(text in panel for text in ("step failed", "it slipped", "hint: hold it", "task.yaml:7", "1 more"))
    seen = "(e => { const b = e.getBoundingClientRect(); return b.top >= 0 && b.bottom <= innerHeight; })"
    assert browser.evaluate(f"{seen}(document.querySelector('.causes'))"), "without scrolling"
    unbegun = str(browser.evaluate("[...document.querySelectorAll('.steps .unbegun')].map(e => e.innerText).join()"))
    assert unbegun.count("not begun") == len(rest) > 0
    # The second failure is an expectation; its margin is shown.
    _press(browser, "f", "KeyF", 70)
    assert browser.evaluate(f"{player}.time") == pytest.approx(1.5, abs=1e-3)
    chosen = "[...document.querySelectorAll('.choose select')].map(e => e.selectedOptions[0].text).join()"
    assert str(browser.evaluate(chosen)).startswith(f"margins,{missed}")
    # The address decides before the failure does.
    browser.open(f"{path.as_uri()}?t=0.4")
    browser.wait_for("!!document.querySelector('.mc-player')?.player")
    assert browser.evaluate(f"{player}.time") == pytest.approx(0.4)
    browser.evaluate("location.hash = 't=0.9'")
    browser.wait_for(f"Math.abs({player}.time - 0.9) < 1e-6")
    assert browser.complaints == []


@pytest.mark.slow
def test_the_curves_answer_the_pointer(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """Oracle: the recorded positions at the time under the pointer."""
    path = tmp_path / "run.html"
    path.write_text(player_page(playback), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player')?.player")
    place = json.loads(str(browser.evaluate(f"JSON.stringify({PLOT}.getBoundingClientRect())")))
    x, y = place["x"] + 0.6 * place["width"], place["y"] + 0.5 * place["height"]
    browser.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    browser.wait_for("!document.querySelector('[data-part=values]').hidden")
    told = str(browser.evaluate("document.querySelector('[data-part=values]').innerText")).split("\n")
    time_of = float(told[0].split(" s")[0])
    assert 0.4 * playback.end < time_of < 0.8 * playback.end
    shown = " ".join(told)
    for k, name in enumerate(playback.joint_names):
        value = np.interp(time_of, playback.times, playback.position[:, k])
        (text,) = re.findall(rf"{name} (\S+) (?:rad|m)\b", shown)
        assert float(text) == pytest.approx(value, abs=2e-3), name
    # The legend switches a series off, and its value goes.
    first = "document.querySelector('.legend button')"
    browser.evaluate(f"{first}.click()")
    browser.wait_for(f"{first}.getAttribute('aria-pressed') === 'false'")
    browser.wait_for(
        f"!document.querySelector('[data-part=values]').innerText.includes({json.dumps(playback.joint_names[0])})"
    )
    assert browser.complaints == []


@pytest.mark.slow
def test_margins_are_those_of_the_verdict(playback: Playback) -> None:
    """Oracle: the margin of the verdict is between the least where it counts, and the least with one interval more."""
    assert playback.margins
    for curve in playback.margins:
        least, more = (curve.margins[curve.times >= since].min() for since in (curve.since, curve.since - 1.0 / RATE))
        assert more <= curve.outcome.margin <= least


@pytest.mark.slow
def test_long_names_leave_the_page_as_wide_as_it_is(browser: Page, playback: Playback, tmp_path: Path) -> None:
    """Nothing is cut or scrolls sideways; of every step its time is seen, and all of the legend."""
    long = "a_name_that_goes_on_and_on_until_nobody_wants_to_read_it_any_more_and_then_some"
    steps = tuple(replace(step, label=f"{long}_{step.label}") for step in playback.steps)
    path = tmp_path / "run.html"
    path.write_text(player_page(replace(playback, name=long, steps=steps, lost=long)), "utf-8")
    for width in (360, 800, 1280):
        browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=False)
        browser.open(path.as_uri())
        browser.wait_for("!!document.querySelector('.mc-player')?.player")
        assert browser.evaluate("document.documentElement.scrollWidth <= window.innerWidth") is True, width
        wide = "[...document.querySelectorAll('.steps, .caption, .view')].every(e => e.scrollWidth <= e.clientWidth)"
        assert browser.evaluate(wide) is True, width
        high = "(e => e.scrollHeight <= e.clientHeight)(document.querySelector('.side'))"
        assert browser.evaluate(high) is True, width
    assert browser.complaints == []


def test_hundreds_of_steps_are_on_the_track(browser: Page, playback: Playback, tmp_path: Path) -> None:
    first, length = playback.steps[0], (playback.end - playback.start) / 360
    begins = [playback.start + k * length for k in range(360)]
    steps = tuple(replace(first, id=f"s_{k}", start=t, end=t + length, phases=()) for k, t in enumerate(begins))
    path = tmp_path / "run.html"
    path.write_text(player_page(replace(playback, steps=steps)), "utf-8")
    browser.open(path.as_uri())
    browser.wait_for("!!document.querySelector('.mc-player')?.player")
    track = "document.querySelector('.track').getBoundingClientRect()"
    right = "Math.max(...[...document.querySelectorAll('.track .step')].map((e) => e.getBoundingClientRect().right))"
    assert browser.evaluate(f"{right} - {track}.right") < 1.5
    middle = "document.querySelectorAll('.track .step')[180].getBoundingClientRect()"
    assert browser.evaluate(f"Math.abs(({middle}.left - {track}.left) / {track}.width - 0.5)") < 0.01
    assert browser.complaints == []


@pytest.mark.slow
def test_the_page_that_is_served_plays(browser: Page, playback: Playback) -> None:
    with PageServer(player_page(playback), port=0) as server:
        browser.open(server.url)
        browser.wait_for("!!document.querySelector('.mc-player')?.player")
        _until(browser, _is_drawn)
        browser.evaluate("document.querySelector('[data-part=play]').click()")
        browser.wait_for("document.querySelector('.mc-player').player.time > 0.2")
        outside = [url for url in browser.requests if not url.startswith(("data:", "blob:"))]
        assert outside == [f"{server.url}/"]
        assert browser.complaints == []


@pytest.mark.slow
def test_a_page_grows_with_its_moments_and_not_with_the_rate_of_the_log(tmp_path: Path) -> None:
    """A minute at 1 kHz is a page of 3000 moments."""
    task = tmp_path / "long.yaml"
    task.write_text(
        f"task: long\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
        "simulation: {engine: kinematic}\nsteps: [{wait: 60 s}]\nexpect: [{duration: {below: 70 s}}]\n"
    )
    run_task(task, log=tmp_path / "long.mcap", allow_outside=True)
    shutil.copytree(ROOT / "robots" / "arm7_hand3", tmp_path / "arm7_hand3")
    shown = open_playback(tmp_path / "long.mcap")
    assert shown.end >= 60.0
    assert len(shown.times) == pytest.approx(RATE * shown.end, abs=2)
    assert shown.notes == ()
