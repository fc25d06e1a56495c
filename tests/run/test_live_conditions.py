"""Live and judged answers of every condition are the same numbers on every tick of a recorded run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.conditions.condition import World
from manipcli.conditions.formula import leaves, sensors_of
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.sensed import FELT
from manipcli.conditions.state_window import StateWindow
from manipcli.judge import expectation
from manipcli.logs.judge_log import judge_recording
from manipcli.record.read.reading import open_recording
from manipcli.run import execute
from manipcli.run.live_conditions import Live
from manipcli.spec.condition import ConditionSpec
from manipcli.task.load_task import load_task

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: small
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
start: home
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{cup: {{radius: 36 mm, height: 110 mm}}, mass: 150 g, rests_on: desk, at: [0.75, 0.0], friction: 1.0}}
  ball: {{sphere: {{radius: 14 mm}}, mass: 10 g, inside: cup}}
  tray: {{tray: {{size: [0.3, 0.3, 0.05]}}, rests_on: desk, at: [0.70, 0.32], fixed: true}}
  door:  # opens slowly
    urdf: {{file: {ROOT}/tasks/objects/door.urdf}}
    fixed: true
    pose: {{xyz: [-2, 0, 0.5]}}
    joints: {{hinge: {{damping: 0, friction: 0, spring: {{stiffness: 0.002, rest: 57 deg}}}}}}
sensors:
  wrist: {{type: force_torque, link: palm, delay: 3 ms, noise: {{force: {{white: 0.1 N}}, dropout: 10 %}}}}
  tip: {{type: contact, link: finger_1_distal_link, threshold: 1 N, rate: 250 Hz, delay: 12 ms}}
  late: {{type: contact, link: finger_2_distal_link, threshold: 1 N, rate: 4 Hz, noise: {{dropout: 20 %}}}}
  pad:
    type: tactile
    link: finger_1_distal_link
    at: {{xyz: [0, -8 mm, 27 mm], rpy: [90 deg, 0, 0]}}
    size: [20 mm, 56 mm]
    rows: 3
    columns: 3
    rate: 100 Hz
    delay: 10 ms
    noise: {{force: {{white: 0.01 N}}}}
    shear: true
  eye:
    type: camera
    frame: desk
    at: {{xyz: [-0.4, 0.6, 0.5], rpy: [0, 35 deg, -40 deg]}}
    resolution: [48, 36]
    rate: 20 Hz
    delay: 70 ms
    depth: false
    color: false
    segmentation: true
vary:
  scene.cup.mass: {{choice: [80 g]}}
steps:
  - pick: {{object: cup, approach: {{from: side, distance: 9 cm}}, grasp: {{posture: wrap, force: 8 N, height: 68 mm}}}}
  - lift: {{object: cup, by: 8 cm}}
    until: {{all: [{{grasped: {{object: cup}}}}, {{moved: {{object: cup, by: 6 cm}}}}]}}
    timeout: 3 s
  - wait: 123 ms
  - move: {{pose: {{xyz: [0, 0, -1 cm]}}, frame: tool, path: linear, stiffness: {{translation: 800, rotation: 40}}}}
expect:
  - always: {{inside: {{object: ball, of: cup}}}}
  - always: {{outside: {{object: ball, of: tray}}}}
  - always: {{upright: {{object: cup, within: 5 deg}}}}
  - always: {{near: {{object: cup, to: start, within: 20 cm}}}}
  - always: {{above: {{object: cup, of: desk}}}}
  - always: {{rests_on: {{object: cup, of: desk}}}}
  - always: {{at_rest: {{object: ball}}}}
  - always: {{moved: {{object: cup, by: 1 cm, rotation: 1 deg}}}}
  - always: {{unmoved: {{object: ball, within: 10 cm, rotation: 3 deg}}}}
  - always: {{grasped: {{object: cup}}}}
  - always: {{slip: {{object: cup, within: 5 mm, rotation: 5 deg}}}}
  - always: {{contact_force: {{pair: [robot, cup], below: 60 N, above: 1 N}}}}
  - always: {{contact_force: {{of: robot, below: 60 N, mean_over: 30 ms}}}}
  - always: {{collision: [robot, cup]}}
  - always: {{no_collision: {{pairs: [[robot, desk], [ball, cup]]}}}}
  - always: {{at_pose: {{pose: home}}}}
  - always: {{tracking: {{group: arm, within: 0.05 rad}}}}
  - always: {{limits: {{spare: 5 %}}}}
  - always: {{tool_speed: {{below: 1 m/s}}}}
  - always: {{energy: {{below: 50 J}}}}
  - always: {{duration: {{below: 60 s}}}}
  - always: {{step_done: {{step: lift_1}}}}
  - always: {{any: [{{tool_speed: {{below: 0.1 m/s}}}}, {{not: {{grasped: {{object: cup}}}}}}]}}
  - always: {{touches: {{sensor: tip}}}}
  - always: {{touches: {{sensor: pad, force: 1 N}}}}
  - always: {{wrench: {{sensor: wrist, force: {{axis: z, above: -2 N, below: 5 N}}, torque: {{below: 1 N m}}}}}}
  - always: {{sees: {{sensor: eye, object: cup, pixels: 20}}}}
  - always: {{slips: {{sensor: pad, friction: 0.8}}}}
  - always: {{joint_at: {{joint: door/hinge, at: 1 deg, within: 5 deg}}}}
  - always: {{opened: {{object: door, by: 10 deg}}}}
  - always: {{closed: {{object: door, within: 2 deg}}}}
  - always: {{force: {{axis: magnitude, below: 5 N}}}}
  - always: {{moved: {{object: cup, by: 1 cm}}}}
    during: lift_1
  - always: {{duration: {{below: 9 s}}}}
    during: lift_1
  - always: {{touches: {{sensor: late}}}}
    during: lift_1
"""


@dataclass
class Answers:
    """What a condition answered, tick by tick."""

    times: list[float] = field(default_factory=list)
    margins: list[float] = field(default_factory=list)
    applies: list[bool] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)

    def told(self, window: StateWindow, answer: Robustness) -> None:
        for k, time in enumerate(window.times):
            applies = bool(answer.applies[k])
            self.times.append(float(time))
            self.applies.append(applies)
            self.margins.append(float(answer.margins[k]) if applies else 0.0)
            self.texts.append(answer.found(k).text if applies and k % 7 == 0 else "")


class Monitors(Live):
    """Opens a probe for everything that the task expects of the whole run, and one with the step."""

    opened: list[Answers]
    of_step: list[Answers]

    def __init__(self, world: World, *rest: object) -> None:
        super().__init__(world, *rest)  # type: ignore[arg-type]
        type(self).opened = []
        for one in EXPECT:
            type(self).opened.append(Answers())
            self.open(one, callback=self.opened[-1].told)

    def step_started(self, step: str) -> None:
        super().step_started(step)
        if step == "lift_1":
            type(self).of_step = [Answers() for _ in OF_STEP]
            pairs = zip(OF_STEP, self.of_step, strict=True)
            self.probes = [self.open(one, callback=answers.told) for one, answers in pairs]

    def step_ended(self, step: str, outcome: str) -> None:
        super().step_ended(step, outcome)
        if step == "lift_1":
            for probe in self.probes:
                self.close(probe)


EXPECT: list[ConditionSpec] = []
OF_STEP: list[ConditionSpec] = []


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> list[Answers]:
    """A sample of the task, run with a live probe for each expectation, and what judging its log asks and answers."""
    folder = tmp_path_factory.mktemp("live")
    file = folder / "small.yaml"
    file.write_text(TASK)
    expect = load_task(file).spec.expect
    EXPECT[:] = [one.condition for one in expect if not one.steps]
    OF_STEP[:] = [one.condition for one in expect if one.steps]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(execute, "Live", Monitors)
        report = pipeline.run_task(file, log=folder / "small.mcap", sample=0)
    assert [step.outcome for step in report.verdict.steps] == ["done"] * 4
    found: list[Answers] = []
    plain = expectation.opened

    def kept(spec: ConditionSpec, world: World, seam: expectation.Seams) -> object:
        monitor, answers = plain(spec, world, seam), Answers()
        found.append(answers)

        def look(window: StateWindow) -> Robustness:
            answer = monitor(window)
            answers.told(window, answer)
            return answer

        return look

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expectation, "opened", kept)
        log = folder / "small.mcap"
        assert judge_recording(open_recording(log), log) == report.verdict
    return found


def test_every_condition_is_among_them(judged: list[Answers]) -> None:
    assert {leaf.name for one in EXPECT for leaf in leaves(one)} == set(CONDITIONS.names) - {"saturation"}
    assert len(judged) == len(EXPECT) + len(OF_STEP) + 1  # the implied saturation is judged only


def test_live_and_judged_answers_agree_on_every_tick(judged: list[Answers]) -> None:
    for spec, live, later in zip(EXPECT, Monitors.opened, judged[: len(EXPECT)], strict=True):
        count = len(live.times)  # the last block may not have been full
        assert 0 <= len(later.times) - count < 10, spec.name
        assert count > 3000
        assert live.times == later.times[:count], spec.name
        assert live.applies == later.applies[:count], spec.name
        # The same numbers through the same functions; arrays of other lengths round elsewhere in their last bit.
        np.testing.assert_allclose(live.margins, later.margins[:count], rtol=1e-12, atol=1e-12, err_msg=spec.name)
        if sensors_of(spec, CONDITIONS):
            assert live.margins == later.margins[:count], spec.name
            assert not live.applies[0] or FELT in sensors_of(spec, CONDITIONS), spec.name
            assert any(live.applies), spec.name
        changing = spec.name not in ("outside", "no_collision")
        assert not changing or len(set(live.margins)) > 1, spec.name


def test_what_counts_from_the_start_of_a_step_does_so_live_too(judged: list[Answers]) -> None:
    for live, later in zip(Monitors.of_step, judged[len(EXPECT) : -1], strict=True):
        assert live.times == later.times
        np.testing.assert_allclose(live.margins, later.margins, rtol=1e-12, atol=1e-12)
    moved, taken, touched = Monitors.of_step
    assert all(touched.applies)  # by the measurement before the step
    assert moved.margins[0] == -0.01
    assert moved.margins[-1] >= 0.05
    assert taken.margins[0] == 9.0 - 0.001
    assert taken.margins[-1] == pytest.approx(9.0 - 0.001 * len(taken.times), abs=1e-9)
