"""What is asked of hands, and what they can do."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from manipcli.pipeline import run_task
from manipcli.preflight.check_files import check_files
from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

ROOT = Path(__file__).parents[2]
SPEED = "controllers.hand_controller.speed"


@dataclass
class Listener:
    """Keeps what a run tells beside its steps."""

    heard: list[str]

    def activity(self, what: str) -> None: ...
    def warned(self, findings: object) -> None: ...
    def tick(self, simulated_time: float, wall: float) -> None: ...
    def step_started(self, step: object, index: int, total: int) -> None: ...
    def step_ended(self, outcome: object) -> None: ...

    def message(self, text: str, *, detail: bool) -> None:
        self.heard += [] if detail else [text]


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A Panda, whose fingers may do 0.2 m/s, opens its hand by 4 cm."""
    file = tmp_path / "task.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
        "steps:\n  - grasp: {until: posture, force: 9 N}\n"
    )
    return file


@pytest.mark.parametrize(("speed", "duration"), [("0.05", 0.8), ("null", 0.2), ("0.4", 0.1)])
def test_a_hand_is_as_fast_as_it_is_told_and_by_itself_as_its_joints_may(
    small: Path, speed: str, duration: float
) -> None:
    plan = plan_task(load_task(small, overrides=[f"{SPEED}={speed}"]))
    assert plan.steps[0].plan.duration == pytest.approx(duration)


def test_a_hand_that_is_told_to_be_faster_than_a_joint_may_be_is_doubted(small: Path) -> None:
    for speed in ("0.2", "null"):
        assert preflight_findings(load_task(small, overrides=[f"{SPEED}={speed}"])) == ()
    (found,) = preflight_findings(load_task(small, overrides=[f"{SPEED}=0.25"]))
    assert (found.code, found.severity) == ("CTRL167", "warning")
    assert found.message == ("panda_finger_joint1: closing speed 0.25 m/s exceeds its velocity limit 0.2 m/s")


PICK = (ROOT / "tasks" / "pick_place.yaml").read_text(encoding="utf-8").partition("  - lift:")[0]


@pytest.fixture
def pick(tmp_path: Path) -> Path:
    """The Panda takes a block of 4 cm with 7 N a finger."""
    file = tmp_path / "pick.yaml"
    file.write_text(PICK.replace("../", f"{ROOT}/"))
    return file


@pytest.mark.slow
def test_a_finger_too_soft_for_its_grasp_is_told_with_what_it_gives(pick: Path) -> None:
    """p 500 x 20 mm are 10 N for two fingers: 5 N each, and so the run feels."""
    gain = "controllers.hand_controller.gains.panda_finger_joint1.p"
    (found,) = preflight_findings(load_task(pick, overrides=[f"{gain}=500"]))
    assert (found.code, found.severity) == ("CTRL168", "warning")
    assert found.message == "panda_finger_joint1: p 500 gives about 5 N, step 'pick_1' asks for 7 N"
    assert found.hint == "raise p to 840 for 20 % more than 7 N"
    heard: list[str] = []

    def told_of(overrides: list[str]) -> str:
        heard.clear()
        run_task(pick, overrides=overrides, log=pick.with_suffix(".mcap"), force=True, progress=Listener(heard))
        return " ".join(heard)

    felt = re.search(r"with ([\d.]+) N of the requested 7 N", told_of([f"{gain}=500"]))
    assert felt is not None
    assert float(felt[1]) == pytest.approx(5.0, rel=0.1)
    assert "felt" not in told_of([f"{gain}=840"])
    assert preflight_findings(load_task(pick, overrides=[f"{gain}=840"])) == ()
    winds_up = [f"{gain}=500", f"{gain[:-1]}i=100", f"{gain[:-1]}i_clamp=10"]
    assert preflight_findings(load_task(pick, overrides=winds_up)) == (), "its integral gives what lacks"
    assert preflight_findings(load_task(pick, overrides=[f"{gain}=5", "simulation.engine=kinematic"])) == ()


@pytest.mark.slow
@pytest.mark.parametrize("gravity", ["[0, 0, -9.81]", "[0, 0, -1.62]", "[0, 0, 0]"])
def test_an_object_of_next_to_no_mass_beside_the_grip_is_doubted(pick: Path, gravity: str) -> None:
    """7 N on 10 g are 700 N/kg, on 5 g 1400; an error of the contact solver moves it so, be it heavy or not."""
    there = f"simulation.gravity={gravity}"
    assert preflight_findings(load_task(pick, overrides=[there, "scene.block.mass=10 g"])) == ()
    (found,) = preflight_findings(load_task(pick, overrides=[there, "scene.block.mass=5 g"]))
    assert (found.code, found.severity) == ("TASK239", "warning")
    assert found.message == (
        "step 'pick_1': force 7 N exceeds 3.7 N for 'block' (5 g): it may creep in the hand by millimetres"
    )
    assert (found.hint or "").startswith("lower the force below 3.7 N, or raise the mass")


@pytest.mark.slow
def test_what_is_told_of_one_grasp_points_one_way(pick: Path) -> None:
    """Of 500 N, 3.7 are left on 5 g, and 50 where two fingers share 100 N; p is asked for these, and not for 500."""
    gain = "controllers.hand_controller.gains.panda_finger_joint1.p"
    asked, limit = "steps.0.pick.grasp.force=500 N", "robot.limits.panda_finger_joint1.effort=100 N"
    light = preflight_findings(load_task(pick, overrides=[asked, limit, "scene.block.mass=5 g"]))
    assert [found.code for found in light] == ["TASK239"]
    soft = preflight_findings(load_task(pick, overrides=[asked, limit, "scene.block.mass=1 kg", f"{gain}=500"]))
    assert {found.code: found.hint for found in soft} == {
        "TASK238": "lower `force`, or raise the limit: the joint's effort, or `max_effort`",
        "CTRL168": "raise p to 6000 for 20 % more than 50 N",
    }


@pytest.mark.slow
def test_a_hand_on_the_position_interface_is_told_that_no_force_is_its_own(pick: Path, tmp_path: Path) -> None:
    """Its motor has 20 N for two fingers, and presses so whatever is asked; 2.1 N let it press with 1 N each."""
    hand = (
        "  hand_controller: {type: gripper, joints: [panda_finger_joint1], command_interface: position, speed: 0.05}\n"
    )
    arm = (ROOT / "controllers" / "panda.yaml").read_text(encoding="utf-8").partition("  hand_controller:")[0]
    (tmp_path / "c.yaml").write_text(arm + hand)
    pick.write_text(re.sub("controllers: .*", "controllers: c.yaml", pick.read_text()))
    force, limit = "steps.0.pick.grasp.force", "robot.limits.panda_finger_joint1.effort"
    (found,) = preflight_findings(load_task(pick, overrides=[f"{force}=1 N"]))
    assert (found.code, found.severity) == ("CTRL173", "warning")
    assert found.message == (
        "panda_finger_joint1: presses with 10 N (its effort limit), step 'pick_1' asks for 1 N: under position "
        "commands `force` is only the contact force at which it stops"
    )
    assert found.hint == (
        "use effort commands, or lower the effort limit (robot file, limits.panda_finger_joint1.effort: 2.1)"
    )
    assert preflight_findings(load_task(pick, overrides=[f"{force}=1 N", f"{limit}=2.1"])) == ()
    assert preflight_findings(load_task(pick, overrides=[f"{force}=10 N"])) == ()


@pytest.mark.slow
def test_what_friction_cannot_carry_is_told_before_it_slips(pick: Path) -> None:
    """Two fingers with 7 N and 0.9 carry 12.6 N: 1.28 kg, or 0.642 kg with as much again to accelerate it."""
    mass = "scene.block.mass"
    assert preflight_findings(load_task(pick, overrides=[f"{mass}=5 kg"])) == (), "it is not lifted"
    pick.write_text(pick.read_text(encoding="utf-8") + "  - lift: {object: block, by: 10 cm}\n", encoding="utf-8")
    assert preflight_findings(load_task(pick, overrides=[f"{mass}=0.64 kg"])) == ()
    (found,) = preflight_findings(load_task(pick, overrides=[f"{mass}=1 kg"]))
    assert found.hint == "it may slip or rotate while accelerated: 10.9 N per finger carries twice its weight"
    (found,) = preflight_findings(load_task(pick, overrides=[f"{mass}=1.9 kg"]))
    assert (found.code, found.severity) == ("TASK241", "warning")
    assert found.message == (
        "step 'pick_1': friction carries 12.6 N, 'block' (1.9 kg) weighs 18.6 N: two fingers press with 7 N each, "
        "coefficient of friction 0.9"
    )
    assert found.hint == "it will slip: use more than 10.4 N per finger, or raise the friction"
    run = run_task(pick, overrides=[f"{mass}=1.9 kg"], log=pick.with_suffix(".mcap"), force=True)
    assert "it slipped" in str(run.verdict)
    assert preflight_findings(load_task(pick, overrides=[f"{mass}=1.9 kg", "scene.block.friction=2.7"])) == ()
    assert preflight_findings(load_task(pick, overrides=[f"{mass}=1.9 kg", "simulation.gravity=[0, 0, -1.62]"])) == ()


def test_check_notes_what_each_grasp_holds_and_weighs_what_is_in_it(pick: Path) -> None:
    """A cup of 80 g weighs with the stone in it; the margin is that of the plan."""
    text = pick.read_text(encoding="utf-8")
    cup = "cup: {cup: {radius: 3 cm, height: 9 cm, wall: 3 mm}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}\n"
    stone = "  stone: {sphere: {radius: 2 cm}, mass: 1.9 kg, inside: cup}\n"
    block = next(line for line in text.splitlines(keepends=True) if line.startswith("  block:"))
    text = text.replace(block, f"  {cup}{stone}").replace("block", "cup") + "  - lift: {object: cup, by: 10 cm}\n"
    pick.write_text(text, encoding="utf-8")
    found = {finding.code: finding for finding in check_files([pick])}
    assert "'cup' (1.98 kg with its contents) weighs 19.4 N" in found["TASK241"].message
    ((step, margin),) = plan_task(load_task(pick)).grasps()
    note = found["TASK250"]
    assert (note.severity, note.message, step) == ("note", f"step 'pick_1': {margin.text}", "pick_1")
    assert note.place is not None and "pick" in text.splitlines()[note.place.line - 1]
