"""The states of the page in a real browser: nothing leaves, nothing complains, nothing scrolls sideways."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.browser import Page
from benchmarks.page_states import PLAYER, SIZES, State, visit
from manipcli.core.geometry import Transform
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.judge.margin_curves import MarginCurve
from manipcli.judge.verdict import ExpectationOutcome
from manipcli.model.robot import RobotModel
from manipcli.replay.cause import Cause
from manipcli.replay.playback import Playback, PlaybackStep
from manipcli.replay.player import player_page

STATES = (
    State("opened", "failed"),
    State("keys", "failed", ("press ?",)),
    State("next sample", "failed", ("press Home", "press .")),
)


def _playback() -> Playback:
    """A second of one joint, in a step that failed; the margin of an expectation falls."""
    times = np.arange(51) * 0.02
    position = np.sin(times)[:, None]
    limits = JointLimits(-1.0, 1.0, 1.0, 1.0)
    turn = Joint("turn", "revolute", "base", "arm", Transform.of(), np.array([0.0, 0.0, 1.0]), limits)
    links = tuple(Link(name, None, (), ()) for name in ("base", "arm"))
    robot = RobotModel("one", "base", links, (turn,), (), (), (), Transform.of(), "<robot/>")
    outcome = ExpectationOutcome("still", "failed", -0.5, "rad", 1.0, "too far", -5.0)
    return Playback(
        name="one", robot=robot, scene=None, joint_names=("turn",), times=times, position=position,
        velocity=np.cos(times)[:, None], effort=np.zeros((51, 1)), reference=np.full((51, 1), np.nan),
        body_position=np.zeros((51, 0, 3)), body_quat_xyzw=np.zeros((51, 0, 4)), contacts=((),) * 51,
        contact_times=((),) * 51, steps=(PlaybackStep("move", "move", "move", 0.0, 0.9, "failed", "too far"),),
        causes=(Cause("step 'move' failed", "too far", 0.9, step="move"),),
        margins=(MarginCurve(outcome, "rad", times, 0.3 - times, 10.0 * (0.3 - times)),),
    )  # fmt: skip


@pytest.mark.slow
def test_states_of_the_page(browser: Page, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(player_page(_playback()), "utf-8")
    pictures = []
    for state, size, scheme in zip(STATES, ("desk", "tablet", "phone"), ("light", "dark", "dark"), strict=True):
        seen = visit(browser, file.as_uri(), state, SIZES[size], scheme)
        assert seen.wrong == (), state.name
        pictures.append(seen.picture)
    assert len(set(pictures)) == len(STATES)
    assert browser.evaluate(f"{PLAYER}.time") == pytest.approx(0.02)
    assert browser.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 24, 29)"
    browser.evaluate("document.querySelector('.scheme').click()")
    assert browser.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
