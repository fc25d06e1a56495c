"""What the robot believes: drawn within `known`, carried by the hand, asked by watches, in the log and after it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.conditions.condition import World
from manipcli.conditions.formula import believing
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Array, Transform, matrix_from_rpy
from manipcli.judge.state_windows import Order, WindowsOfSpans
from manipcli.model.collision import Carried
from manipcli.model.kinematics import Kinematics
from manipcli.model.state import WorldState
from manipcli.record.read.reading import open_recording, read_recording
from manipcli.record.recording import Recording
from manipcli.report.run_report import RunReport
from manipcli.run import execute
from manipcli.run.belief import Belief
from manipcli.run.live_conditions import Live
from manipcli.scene.start_overlap import overlaps
from manipcli.spec.condition import ConditionSpec
from manipcli.task.believed_scene import believed_scene
from manipcli.task.load_task import load_task
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: believed
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
start: home
"""
SCENE = """\
scene:
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0], friction: 1.0, known: KNOWN}
  ball: {sphere: {radius: 14 mm}, mass: 10 g, inside: cup}
"""
WAIT = "steps: [{wait: 0.1 s}]\n"
DISC = "{region: {radius: 4 cm}, rotation: 20 deg}"


def loaded(folder: Path, known: str = DISC, more: str = "") -> Task:
    file = folder / "task.yaml"
    file.write_text(HEAD + SCENE.replace("KNOWN", known) + more + WAIT)
    return load_task(file)


def errors(task: Task, count: int, name: str = "cup") -> tuple[Array, Array]:
    """(count, 3) [m] and (count,) [rad]: how far the believed pose of a body is from the true one, in each sample."""
    truth = task.true.scene
    found = [
        believed_scene(task.file, truth, k).body(name).X_WO @ truth.body(name).X_WO.inverse() for k in range(count)
    ]
    moved = [X.apply(truth.body(name).X_WO.p) - truth.body(name).X_WO.p for X in found]
    return np.array(moved), np.array([X.rpy[2] for X in found])


def chi_square(shares: Array, bins: int) -> float:
    """Of numbers in 0 to 1 against the uniform distribution."""
    counts = np.histogram(shares, bins, (0.0, 1.0))[0]
    return float(((counts - len(shares) / bins) ** 2).sum() * bins / len(shares))


def test_beliefs_are_uniform_in_the_disc_and_the_rotation(tmp_path: Path) -> None:
    moved, turned = errors(loaded(tmp_path), 2000)
    far, most = np.hypot(moved[:, 0], moved[:, 1]), np.radians(20.0)
    assert far.max() <= 0.04
    assert not moved[:, 2].any()
    assert np.abs(turned).max() <= most
    for shares in (
        (far / 0.04) ** 2,
        np.arctan2(moved[:, 1], moved[:, 0]) / (2 * np.pi) + 0.5,
        turned / most / 2 + 0.5,
    ):
        assert chi_square(shares, 10) < 40.0  # of 9 degrees of freedom: 1e-5


def test_beliefs_are_uniform_in_the_box(tmp_path: Path) -> None:
    moved, turned = errors(loaded(tmp_path, "{region: {box: [2 cm, 8 cm, 0]}}"), 500)
    assert (np.abs(moved).max(axis=0) <= [0.01 + 1e-12, 0.04 + 1e-12, 0.0]).all()
    assert not turned.any()
    for axis, half in ((0, 0.01), (1, 0.04)):
        assert chi_square(moved[:, axis] / half / 2 + 0.5, 10) < 40.0


OTHER = (
    "  box: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 90 g, rests_on: desk, at: [0.75, 0.3], known: {rotation: 9 deg}}\n"
)


def test_another_process_and_another_body_change_nothing(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from manipcli.task.load_task import load_task\n"
        "print(load_task(Path(sys.argv[1])).scene.body('cup').X_WO.p.tolist())"
    )
    own = loaded(tmp_path).scene.body("cup").X_WO.p.tolist()
    with_other = loaded(tmp_path, more=OTHER)
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "task.yaml"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == str(own) == str(with_other.scene.body("cup").X_WO.p.tolist())
    assert with_other.true.scene.body("cup").X_WO.p.tolist() == [0.75, 0.0, 0.4]


def test_no_believed_body_overlaps_another(tmp_path: Path) -> None:
    near = "  wall: {box: {size: [0.2, 2 cm, 0.2]}, pose: {xyz: [0.75, 0.048, 0.5]}, fixed: true}\n"
    task = loaded(tmp_path, more=near)
    moved, _ = errors(task, 60)
    assert moved[:, 1].max() < 0.0035  # the wall is 2 mm away, and 1 mm of overlap is contact
    assert not any(list(overlaps(believed_scene(task.file, task.true.scene, k).bodies)) for k in range(60))


def test_bad_knowledge_is_refused(tmp_path: Path) -> None:
    for known, text in (
        ("{}", "neither a region nor a rotation"),
        ("{region: {}}", "expected exactly one of radius, circle, box, got none"),
        ("{region: {radius: 1 cm, box: [0, 0, 0]}}", "expected exactly one of radius, circle, box, got radius and box"),
        ("{region: {box: [-1 cm, 0, 0]}}", "greater than or equal to 0|0 or more|at least 0"),
        ("{rotation: 200 deg}", "200 deg|3.14"),
        ("{region: {radius: 3}, rotation: 1 m}", "angle"),
    ):
        with pytest.raises(InvalidInput, match=text):
            loaded(tmp_path, known)


@dataclass
class World3:
    """A belief with its task, and states of its truth."""

    task: Task
    kinematics: Kinematics
    belief: Belief

    def state(self, q: Array, cup: Transform, ball: Transform) -> WorldState:
        made = WorldState.room(len(q), 2)
        made.position[:] = q
        for k, X in enumerate((cup, ball)):
            made.body_position[k], made.body_quat_xyzw[k] = X.p, X.quat_xyzw
        return made


@pytest.fixture
def world(tmp_path: Path) -> World3:
    task = loaded(tmp_path)
    kinematics = Kinematics(task.robot)
    return World3(task, kinematics, Belief(task.scene, task.true.scene, kinematics))


def pose(state: WorldState, k: int) -> Array:
    X = Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k])
    return np.vstack((np.c_[X.R, X.p], [0, 0, 0, 1]))


def matrix(X: Transform) -> Array:
    return np.vstack((np.c_[X.R, X.p], [0, 0, 0, 1]))


def test_the_hand_carries_the_believed_pose_whatever_the_body_does(world: World3) -> None:
    rng = np.random.default_rng(3)
    scene, belief = world.task.true.scene, world.belief
    n = len(world.task.robot.joint_names)
    X_cup, X_ball = scene.body("cup").X_WO, scene.body("ball").X_WO
    q = rng.uniform(-1.0, 1.0, n)
    start = world.state(q, X_cup, X_ball)
    believed = pose(belief.look(start), 0)
    np.testing.assert_allclose(believed, matrix(world.task.scene.body("cup").X_WO), atol=1e-12)
    belief.hold(Carried("cup", "palm", Transform.identity()), start)
    inverse = np.linalg.inv(matrix(world.kinematics.forward(q, "palm")))
    for _ in range(5):
        q = rng.uniform(-1.0, 1.0, n)
        slipped = Transform.of(xyz=rng.uniform(-1, 1, 3), rpy=rng.uniform(-1, 1, 3))
        held = pose(belief.look(world.state(q, slipped, X_ball)), 0)
        np.testing.assert_allclose(held, matrix(world.kinematics.forward(q, "palm")) @ inverse @ believed, atol=1e-12)
    belief.let_go(world.state(q, slipped, X_ball))
    left = pose(belief.look(world.state(rng.uniform(-1.0, 1.0, n), X_cup, X_ball)), 0)
    np.testing.assert_allclose(left, held, atol=1e-12)


def test_a_held_body_follows_the_measured_joints(world: World3) -> None:
    """Encoders with offsets that change between two looks: the belief follows them, wherever the arm truly is."""
    rng = np.random.default_rng(8)
    task, scene = world.task, world.task.true.scene
    n = len(task.robot.joint_names)
    measured = rng.uniform(-1.0, 1.0, n)
    belief = Belief(task.scene, scene, world.kinematics, lambda _: measured)
    state = world.state(np.zeros(n), scene.body("cup").X_WO, scene.body("ball").X_WO)
    believed = pose(belief.look(state), 0)
    belief.hold(Carried("cup", "palm", Transform.identity()), state)
    inverse = np.linalg.inv(matrix(world.kinematics.forward(measured, "palm")))
    measured = rng.uniform(-1.0, 1.0, n)
    state = world.state(np.zeros(n), scene.body("cup").X_WO, scene.body("ball").X_WO)
    held = matrix(world.kinematics.forward(measured, "palm")) @ inverse @ believed
    np.testing.assert_allclose(pose(belief.look(state), 0), held, atol=1e-12)
    X_WO = Transform.of(xyz=(0.1, 0.2, 0.3), rpy=(0.4, 0.5, 0.6))
    belief.update("cup", X_WO, np.eye(6))
    np.testing.assert_allclose(pose(belief.look(state), 0), matrix(X_WO), atol=1e-12)


def test_what_is_inside_moves_with_the_belief_and_is_exact_outside(world: World3) -> None:
    rng = np.random.default_rng(4)
    scene, belief = world.task.true.scene, world.belief
    q = np.zeros(len(world.task.robot.joint_names))
    X_ball = scene.body("ball").X_WO
    for _ in range(5):
        X_cup = Transform(R=matrix_from_rpy(rng.uniform(-1, 1, 3)), p=rng.uniform(-1, 1, 3))
        inside = X_cup @ Transform.of(xyz=(0.0, 0.005, 0.05), rpy=(0.1, 0.2, 0.3))
        seen = belief.look(world.state(q, X_cup, inside))
        relative = np.linalg.inv(pose(seen, 0)) @ pose(seen, 1)
        np.testing.assert_allclose(relative, np.linalg.inv(matrix(X_cup)) @ matrix(inside), atol=1e-12)
    seen = belief.look(world.state(q, X_cup, X_ball))  # the cup is elsewhere
    np.testing.assert_array_equal(seen.body_position[1], X_ball.p)
    np.testing.assert_array_equal(belief.poses[1, :3], X_ball.p)


def test_an_update_replaces_the_belief_also_in_the_hand(world: World3) -> None:
    scene, belief = world.task.true.scene, world.belief
    n = len(world.task.robot.joint_names)
    X_cup, X_ball = scene.body("cup").X_WO, scene.body("ball").X_WO
    q = np.full(n, 0.3)
    belief.hold(Carried("cup", "palm", Transform.identity()), world.state(q, X_cup, X_ball))
    belief.update("cup", X_cup, np.eye(6))
    seen = belief.look(world.state(q, X_cup, X_ball))
    np.testing.assert_allclose(pose(seen, 0), matrix(X_cup), atol=1e-12)
    np.testing.assert_allclose(pose(seen, 1), matrix(X_ball), atol=1e-12)
    np.testing.assert_array_equal(belief.covariance("cup"), np.eye(6))


def test_without_uncertain_bodies_the_state_is_the_true_one(tmp_path: Path) -> None:
    task = load_task(ROOT / "tasks" / "pour.yaml")
    belief = Belief(task.scene, task.true.scene, Kinematics(task.robot))
    state = WorldState.room(1, 2)
    assert belief.look(state) is state
    assert belief.names == ()
    assert task.scene is task.true.scene


RUN = """\
steps:
  - wait: 0.1 s
  - pick: {object: cup, approach: {from: side, distance: 9 cm}, grasp: {posture: wrap, force: 8 N, height: 68 mm}}
    timeout: 2.2 s
    on_fail: continue
  - wait: 0.2 s
watch:
  - never: {near: {object: cup, to: [0.75, 0, 0.4], within: 2 cm}}
    during: wait_1
expect:
  - near: {object: cup, to: [0.75, 0, 0.4], within: 10 cm}
    during: wait_1
  - believed: {near: {object: cup, to: [0.75, 0, 0.4], within: 10 cm}}
    during: wait_1
  - believed: {inside: {object: ball, of: cup}}
    during: wait_1
vary: {scene.cup.mass: {choice: [150 g]}}
"""


class Asked(Live):
    """Live conditions with a probe of the first watch, from the first tick on."""

    answers: list[tuple[float, float]] = []
    spec: ConditionSpec

    def __init__(self, world: World, *rest: object) -> None:
        super().__init__(world, *rest)  # type: ignore[arg-type]
        self.open(self.spec, callback=lambda window, found: kept(self.answers, window, found))


def kept(answers: list[tuple[float, float]], window: StateWindow, found: Robustness) -> None:
    answers += zip(window.times.tolist(), found.margins.tolist(), strict=True)


@dataclass
class Missed:
    """A run of a task whose cup is believed to be more than 4 cm away from its place, its log and live answers."""

    task: Task
    file: Path
    log: Path
    sample: int
    report: RunReport
    live: list[tuple[float, float]]

    @property
    def away(self) -> float:
        """[m] from the believed to the true position at the start."""
        task = load_task(self.file, sample=self.sample)
        X, X_true = (scene.body("cup").X_WO for scene in (task.scene, task.true.scene))
        return float(np.linalg.norm(X.p - X_true.p))


@pytest.fixture(scope="module")
def missed(tmp_path_factory: pytest.TempPathFactory) -> Missed:
    folder = tmp_path_factory.mktemp("missed")
    file = folder / "task.yaml"
    file.write_text(HEAD + SCENE.replace("KNOWN", "{region: {box: [0, 10 cm, 0]}}") + RUN)
    task = load_task(file)
    sample = int(np.argmax(errors(task, 50)[0][:, 1] < -0.042))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(execute, "Live", Asked)
        Asked.answers, Asked.spec = [], task.spec.watch[0].condition
        report = pipeline.run_task(file, log=folder / "log.mcap", sample=sample)
    return Missed(task, file, folder / "log.mcap", sample, report, Asked.answers)


def test_a_cup_that_is_elsewhere_is_not_picked(missed: Missed) -> None:
    assert missed.away > 0.042
    pick = missed.report.verdict.steps[1]
    assert pick.outcome != "done"
    assert pick.replanned == ()  # nothing tells the robot where it is


def test_expectations_are_asked_of_the_truth_and_believed_ones_of_the_belief(missed: Missed) -> None:
    plain, believed, inside = missed.report.verdict.expectations[:3]
    assert plain.margin == pytest.approx(0.1, abs=1e-4)  # the cup settles by some micrometres
    assert believed.margin == pytest.approx(0.1 - missed.away, abs=1e-9)
    assert inside.outcome == "passed"
    assert missed.report.verdict.expectations[3].outcome == "passed"  # the watch would be broken in truth


def test_a_watch_has_the_same_margins_live_and_judged(missed: Missed) -> None:
    recording = open_recording(missed.log)
    task, scene = missed.task, missed.task.true.scene
    order = Order.of(recording, task.robot, scene)
    assert isinstance(order, Order)
    windows, judged, monitor = WindowsOfSpans(order, ()), list[tuple[float, float]](), None
    for span in recording.spans:
        window = windows.next(span)
        if monitor is None:
            world = World(task.robot, scene, start=window.states.map(lambda a: a[0]))
            monitor = believing(task.spec.watch[0].condition, world, CONDITIONS)
        kept(judged, window, monitor(window))
    assert len(judged) > 300
    assert missed.live == judged[: len(missed.live)]
    assert len(missed.live) > 300


def test_the_log_is_repeated_with_the_same_bytes(missed: Missed) -> None:
    assert pipeline.verify_log(missed.log, package_path=(ROOT / "robots",)).identical


def test_a_part_begins_with_the_belief_of_the_log(missed: Missed) -> None:
    part = missed.log.with_name("part.mcap")
    pipeline.run_task(missed.file, log=part, from_step="wait_2", state=missed.log, sample=missed.sample)
    first, whole = read_recording(part), read_recording(missed.log)
    began = next(event.time for event in whole.events if event.kind == "step_started" and event.step == "wait_2")
    k = int(np.searchsorted(whole.states.time, began - 1e-9)) - 1
    cup = first.believed_names.index("cup")
    np.testing.assert_allclose(believed(first)[0, cup], believed(whole)[k, cup], atol=1e-12)
    np.testing.assert_array_equal(first.beliefs[0].covariance, whole.beliefs[0].covariance)


def believed(recording: Recording) -> Array:
    (span,) = recording.whole().spans
    return span.believed
