"""Steps and messages on the page, from the messages of the log."""

from __future__ import annotations

from dataclasses import replace

import pytest

from manipcli.live.page.service_calls import PAUSED
from manipcli.live.page.snapshot import ENDED, RESETTING, Snapshot
from manipcli.live.page.story import SHOWN, Story
from manipcli.live.page.texts import status, steps
from manipcli.model.state import WorldState
from manipcli.record.channels import EVENTS, ROSOUT
from manipcli.record.messages import event_message, log_message
from manipcli.record.recording import TaskEvent


def hear(story: Story, kind: str, step: str = "", verb: str = "", outcome: str = "", text: str = "") -> None:
    event = TaskEvent(1.0, kind, step, verb, outcome, text, "task.yaml:3:1")
    story.hear(EVENTS, event_message(10**9, event))
    story.hear(ROSOUT, log_message(10**9, event))
    story.hear("/tf", b"no event")


def test_steps_have_their_last_state() -> None:
    story = Story()
    assert not story.read()
    hear(story, "step_started", "pick_1", "pick")
    hear(story, "phase_started", "pick_1", "pick", text="approach")
    assert story.read()
    assert story.steps == {"pick_1": ("pick: approach", "running")}
    hear(story, "step_ended", "pick_1", "pick", "done", "gripped")
    hear(story, "step_skipped", "place_1", "place", "skipped", "took else")
    hear(story, "step_started", "move_1", "move")
    hear(story, "step_ended", "move_1", "move", "failed", "a joint <stalled>")
    hear(story, "branch", "if_1", "if", "", "then")
    story.read()
    assert story.steps == {
        "pick_1": ("pick", "done"),
        "place_1": ("took else", "skipped"),
        "move_1": ("a joint <stalled>", "failed"),
    }
    shown = steps(story.steps)
    assert "✓</span> pick_1" in shown
    assert "✗</span> move_1" in shown
    assert "a joint &lt;stalled&gt;" in shown
    hear(story, "session_started")
    story.read()
    assert story.steps == {}, "after a reset"


def test_the_emergency_stop_lasts_until_its_release_or_a_reset() -> None:
    story = Story()
    for kind, stopped in (
        ("emergency_stop", True), ("refused", True), ("emergency_stop_released", False),
        ("emergency_stop", True), ("session_started", False),
    ):  # fmt: skip
        hear(story, kind, outcome="error")
        story.read()
        assert story.stopped is stopped


def test_only_the_last_messages_are_kept() -> None:
    story = Story()
    for k in range(3 * SHOWN):
        hear(story, "refused", outcome="error", text=f"number {k}")
    story.read()
    assert [text for _, _, text in story.messages] == [f"refused: number {k}" for k in range(2 * SHOWN, 3 * SHOWN)]
    assert {level for _, level, _ in story.messages} == {40}
    hear(story, "session_started")
    hear(story, "goal_sent", text="arm_controller")
    story.read()
    assert [text for _, _, text in story.messages] == ["session started", "goal sent: arm_controller"], "after a reset"


@pytest.mark.parametrize(
    ("kind", "text", "shown"),
    [
        ("emergency_stop", "emergency stop: brakes hold", "emergency stop: brakes hold"),
        ("emergency_stop_released", "emergency stop released: arm", "emergency stop released: arm"),
        ("refused", "out of reach: 2 m", "refused: out of reach: 2 m"),
        ("simulation_reset", "", "simulation reset"),
    ],
)
def test_no_message_says_anything_twice(kind: str, text: str, shown: str) -> None:
    story = Story()
    for outcome in ("error", ""):
        hear(story, kind, outcome=outcome, text=text)
        story.read()
        assert story.messages.pop()[2] == shown


def test_a_session_ends_or_is_reset() -> None:
    story = Story()
    snapshot = Snapshot(12.34, WorldState.room(1, 0), simulation=1)
    for kind, phase, words in (
        ("session_started", "", "real-time factor 1.00"),
        ("simulation_reset", RESETTING, "t = 12.34 s</b> · <b>resetting"),
        ("session_started", "", "real-time factor 1.00"),
        ("session_ended", ENDED, "session ended"),
    ):
        hear(story, kind)
        story.read()
        assert story.phase == phase
        shown = status(replace(snapshot, phase=story.phase), 1.0)
        assert words in shown
        assert "t = 12.34 s" in shown
        assert ("real-time" in shown) is (phase == "")


def test_what_can_be_done_is_said() -> None:
    snapshot = Snapshot(1.0, WorldState.room(1, 0), simulation=PAUSED)
    assert "wait for Play" in status(snapshot, None)
    assert "Release emergency stop" in status(replace(snapshot, stopped=True), None)
