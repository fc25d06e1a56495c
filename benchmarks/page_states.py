"""python -m benchmarks.page_states DIR [--axe axe.min.js]: states of the pages as pictures, and what is wrong there.

Draws the states below in three sizes, light and dark, in a headless Chromium: a picture of each in DIR, and contact
sheets. Prints what axe-core finds in each, requests that leave the machine, and lines of the console; exits with 1 if
there are any. axe-core is not part of manipcli: `npm pack axe-core`, then give its axe.min.js.

python -m benchmarks.page_states --rates A.html B.html ...: frames per second of playing pages, as ratios to the first.
"""

from __future__ import annotations

import argparse
import io
import json
import statistics
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PIL import Image, ImageDraw

from benchmarks.browser import PROGRAM, Page, started
from manipcli.cli.app import main as main_of_manipcli
from manipcli.logs.replay import open_playback
from manipcli.logs.report import log_page
from manipcli.pipeline import run_task
from manipcli.replay.player import player_page
from manipcli.report.html.render_page import render_page

ROOT: Final = Path(__file__).parents[1]
TASK: Final = ROOT / "examples" / "02_pick_a_block" / "task.yaml"
SWEPT: Final = ROOT / "tasks" / "push.yaml"
SIZES: Final = {"desk": (1280, 800), "tablet": (768, 1024), "phone": (360, 740)}
SCHEMES: Final = ("light", "dark")
READY: Final = (
    "document.readyState === 'complete' && [...document.querySelectorAll('.mc-player')].every((one) => one.player)"
)
PLAYER: Final = "document.querySelector('.mc-player').player"


@dataclass(frozen=True, slots=True)
class State:
    """A state of a page.

    Attributes:
        name: of its picture.
        page: name of the page.
        does: what leads there: a script, `press KEY`, or `point SELECTOR X Y`.
        address: appended to the URL.
    """

    name: str
    page: str
    does: tuple[str, ...] = ()
    address: str = ""


@dataclass(frozen=True, slots=True)
class Seen:
    """What a state shows, and what is wrong with it: one line each."""

    picture: bytes
    wrong: tuple[str, ...]


def chosen(name: str, value: str) -> str:
    """A script that chooses an option of the plot by its text."""
    return (
        f"(e => {{ e.value = [...e.options].find((o) => o.text === {value!r}).value; "
        f"e.dispatchEvent(new Event('change')); }})(document.querySelector('[data-part={name}]'))"
    )


def _shown(selector: str) -> str:
    return f"document.querySelector({selector!r}).scrollIntoView()"


PLOT: Final = "[data-part=plot]"
STATES: Final = (
    State("opened at the failure", "failed"),
    State("all causes", "failed", ("document.querySelector('.causes details').open = true",)),
    State("next failure", "failed", ("press f",)),
    State("address", "failed", address="#t=1.9"),
    State("opened at the start", "passed"),
    State("in the middle", "passed", (f"{PLAYER}.seek(3.2)",)),
    State("at the end", "passed", ("press End",)),
    State("next step", "passed", ("press n", "press n")),
    State("playing", "passed", (f"{PLAYER}.play(true)",)),
    State("keys", "passed", ("press ?",)),
    State("values at the pointer", "passed", (_shown(PLOT), f"point {PLOT} 0.6 0.5")),
    State("series off", "passed", (_shown(PLOT), "document.querySelectorAll('.legend button')[5].click()")),
    State("limits", "passed", (chosen("table", "joint velocity"), chosen("column", "panda_joint6"), _shown(PLOT))),
    State("all margins", "passed", (chosen("table", "margins"), _shown(PLOT))),
    State("one margin", "passed", (chosen("table", "margins"), chosen("column", "near"), _shown(PLOT))),
    State("a second", "passed", (f"{PLAYER}.seek(3.2)", chosen("span", "2 s"), _shown(PLOT))),
    State("forces", "passed", (chosen("table", "contact force"), f"{PLAYER}.seek(3.2)", _shown(PLOT))),
    State("report", "report"),
    State("replay in the report", "report", (_shown("#replay"),)),
    State("numbers in the report", "report", (_shown("#grasps"),)),
    State("report of a passed run", "report_passed"),
    State("sweep", "sweep"),
    State("plots of the sweep", "sweep", (_shown("#small"),)),
    State("sample of the sweep", "sweep", ("document.querySelector('#small g').dispatchEvent(new Event('click'))",)),
)


def visit(browser: Page, url: str, state: State, size: tuple[int, int], scheme: str, *, axe: str = "") -> Seen:
    """Open a state and look at it. `axe`: the source of axe-core; "" to leave it out."""
    wide, high = size
    phone = wide < 500
    browser.ask("Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=phone)
    browser.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    for kept in (browser.requests, browser.messages, browser.complaints):
        kept.clear()
    browser.open("about:blank")
    browser.open(url + state.address)
    browser.wait_for(READY)
    for action in state.does:
        match action.split(" "):
            case ["press", key]:
                browser.press(key)
            case ["point", selector, x, y]:
                browser.point(selector, float(x), float(y))
            case _:
                browser.evaluate(f"void ({action})")
    browser.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    wrong = [f"console: {text}" for text in (*browser.messages, *browser.complaints)]
    wrong += [f"request: {one}" for one in browser.requests if not one.startswith(("data:", "blob:", "about:", url))]
    if browser.evaluate("document.documentElement.scrollWidth > window.innerWidth"):
        wrong.append("layout: the page scrolls sideways")
    picture = browser.screenshot()
    if axe:
        browser.evaluate(axe)
        run = "axe.run({resultTypes: ['violations']}).then((found) => JSON.stringify(found.violations))"
        found = json.loads(str(browser.evaluate(run)))
        wrong += [
            f"axe: {one['id']} ({one['impact']}): {node['target'][0]} {node.get('failureSummary', '')}".replace(
                "\n", " "
            )
            for one in found
            for node in one["nodes"]
        ]
    return Seen(picture, tuple(wrong))


def pages(folder: Path) -> dict[str, str]:
    """The pages of a run that passes, of one that does not, and of a sweep: their URLs."""
    found = {"sweep": _sweep(folder)}
    for name, overrides in (("passed", []), ("failed", ["scene.block.friction=0.01"])):
        log = folder / f"{name}.mcap"
        run = run_task(TASK, log=log, overrides=overrides)
        texts = {name: player_page(open_playback(log, meshes=run.meshes))}
        texts["report" if name == "failed" else "report_passed"] = render_page(log_page(log, meshes=run.meshes))
        for page, text in texts.items():
            file = folder / f"{page}.html"
            file.write_text(text, "utf-8")
            found[page] = file.as_uri()
    return found


def _sweep(folder: Path) -> str:
    page = folder / "sweep.html"
    words = ["--samples", "8", "--html", page, "--folder", folder / "sweep"]
    if main_of_manipcli(["sweep", str(SWEPT), *map(str, words)]) not in (0, 1):
        raise SystemExit("the sweep of the states did not run")
    return page.as_uri()


def frame_rates(browser: Page, urls: Sequence[str], *, seconds: float = 3.0, rounds: int = 3) -> list[float]:
    """Frames per second of each page while it plays, at least ten frames: the median of some rounds that alternate."""
    count = (
        "new Promise((done) => { let n = 0; const start = performance.now(); const next = (t) => { n++; "
        "if (t < start + %d || n < 10) requestAnimationFrame(next); else done(1000 * n / (t - start)); }; "
        "requestAnimationFrame(next); })"
    )
    found: list[list[float]] = [[] for _ in urls]
    for _ in range(rounds):
        for url, rates in zip(urls, found, strict=True):
            browser.open(url)
            browser.wait_for(READY)
            browser.evaluate("document.querySelector('[data-part=loop]').checked = true")
            browser.evaluate(f"{PLAYER}.seek(0), {PLAYER}.play(true)")
            rates.append(float(str(browser.evaluate(count % (1000.0 * seconds)))))
    return [statistics.median(rates) for rates in found]


def _sheet(pictures: Sequence[tuple[str, bytes]], file: Path) -> None:
    """One picture of many, each under its name, 400 pixels wide."""
    images = [(name, Image.open(io.BytesIO(data)).convert("RGB")) for name, data in pictures]
    images = [(name, image.resize((400, round(400 * image.height / image.width)))) for name, image in images]
    columns, row = 4, max(image.height for _, image in images) + 18
    whole = Image.new("RGB", (columns * 408, -(-len(images) // columns) * row), "#888888")
    pen = ImageDraw.Draw(whole)
    for k, (name, image) in enumerate(images):
        x, y = k % columns * 408, k // columns * row
        pen.text((x + 4, y + 3), name, fill="white")
        whole.paste(image, (x, y + 16))
    whole.save(file)


def main() -> int:
    """Draw all states, or measure frame rates."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.page_states", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="for the pictures")
    parser.add_argument("--axe", type=Path, help="axe.min.js of axe-core")
    parser.add_argument("--rates", type=Path, nargs="+", help="pages whose frame rates are compared")
    options = parser.parse_args()
    if PROGRAM is None:
        print("no Chromium is installed (Debian: apt-get install chromium)", file=sys.stderr)
        return 4
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as kept:
        temporary = Path(kept)
        with started(PROGRAM, temporary / "profile") as browser:
            if options.rates:
                rates = frame_rates(browser, [file.resolve().as_uri() for file in options.rates])
                for file, rate in zip(options.rates, rates, strict=True):
                    print(f"{file}: {rate:.1f} frames per second, {rate / rates[0]:.2f} of the first")
                return 0
            if options.folder is None:
                parser.error("a folder for the pictures is missing")
            return _draw(
                browser, pages(temporary), options.folder, axe=options.axe.read_text("utf-8") if options.axe else ""
            )


def _draw(browser: Page, urls: dict[str, str], folder: Path, *, axe: str) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    bad = 0
    for name, size in SIZES.items():
        for scheme in SCHEMES:
            pictures = []
            for state in STATES:
                seen = visit(browser, urls[state.page], state, size, scheme, axe=axe)
                pictures.append((state.name, seen.picture))
                (folder / f"{state.name.replace(' ', '_')}-{name}-{scheme}.png").write_bytes(seen.picture)
                for line in seen.wrong:
                    print(f"{state.name}, {name}, {scheme}: {line}")
                bad += len(seen.wrong)
            _sheet(pictures, folder / f"sheet-{name}-{scheme}.png")
    axes = "axe-core" if axe else "no axe-core"
    print(f"{len(STATES)} states, {len(SIZES)} sizes, {len(SCHEMES)} schemes, {axes}: {bad} findings")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
