"""The page that plays by itself: complete, harmless, and true to the run; what it draws over the scene."""

from __future__ import annotations

import base64
import json
import re
import warnings
import zlib
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import RobotModel, Tool
from manipcli.model.state import Contact, ContactPoint
from manipcli.render.drawing import draw
from manipcli.render.placing import Placing
from manipcli.replay.level_of_detail import POSITION
from manipcli.replay.playback import Phase, Playback, PlaybackStep
from manipcli.replay.player import player_html, player_page
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Sphere

HOSTILE = "</script><script>alert(1)</script><!-- \u2028 & 'x' \"y\""


def _body(name: str, shape: Box | Sphere, z: float, *, fixed: bool) -> Body:
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape),), mass=1.0, X_OI=Transform.identity(),
        inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0, spinning_friction=0.0, restitution=0.0,
        fixed=fixed, X_WO=Transform.of(xyz=(1.0, 2.0, z)), interior=None, size=frozen([1.0] * 3),
        centre=frozen([0.0] * 3),
    )  # fmt: skip


def _robot() -> RobotModel:
    box = (Geometry(Transform.of(xyz=(0.0, 0.0, 0.1)), Box((0.05, 0.05, 0.2))),)
    links = tuple(Link(name, None, box, box) for name in ("base", "upper", "slide"))
    limits = JointLimits(-1.0, 1.0, 1.0, 1.0)
    joints = (
        Joint("turn", "revolute", "base", "upper", Transform.of(rpy=(0.3, 0, 0)), np.array([0, 0.6, 0.8]), limits),
        Joint("push", "prismatic", "upper", "slide", Transform.of(xyz=(0, 0, 0.2)), np.array([1.0, 0, 0]), limits),
    )
    X_WB, tool = Transform.of(xyz=(1.0, 1.5, 0.5)), Tool("slide", Transform.of(xyz=(0.0, 0.0, 0.1)))
    return RobotModel("two", "base", links, joints, (), (), (), X_WB, "<robot/>", tool)


@pytest.fixture(scope="module")
def playback() -> Playback:
    """Half a second: joints move, a ball of radius 0.1 lies on a table whose top is at 0.5."""
    times = np.arange(26) * 0.02
    position = np.stack([np.sin(times), 0.2 * times], axis=1)
    ball = np.tile([1.0, 2.0, 0.6, 0.0, 0.0, 0.0, 1.0], (26, 1, 1))
    ball[:, 0, 0] += 0.1 * times
    points = (
        ContactPoint((1.0, 2.0, 0.5), (0.0, 0.0, 1.0), 4.0, (0.5, 0.0, 0.0)),
        ContactPoint((1.01, 2.0, 0.5), (0.0, 0.0, 1.0), 1.0, (0.0, 0.25, 0.0)),
        ContactPoint((1.02, 2.0, 0.5), (0.0, 0.0, 1.0), 0.0, (0.0, 0.0, 0.0)),
    )
    lies = Contact("ball", "table", 5.0, 0.0, points)
    return Playback(
        name=HOSTILE,
        robot=_robot(),
        scene=Scene(
            (_body("table", Box((2.0, 2.0, 1.0)), 0.0, fixed=True), _body("ball", Sphere(0.1), 0.6, fixed=False)),
            (),
            frozen([0.0, 0.0, -9.8]),
        ),
        joint_names=("turn", "push"),
        times=times,
        position=position,
        velocity=np.zeros_like(position),
        effort=np.full_like(position, np.nan),
        reference=np.stack([np.sin(times) + 0.01, np.full(26, np.nan)], axis=1),
        body_position=ball[..., :3],
        body_quat_xyzw=ball[..., 3:],
        contacts=((lies,),) * 26,
        contact_times=((0.0,),) * 26,
        steps=(
            PlaybackStep("one", "move", "one", 0.0, 0.2, "done", phases=(Phase("move", 0.0, 0.2),)),
            PlaybackStep("b", "wait", HOSTILE, 0.2, 0.5, "failed", text=HOSTILE),
        ),
    )


class _Elements(HTMLParser):
    """Every element, its attributes, and the text of each script."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self._in_script = False
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        self._in_script = tag == "script"

    def handle_endtag(self, tag: str) -> None:
        self._in_script = False

    def handle_data(self, data: str) -> None:
        if self._in_script:
            self.scripts.append(data)


def _array(reference: list[object], data: str) -> np.ndarray:
    kind, offset, count = reference
    dtype = np.dtype({"f": "<f4", "H": "<u2", "I": "<u4", "b": "i1"}[str(kind)])
    return np.frombuffer(zlib.decompress(base64.b64decode(data)), dtype, int(str(count)), int(str(offset)))


def test_the_page_needs_nothing_but_itself(playback: Playback) -> None:
    page = player_page(playback)
    for tag, attributes in _Elements(page).found:
        for name in ("src", "href", "data", "action", "poster", "srcset"):
            value = attributes.get(name) or ""
            assert value == "" or value == "data:,", (tag, name, value)
    assert not re.search(r"https?://|@import|url\(|fetch\(|XMLHttpRequest|WebSocket|import\(", page)
    assert "default-src 'none'" in page
    assert player_page(playback) == page  # the same bytes every time


def test_no_name_leaves_its_place(playback: Playback) -> None:
    page = player_page(playback)
    elements = _Elements(page)
    assert len(elements.scripts) == 4
    assert all("alert(1)" not in text for text in elements.scripts[2:])
    head = json.loads(elements.scripts[1])
    assert head["name"] == HOSTILE
    assert [step["label"] for step in head["steps"]] == ["one", HOSTILE]
    assert head["steps"][1]["text"] == HOSTILE


def test_two_of_them_stand_in_one_page(playback: Playback) -> None:
    elements = _Elements(player_html(playback) + player_html(playback))
    assert len([1 for tag, attributes in elements.found if attributes.get("class") == "mc-player"]) == 2
    assert [attributes["id"] for _, attributes in elements.found if "id" in attributes] == []


def test_triangles_and_joints_are_those_of_the_run(playback: Playback) -> None:
    _, head, data, _ = _Elements(player_page(playback)).scripts
    told = json.loads(head)
    rows = np.searchsorted(playback.times, _array(told["times"], data) - 1e-4)
    np.testing.assert_allclose(_array(told["position"], data).reshape(-1, 2), playback.position[rows], atol=1e-7)
    reference = _array(told["reference"], data).reshape(-1, 2)
    np.testing.assert_allclose(reference[:, 1], playback.position[rows, 1], atol=1e-7)
    drawing = draw(playback.robot, playback.scene)
    visual = drawing.layer("visual")
    assert [drawing.frames[one["frame"]] for one in told["drawables"]] == [one.frame for one in visual]
    for shown, one in zip(told["drawables"], visual, strict=True):
        surface = told["surfaces"][shown["surface"]]
        places = _array(surface["places"], data).reshape(-1, 4)[:, :3] / 65535.0
        at = np.array(surface["low"]) + np.array(surface["size"]) * places
        np.testing.assert_allclose(at, one.surface.vertices, atol=2.0 / 65535.0)
        np.testing.assert_array_equal(_array(surface["faces"], data).reshape(-1, 3), one.surface.faces)
    # The three links look the same: their triangles are there once.
    assert len(told["surfaces"]) == len(visual) - 2
    place = {frame: k for k, frame in enumerate(told["order"])}
    assert sorted(told["order"]) == list(range(len(drawing.frames)))
    for k, frame in enumerate(told["frames"]):
        assert place[frame.get("parent", 0)] <= place[k]


def test_what_is_too_large_for_the_browser_is_as_large_as_its_numbers_get(playback: Playback) -> None:
    effort = playback.effort.copy()
    effort[3, 1] = 1e300
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, head, data, _ = _Elements(player_page(replace(playback, effort=effort))).scripts
    (table,) = [one for one in json.loads(head)["curves"] if one["name"] == "joint effort"]
    row = _array(table["times"], data).tolist().index(np.float32(playback.times[3]))
    values = _array(table["values"], data).reshape(-1, len(table["columns"]))
    assert np.isfinite(values[row]).all() and values[row].max() > 1e38


def test_the_page_has_the_force_and_the_friction_of_each_point(playback: Playback) -> None:
    _, head, data, _ = _Elements(player_page(playback)).scripts
    pushes = json.loads(head)["pushes"]
    first, rows = _array(pushes["first"], data), _array(pushes["rows"], data).reshape(-1, 9)
    # They do not change relative to the ball, which carries them along.
    assert _array(pushes["times"], data).tolist() == [0.0]
    assert first.tolist() == [0, 2]
    assert [draw(playback.robot, playback.scene).frames[k] for k in pushes["frames"]] == ["ball"]
    np.testing.assert_allclose(
        rows,
        [[0.0, 0.0, -0.1, 0.0, 0.0, 4.0, 0.5, 0.0, 0.0], [0.01, 0.0, -0.1, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0]],
        atol=1e-6,
    )


def test_a_force_that_changes_is_shown_from_then_on(playback: Playback) -> None:
    (lies,) = playback.contacts[0]
    more = lies._replace(points=tuple(point._replace(force=2.0 * point.force) for point in lies.points))
    run = replace(playback, contacts=((lies,),) * 10 + ((more,),) * 16)
    _, head, data, _ = _Elements(player_page(run)).scripts
    pushes = json.loads(head)["pushes"]
    np.testing.assert_allclose(_array(pushes["times"], data), [0.0, playback.times[10]], atol=1e-7)
    assert _array(pushes["rows"], data).reshape(-1, 9)[:, 5].tolist() == [4.0, 1.0, 8.0, 2.0]


def test_a_long_page_shows_every_state_within_the_bound_and_is_small(playback: Playback) -> None:
    """A minute in which joints and ball never rest, and forces never stay; oracle: interpolation by numpy."""
    times = np.arange(3_000) * 0.02
    position = np.stack([np.sin(times), 0.2 * np.sin(1.7 * times)], axis=1)
    ball = np.tile([1.0, 2.0, 0.6, 0.0, 0.0, 0.0, 1.0], (len(times), 1, 1))
    ball[:, 0, 0] += 0.3 * np.abs(np.sin(2.0 * times))
    (lies,) = playback.contacts[0]
    noise = np.random.default_rng(3).uniform(0.5, 1.5, len(times)).tolist()
    contacts = tuple(
        (lies._replace(points=tuple(point._replace(force=factor * point.force) for point in lies.points)),)
        for factor in noise
    )
    effort = np.random.default_rng(4).normal(size=position.shape)
    long = replace(
        playback, times=times, position=position, velocity=np.gradient(position, times, axis=0), effort=effort,
        reference=position + 0.01, body_position=ball[..., :3], body_quat_xyzw=ball[..., 3:], contacts=contacts,
        contact_times=tuple((time,) for time in times.tolist()),
    )  # fmt: skip
    page = player_page(long)
    assert len(page) < 5_000_000 / 10
    _, head, data, _ = _Elements(page).scripts
    told = json.loads(head)
    kept = _array(told["times"], data).astype(float)
    joints = _array(told["position"], data).reshape(-1, 2)
    body = _array(told["body"], data).reshape(-1, 7)
    shown = np.stack([np.interp(times, kept, column) for column in joints.T], axis=1)
    placing = Placing(long.robot, long.scene)
    place = np.stack([np.interp(times, kept, column) for column in body.T[:3]], axis=1)[:, None]
    found = placing.at(shown, place, long.body_quat_xyzw)
    apart = np.linalg.norm(found.position - long.poses().position, axis=2)
    assert apart.max() < 1.01 * POSITION
    assert len(kept) < 0.6 * len(times)


def test_a_gap_is_named_and_its_ends_are_states_of_the_page(playback: Playback) -> None:
    there = np.r_[0:8, 18:26]
    run = replace(
        playback, times=playback.times[there], gaps=((0.14, 0.36),), contacts=playback.contacts[:16],
        contact_times=playback.contact_times[:16],
        **{name: getattr(playback, name)[there] for name in
           ("position", "velocity", "effort", "reference", "body_position", "body_quat_xyzw")},
    )  # fmt: skip
    _, head, data, _ = _Elements(player_page(run)).scripts
    told = json.loads(head)
    assert told["gaps"] == [[0.14, 0.36]]
    assert {np.float32(0.14), np.float32(0.36)} <= set(_array(told["times"], data))
    (table,) = [one for one in told["curves"] if one["name"] == "joint position"]
    times, values = _array(table["times"], data), _array(table["values"], data).reshape(-1, 2)
    inside = (times > 0.141) & (times < 0.359)
    assert inside.sum() == 1
    assert np.isnan(values[inside]).all() and np.isfinite(values[~inside]).all()


def test_a_page_without_points_has_no_pushes(playback: Playback) -> None:
    bare = tuple(tuple(one._replace(points=()) for one in each) for each in playback.contacts)
    assert json.loads(_Elements(player_page(replace(playback, contacts=bare))).scripts[1])["pushes"] is None
