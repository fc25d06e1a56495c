"""Worlds that refuse: no step is reported as done that was not, and the first failed step is the first not done.

Every task expects only that its steps are done. Each is planned for a known world and runs in another one; what really
happened is read from the poses in the log, by laws that do not use those of the run.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.model.kinematics import Kinematics
from manipcli.record.recording import Recording
from manipcli.task.task import Task
from tests.scenarios.refusing_world import MISSING, ROOT, Change, World, fixed, run

pytestmark = [pytest.mark.slow, MISSING]

HEAD = f"""\
task: falsified
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
simulation: {{engine: mujoco, control_period: 2 ms}}
replan: false
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  slab: {{box: {{size: [10 cm, 10 cm, 4 cm]}}, pose: {{xyz: [0.5, 0.05, 0.22]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 5 cm]}}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}}
steps:
"""
PICK = "pick: {object: block, approach: {from: top, distance: 3 cm}, grasp: {posture: closed, force: 7 N}}"
ABOVE = "move: {pose: {xyz: [0.5, -0.15, 0.27], rpy: [180 deg, 0, 0]}}"
REACH = "move: {pose: {xyz: [0.5, -0.15, 0.225], rpy: [180 deg, 0, 0]}, path: linear}"
GRASP = "grasp: {object: block, posture: closed, force: 7 N}"
LIFT = "lift: {object: block, by: 3 cm, velocity_scaling: 1}"
SHIFT = "move: {pose: {xyz: [6 cm, 0, 0]}, frame: tool, path: linear}"
TWIST = "move: {pose: {xyz: [0, 0, 0], rpy: [0, 0, 40 deg]}, frame: tool}"
SWING = "follow: {joint_names: [panda_joint1], points: [{positions: [DEG], time_from_start: 0.8}]}"
PLACE = "place: {object: block, onto: slab, at: [0.5, 0.05], clearance: 1 cm, retreat: 4 cm, velocity_scaling: 1}"
RELEASE = "release: {}"
WAIT = "wait: 0.4 s"
HEIGHTS = {"move_1": 0.27, "move_2": 0.225}
"""[m] Of the tool after the two moves before a grasp."""
STEPS = {
    "pick": [PICK, LIFT],
    "grasp": [ABOVE, REACH, GRASP, LIFT],
    "lift": [PICK, LIFT],
    "move": [PICK, LIFT, SHIFT],
    "twist": [PICK, LIFT, TWIST],
    "follow": [PICK, LIFT, SWING],
    "place": [PICK, LIFT, PLACE],
    "release": [PICK, LIFT, RELEASE],
    "wait": [PICK, LIFT, WAIT],
}


def at_start(verb: str, step: str, *worlds: tuple[str, Change], says: str = "") -> list[World]:
    return [World(verb, name, step, (), step, change, says) for name, change in worlds]


LOOSE = "the hand does not (carry|hold) 'block'"
GRASPS: list[tuple[str, bool, tuple[str | tuple[str, str], ...]]] = [
    # name, whether the hand really closes on it, and the true world
    ("as heavy as lead", True, ("scene.block.mass=5",)),
    ("glued", True, ("scene.block.mass=1000",)),
    ("slippery", True, ("scene.block.friction=0.02",)),
    ("creeping", True, ("scene.block.friction=0.05",)),
    ("a hand without friction", True, ("robot.friction=0.01",)),
    ("weak fingers", False, ("robot.limits.panda_finger_joint1.effort=0.05",)),
    ("a wall that stops a finger", False, (fixed("wall", "8 cm, 1 cm, 5 cm", "0.5, -0.122, 0.225"),)),
    ("thinner than a sheet", False, ("scene.block.box.size=[0.5 mm, 0.5 mm, 5 cm]",)),
]
GRASPED: list[tuple[str, Change]] = [
    ("taken away", lambda world: world.shift("block", (0.1, 0.0, 0.0))),
    ("a jammed hand", lambda world: world.jam()),
]
LID = (fixed("lid", "8 cm, 12 cm, 2 mm", "0.5, -0.15, 0.254"),)
HELD: list[tuple[str, Change]] = [
    ("slippery", lambda world: world.friction("block", 0.01)),
    ("taken away", lambda world: world.shift("block", (0.1, 0.0, 0.0))),
    ("knocked down", lambda world: world.shift("block", (0.0, 0.0, -0.03))),
    ("pulled down", lambda world: world.tug("block", (0.0, 0.0, -20.0))),
    ("pulled up", lambda world: world.tug("block", (0.0, 0.0, 20.0))),
    ("pulled aside", lambda world: world.tug("block", (-20.0, 0.0, 0.0))),
    ("pulled ahead", lambda world: world.tug("block", (20.0, 0.0, 0.0))),
    ("as heavy as lead", lambda world: world.push("block", (0.0, 0.0, -16.0))),
    ("twisted out", lambda world: world.push("block", (0.0, 0.0, 0.0), (0.0, 0.3, 0.0))),
    ("held by something", lambda world: world.hold("block")),
]
PUT: list[tuple[str, Change]] = [
    ("a jammed hand", lambda world: world.jam()),
    ("tied to a finger", lambda world: world.tie("block", world.finger())),
]
JAMMED: list[tuple[str, Change]] = [
    ("a jammed hand", lambda world: world.jam()),
    ("a hand that rubs", lambda world: world.jam(0.0, friction=200.0)),
    ("a hand that springs back", lambda world: world.jam(0.0, spring=1e5)),
]
WORLDS = [
    *(World("pick", name, "lift_1" if held else "pick_1", true) for name, held, true in GRASPS),
    *(World("grasp", name, "lift_1" if held else "grasp_1", true) for name, held, true in GRASPS),
    *at_start("pick", "pick_1", *GRASPED),
    *at_start("grasp", "grasp_1", *GRASPED),
    World("pick", "a lid over the block", "pick_1", LID),
    World("grasp", "a lid over the block", "move_2", LID),
    *at_start("lift", "lift_1", *(pair for pair in HELD if pair[0] != "knocked down"), says="hand"),
    *at_start("lift", "lift_1", ("pulled askew", lambda world: world.tug("block", (15.0, 0.0, -15.0))), says="hand"),
    *at_start("move", "move_1", *HELD, says="hand"),
    *at_start("follow", "follow_1", *HELD, says="hand"),
    World("twist", "glued", "move_1", (), "move_1", lambda world: world.hold("block"), LOOSE),
    *at_start("wait", "wait_1", *(pair for pair in HELD if not pair[0].startswith("held")), says=LOOSE),
    *at_start("wait", "wait_1", ("thrown up", lambda world: world.shift("block", (0.0, 0.0, 0.08))), says=LOOSE),
    *at_start("place", "place_1", *HELD[:4], *PUT),
    World("place", "no slab", "place_1", ("scene.slab.pose.xyz=[0.5, 0.25, 0.22]",), says="40.* mm lower"),
    World("place", "a slab below", "place_1", ("scene.slab.pose.xyz=[0.5, 0.05, 0.205]",), says="15.* mm lower"),
    World("place", "a slab beside", "place_1", ("scene.slab.pose.xyz=[0.5, 0.12, 0.22]",), says="from its place"),
    World("place", "a slab deep below", "place_1", ("scene.slab.pose.xyz=[0.5, 0.05, 0.18]",), says="40.* mm lower"),
    World("place", "a bar on the slab", "place_1", (fixed("bar", "1 cm, 9 cm, 1 cm", "0.492, 0.05, 0.245"),)),
    World("place", "an occupied place", "place_1", (fixed("other", "3 cm, 3 cm, 5 cm", "0.5, 0.05, 0.265"),)),
    *at_start("release", "release_1", *JAMMED, says="the hand did not open|still holds"),
    *(World("release", name, "lift_1" if held else "pick_1", true) for name, held, true in GRASPS),
]


@dataclass
class Witness:
    """What the log shows of the block and the hand of a Panda."""

    recording: Recording
    task: Task
    held: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self._kinematics = Kinematics(self.task.robot)

    def at(self, time: float) -> tuple[Transform, Transform, float]:
        """X_WT of the tool and X_WO of the block at a time [s], and the distance of the finger pads [m]."""
        states, tool = self.recording.states, self.task.robot.tool
        assert tool is not None
        k = max(0, int(np.searchsorted(states.time, time - 1e-9)) - 1)  # before the world changes for the next step
        X_WO = Transform.of(xyz=states.body_position[k, 0], quat_xyzw=states.body_quat_xyzw[k, 0])
        X_WT = self._kinematics.forward(states.position[k], tool.link) @ tool.X_LT
        return X_WT, X_WO, float(states.position[k, -2:].sum())

    def between(self, time: float) -> bool:
        """Whether the block fills the gap between the pads, around the tool, and both fingers press on it."""
        X_WT, X_WO, gap = self.at(time)
        half = self.task.true.scene.body("block").size / 2
        corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        points = np.array([(X_WT.inverse() @ X_WO).apply(half * corner) for corner in corners])
        low, high = points.min(axis=0), points.max(axis=0)
        around = bool((low[[0, 2]] < 5e-3).all() and (high[[0, 2]] > -5e-3).all())
        snapshot = [each for each in self.recording.contacts if each.time <= time + 1e-9][-1]
        fingers = [
            each.force for each in snapshot.contacts if "block" in (each.a, each.b) and "finger" in each.a + each.b
        ]
        play = 3e-3 if self.task.spec.simulation.engine == "pybullet" else 2e-3  # Bullet's margins keep them apart
        return around and abs(high[1] - low[1] - gap) < play and len(fingers) >= 2 and min(fingers) > 0.1

    def followed(self, start: float, end: float) -> bool:
        """Whether the block has moved with the tool, but for 1 cm, or half of a smaller motion, and 20 deg."""
        (A_T, A_O, _), (B_T, B_O, _) = self.at(start), self.at(end)
        hand = B_T @ A_T.inverse()
        lag = np.linalg.norm((hand @ A_O).p - B_O.p)
        moved = np.linalg.norm((hand @ A_O).p - A_O.p)
        slip = _angle(A_T.R.T @ A_O.R @ (B_T.R.T @ B_O.R).T)
        return bool(lag < np.clip(0.5 * moved, 5e-3, 1e-2)) and slip < np.radians(20.0)

    def done(self, step: str, start: float, end: float) -> bool:
        verb = step.partition("_")[0]
        if verb in ("pick", "grasp"):
            self.held = True
            return self.between(end)
        if verb == "place":
            _, X_WO, gap = self.at(end)
            upright = np.degrees(np.arccos(np.clip(X_WO.R[2, 2], -1.0, 1.0))) < 10.0
            return bool(np.linalg.norm(X_WO.p - [0.5, 0.05, 0.265]) < 0.01 and upright and gap > 0.06)
        if verb == "release":
            return self.at(end)[2] > 0.06 and not self.between(end)
        if not self.held:  # the moves before a grasp
            return bool(abs(self.at(end)[0].p[2] - HEIGHTS[step]) < 1e-2)
        return self.followed(start, end)


def _angle(R: Array) -> float:
    return float(np.arccos(np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0)))


def test_ten_worlds_refuse_each_verb() -> None:
    counts = Counter(world.verb for world in WORLDS)
    assert not [verb for verb, count in counts.items() if count < 10 and verb != "twist"], counts


@pytest.mark.parametrize(
    "world",
    [each for each in WORLDS if not each.when and each.verb in ("pick", "place") and "sheet" not in each.name],
    ids=lambda world: f"{world.verb}: {world.name}",
)
def test_a_world_that_refuses_from_the_start_does_in_pybullet_too(
    world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged(world, "pybullet", tmp_path, monkeypatch)


@pytest.mark.parametrize("world", WORLDS, ids=lambda world: f"{world.verb}: {world.name}")
def test_the_first_failed_step_is_the_first_that_the_world_refused(
    world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged(world, "mujoco", tmp_path, monkeypatch)


def judged(world: World, engine: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs a world, and compares the first step that failed with the first that was not done."""
    steps = "".join(f"  - {step}\n" for step in STEPS[world.verb]).replace("DEG", "-0.2")
    text = (HEAD + steps).replace("engine: mujoco", f"engine: {engine}")
    verdict, recording, task = run(world, text, folder, monkeypatch)
    assert verdict.verdict == "failed"
    failed = next(step for step in verdict.steps if step.outcome != "done")
    witness = Witness(recording, task)
    ran = [step for step in verdict.steps if step.started is not None and step.ended is not None]
    refused = next((step.id for step in ran if not witness.done(step.id, step.started, step.ended)), None)
    assert (failed.id, refused) == (world.fails, world.fails), verdict.text
    assert "replan: false" not in verdict.text
    assert re.search(world.says, failed.text), failed.text


def test_a_jammed_hand_does_not_arrive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world = World("move", "a jammed hand", "move_1", (), "move_1", lambda world: world.jam())
    verdict, _, _ = run(world, f"{HEAD}  - move: {{to: {{panda_finger_joint1: 0}}}}\n", tmp_path, monkeypatch)
    assert "the hand did not reach its target" in verdict.steps[0].text


def test_an_arm_at_a_wall_does_not_arrive_although_its_controller_tolerates_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    controllers = (ROOT / "controllers" / "panda.yaml").read_text(encoding="utf-8")
    start, constraints, rest = controllers.partition("    constraints:\n")
    assert constraints
    (tmp_path / "loose.yaml").write_text(start + rest[rest.index("  hand_controller") :], encoding="utf-8")
    text = HEAD.replace(f"{ROOT}/controllers/panda.yaml", str(tmp_path / "loose.yaml"))
    world = World("move", "a wall", "move_1", (fixed("wall", "40 cm, 2 cm, 60 cm", "0.5, 0.1, 0.5"),))
    verdict, _, _ = run(world, f"{text}  - move: {{to: {{panda_joint1: 40 deg}}}}\n", tmp_path, monkeypatch)
    assert re.search(r"joint 'panda_joint1' is 0\.\d+ rad from the end of this motion", verdict.steps[0].text)


@pytest.mark.parametrize("on_fail", ["{retry: 1}", "continue"])
def test_what_follows_a_lost_grasp_names_the_grasp(
    on_fail: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = f"{HEAD}  - {PICK}\n  - {LIFT}\n    on_fail: {on_fail}\n  - {PLACE}\n".replace(
        "replan: false", "replan: true"
    )
    world = World("lift", "slippery", "lift_1", (), "lift_1", lambda world: world.friction("block", 0.01))
    verdict, _, _ = run(world, text, tmp_path, monkeypatch)
    last = [step for step in verdict.steps if step.outcome != "not_run"][-1]
    assert last.id == ("place_1" if on_fail == "continue" else "lift_1")
    assert last.text.startswith("the grasp was lost before this step: 'block' is not in the hand: it rose"), last.text
    assert "replan: false" not in verdict.text
