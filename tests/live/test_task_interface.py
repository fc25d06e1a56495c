"""Steps of clients: planned from the measured state, done, canceled and refused, in a session that is verified."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.core.errors import SimulationFailed
from manipcli.live.command import CALL_SERVICE, CANCEL_GOAL, END, SEND_GOAL, Answer, Command
from manipcli.live.live_steps import LiveSteps
from manipcli.logs.judge_log import judge_log
from manipcli.record.read.reading import read_recording
from manipcli.run.step_loop import StepLoop
from tests.live.sessions import ROOT, SMALL, simulated

POUR = ROOT / "tasks/pour.yaml"
PICK = {"pick": {"object": "cup", "approach": {"from": "side", "distance": ["8 cm", "14 cm"]},
                 "grasp": {"posture": "wrap", "force": "8 N", "height": "68 mm"}}}  # fmt: skip
LIFT, FAR = "{lift: {object: cup, by: 10 cm}}", "{wait: 5 s, id: rest}"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


class Client:
    """Commands of a client, and their answers."""

    def __init__(self) -> None:
        self.answers: dict[str, list[Answer]] = {}

    def run(self, id_: str, step: object) -> Command:
        return self._command(SEND_GOAL, "/task/run_step", id_, step)

    def check(self, id_: str, step: object) -> Command:
        return replace(self._command(CALL_SERVICE, "/task/check_step", id_, step), id="")

    def _command(self, op: str, name: str, id_: str, step: object) -> Command:
        text = step if isinstance(step, str) else json.dumps(step)
        answers = self.answers.setdefault(id_, [])
        return Command(op, name, id_, json.dumps({"step": text}), answers.append)

    def result(self, id_: str) -> Answer:
        return self.answers[id_][-1]

    def outcome(self, id_: str) -> tuple[object, ...]:
        result = self.result(id_)
        return result.status, result.values["id"], result.values["outcome"]


def test_steps_of_a_client(tmp_path: Path) -> None:
    """A pick, a lift of 10 cm, a step that is canceled, and what is refused, in one session."""
    client, log = Client(), tmp_path / "session.mcap"
    cancel = Command(CANCEL_GOAL, "/task/run_step", "rest")
    commands = {
        5: [client.check("check", PICK), client.check("early", LIFT)],
        10: [client.run("pick", PICK)],
        500: [client.run("busy", LIFT), client.check("busy check", LIFT)],
        2500: [client.run("lift", LIFT)],
        3400: [client.run("misspelt", "{pick: {object: cupp}}"), client.run("block", "{do: a.yaml}")],
        3410: [client.run("rest", FAR)],
        3600: [cancel],
        4300: [client.run("after", "{wait: 0 s}")],
        4400: [Command(END, "")],
    }
    simulated(POUR, commands, log)

    planned = pipeline.plan_task(pipeline.load_task(POUR)).steps[0].plan
    labels = [motion.label for motion in planned.motions]
    assert client.result("check").values["phases"] == labels
    assert client.result("check").values["duration"] == pytest.approx(planned.duration, abs=0.05)
    early = client.result("early").values
    assert (early["valid"], early["plannable"]) == (True, False)
    assert "the hand holds nothing" in str(early["text"])

    assert client.outcome("pick") == (SUCCEEDED, "pick@1", "done")
    assert [answer.values["phase"] for answer in client.answers["pick"][:-1]] == ["plan", *labels]
    # three fingers with 8 N each, friction 1 x 1, against a cup of 150 g and a ball of 10 g
    margin = client.result("pick").values["margin"]
    assert isinstance(margin, float)
    assert 15.0 < margin < 40.0
    assert client.result("pick").values["unit"] == "N"
    assert client.outcome("busy") == (ABORTED, "", "rejected")
    assert "step 'pick@1' is running" in str(client.result("busy").values["text"])
    assert client.result("busy check").values["plannable"] is False
    assert client.outcome("lift") == (SUCCEEDED, "lift@2", "done")
    assert client.outcome("misspelt") == (ABORTED, "", "invalid")
    text = str(client.result("misspelt").values["text"])
    assert text.startswith("step:1:17: error[TASK230]: pick.object:")
    assert "did you mean 'cup'?" in text
    assert client.outcome("block") == (ABORTED, "", "invalid")
    assert client.outcome("rest") == (CANCELED, "rest@3", "canceled")
    assert client.outcome("after") == (SUCCEEDED, "wait@4", "done")

    recording = read_recording(log)
    heights = recording.states.body_position[:, recording.body_names.index("cup"), 2]
    assert heights[3300] - heights[2400] == pytest.approx(0.1, abs=0.01)
    assert np.abs(recording.states.velocity[3700:]).max() < 0.05

    verdict = judge_log(log)
    asked = {step.id: (step.outcome, step.excused) for step in verdict.steps if "@" in step.id}
    assert asked == {
        "pick@1": ("done", True),
        "lift@2": ("done", True),
        "rest@3": ("failed", True),
        "wait@4": ("done", True),
    }
    assert "rest@3" not in verdict.text
    assert pipeline.verify_log(log).identical


def test_an_error_that_no_check_foresaw_ends_one_command_and_a_failed_simulation_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Fault(Exception):
        """As libraries define them."""

    errors = [Fault("odd"), SimulationFailed("the simulation diverged", time=0.05)]

    def planned(*_: object) -> None:
        raise RecursionError("deep")

    def check(*_: object) -> None:
        raise errors.pop(0)

    monkeypatch.setattr(StepLoop, "planned", planned)
    monkeypatch.setattr(LiveSteps, "check", check)
    (tmp_path / "small.yaml").write_text(SMALL)
    client, log = Client(), tmp_path / "session.mcap"
    commands = {
        10: [client.run("run", "{wait: 0 s}")],
        30: [client.check("fault", "{}")],
        50: [client.check("failed", "{}")],
        100: [Command(END, "")],
    }
    simulated(tmp_path / "small.yaml", commands, log)
    assert client.outcome("run")[2] == "not_plannable"
    assert "RecursionError: deep" in str(client.result("run").values["text"])
    assert (client.result("fault").ok, client.result("fault").text) == (False, "Fault: odd")
    assert client.answers["failed"] == []
    recording = read_recording(log)
    assert "refused" in {event.kind for event in recording.events}
    assert judge_log(log).simulated_time == pytest.approx(0.05, abs=0.002)
