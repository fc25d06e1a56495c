"""Steps and messages on the page, from the messages of the log."""

from __future__ import annotations

from manipcli.live.page.story import SHOWN, Story
from manipcli.live.page.texts import steps
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
    assert [text for _, _, text in story.messages] == [
        f"refused error: number {k}" for k in range(2 * SHOWN, 3 * SHOWN)
    ]
    assert {level for _, level, _ in story.messages} == {40}
