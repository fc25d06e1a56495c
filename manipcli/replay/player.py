"""HTML player of a run: one self-contained file that needs no server.

`player_html` is an element of a larger page, `player_page` a whole page. The browser gets the triangles once and the
joint positions at the times that interpolation needs, and computes the kinematics itself.
"""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files

from manipcli.render.drawing import draw
from manipcli.replay.cause import Cause
from manipcli.replay.curves_json import curves_json
from manipcli.replay.ghost import Ghost
from manipcli.replay.motion_json import motion_json
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback
from manipcli.replay.scene_json import scene_json
from manipcli.replay.sensed_json import sensed_json
from manipcli.replay.theme import colours, switch

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
"""Content-Security-Policy of a whole page: it loads nothing."""
_PAGE = files("manipcli.replay").joinpath("page")


def player_html(playback: Playback, *, ghosts: Sequence[Ghost] = (), whole_page: bool = False) -> str:
    """A run as an HTML element with its own style and script; a page can hold several.

    Args:
        playback: the run.
        ghosts: other runs of the same task, drawn over it.
        whole_page: the element is alone on its page and takes the keyboard.
    """
    head, data, senses = _contents(playback, ghosts)
    script = "".join(map(_read, _scripts()))
    style = _read("player.css") + _read("3_scene/scene.css")
    if senses:
        script, style = script + _read("sensors/sensors.js"), style + _read("sensors/sensors.css")
    return (
        f'<div class="mc-player"{" data-page=1" if whole_page else ""}>\n'
        f"<style>\n{style}</style>\n"
        f"{_read('player.html')}"
        f'<script type="application/json" data-part="head">{head}</script>\n'
        f'<script type="text/plain" data-part="data">{data}</script>\n'
        f"<script>(function () {{\n{script}}})();</script>\n</div>\n"
    )


def player_page(playback: Playback, *, ghosts: Sequence[Ghost] = ()) -> str:
    """A whole page: task, verdict, notes and player; `ghosts` are drawn over the run."""
    verdict = playback.verdict
    name = html.escape(playback.name)
    lines = []
    if verdict is not None:
        good = verdict.verdict == "passed"
        word = f"{'✓' if good else '✗'} {verdict.verdict}"
        # The causes stand beside the scene.
        text = "" if playback.causes else f" {html.escape(verdict.text)}"
        lines.append(f'<p><b class="{"good" if good else "bad"}">{word}</b>{text}</p>')
    if playback.lost is not None:
        lines.append(f'<p class="bad">The log is incomplete: {html.escape(playback.lost)}</p>')
    lines += [f'<p class="note">{html.escape(note)}</p>' for note in playback.notes]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{name}</title><link rel="icon" href="data:,">\n'
        f"<style>\n{colours()}{_read('whole_page.css')}"
        f"</style></head><body>\n<header>{switch()}<h1>{name}</h1>{''.join(lines)}</header>\n"
        f"<main>{player_html(playback, ghosts=ghosts, whole_page=True)}</main></body></html>\n"
    )


def _scripts() -> list[str]:
    """The scripts in the order of their names; those of a folder where its name is."""
    names = [file.name for file in _PAGE.iterdir() if file.name.endswith(".js")]
    names += [f"3_scene/{file.name}" for file in _PAGE.joinpath("3_scene").iterdir() if file.name.endswith(".js")]
    return sorted(names)


def _read(name: str) -> str:
    return _PAGE.joinpath(name).read_text("utf-8")


def _contents(playback: Playback, ghosts: Sequence[Ghost]) -> tuple[str, str, bool]:
    """Input of the script: the head as JSON that is safe in a script element, the packed arrays, and whether there is
    anything of sensors."""
    pack = Pack()
    drawing = draw(playback.robot, playback.scene)
    head: Json = {
        "name": playback.name,
        "start": playback.start,
        "end": playback.end,
        "steps": [asdict(step) for step in playback.steps],
        "unbegun": _unbegun(playback),
        "causes": [_cause(cause) for cause in playback.causes],
        "joints": playback.joint_names,
        "bodies": playback.body_position.shape[1],
        **motion_json(playback, ghosts, pack),
        **scene_json(playback, drawing, pack),
        **curves_json(playback, pack),
    }
    sensed = playback.sensed(drawing.frames)
    if sensed:
        head["senses"] = sensed_json(sensed, {name: k for k, name in enumerate(drawing.frames)}, pack)
    text = json.dumps(head, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    # These three occur only in JSON strings; a name must not end the script element.
    safe = text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
    return safe, pack.text(), bool(sensed)


def _cause(cause: Cause) -> Json:
    where = cause.written
    place = "" if where is None else where.place or (f"{where.file}:{where.line}" if where.line else "")
    shown = {key: getattr(cause, key) for key in ("title", "text", "hint", "at", "step", "expectation")}
    return {**shown, "place": place}


def _unbegun(playback: Playback) -> list[Json]:
    """The steps that were skipped or not begun, each with the number of steps that are listed before it."""
    index = {step.id: k for k, step in enumerate(playback.steps, 1)}
    found: list[Json] = []
    after = 0
    for step in playback.verdict.steps if playback.verdict is not None else ():
        after = index.get(step.id, after)
        if step.outcome in ("skipped", "not_run"):
            word = "skipped" if step.outcome == "skipped" else "not begun"
            found.append({"id": step.id, "label": step.label, "word": word, "text": step.text, "after": after})
    return found
