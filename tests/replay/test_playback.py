"""What is shown of a log is what the log says, read by other libraries; what is missing is said."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import matrix_from_quat
from manipcli.judge.verdict import StepOutcome, Verdict
from manipcli.logs.mesh_search import MeshSearch
from manipcli.logs.plot import open_chart
from manipcli.logs.replay import open_playback
from manipcli.logs.snapshot import moment
from manipcli.model.state import Contact
from manipcli.pipeline import run_task
from manipcli.record.read.reading import read_recording
from manipcli.record.recording import ContactSnapshot
from manipcli.record.schemas import schema_text
from manipcli.render.drawing import draw
from manipcli.replay.display_sampling import SampledContacts, sampled
from manipcli.replay.playback import Playback, PlaybackStep
from manipcli.replay.player import player_page
from manipcli.shapes.primitives import Mesh

ROOT = Path(__file__).parents[2]
TYPES = get_typestore(Stores.ROS2_HUMBLE)
TASK = f"""task: wave
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
scene:
  block: {{box: {{size: [0.05, 0.05, 0.05]}}, mass: 0.1, pose: {{xyz: [0.6, 0.2, 0.5]}}}}
steps:
  - move: {{to: {{joint_1: 0.2, joint_4: -1.4}}}}
  - wait: 0.055 s
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("log")
    (folder / "wave.yaml").write_text(TASK)
    run_task(folder / "wave.yaml", log=folder / "wave.mcap", allow_outside=True)
    return folder / "wave.mcap"


@pytest.fixture(scope="module")
def playback(log: Path) -> Playback:
    return open_playback(log, package_path=[ROOT / "robots"])


def _transforms(log: Path) -> dict[int, dict[str, tuple[str, np.ndarray]]]:
    """Child -> (parent, 4 x 4) for each time [ns] of /tf, as the mcap library and rosbags read them."""
    fixed: dict[str, tuple[str, np.ndarray]] = {}
    found: dict[int, dict[str, tuple[str, np.ndarray]]] = {}
    with log.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=["/tf", "/tf_static"]):
            into = fixed if channel.topic == "/tf_static" else found.setdefault(message.log_time, {})
            for one in TYPES.deserialize_cdr(message.data, "tf2_msgs/msg/TFMessage").transforms:
                X = np.eye(4)
                t, r = one.transform.translation, one.transform.rotation
                X[:3, :3], X[:3, 3] = matrix_from_quat([r.x, r.y, r.z, r.w]), (t.x, t.y, t.z)
                into[one.child_frame_id] = (one.header.frame_id, X)
    return {ns: fixed | each for ns, each in found.items()}


def _in_world(frame: str, tree: dict[str, tuple[str, np.ndarray]]) -> np.ndarray:
    X = np.eye(4)
    while frame != "world":
        frame, above = tree[frame]
        X = above @ X
    return X


@pytest.mark.slow
def test_every_frame_stands_where_tf_says(log: Path, playback: Playback) -> None:
    tree = _transforms(log)
    frames = draw(playback.robot, playback.scene).frames
    poses = playback.poses()
    for k in np.linspace(0, len(playback.times) - 1, 5).astype(int):
        now = tree[round(playback.times[k] * 1e9)]
        for n, frame in enumerate(frames[1:], start=1):
            X = _in_world(frame.removeprefix("robot/"), now)
            np.testing.assert_allclose(poses.position[k, n], X[:3, 3], atol=1e-9)
            np.testing.assert_allclose(matrix_from_quat(poses.quat_xyzw[k, n]), X[:3, :3], atol=1e-9)


def test_the_times_are_the_ticks_nearest_to_the_rate(log: Path) -> None:
    recording = read_recording(log)
    ticks = recording.states.time
    for rate in (50.0, 30.0, 7.0, 5000.0):
        chosen_span, *_ = sampled(recording, rate=rate) or pytest.fail("nothing is recorded")
        samples = chosen_span.states
        goals = np.arange(0.0, ticks[-1] + 1e-12, 1.0 / rate)
        nearest = {int(np.argmin(np.abs(ticks - goal))) for goal in goals} | {0, len(ticks) - 1}
        # Half way between two ticks either is the nearest.
        chosen = {int(np.flatnonzero(ticks == time)[0]) for time in samples.time}
        assert len(chosen) == len(samples.time)
        assert all(min(abs(one - other) for other in nearest) <= 1 for one in chosen)
        assert abs(len(chosen) - len(nearest)) <= 1
        assert samples.time[0] == ticks[0]
        assert samples.time[-1] == ticks[-1]
        np.testing.assert_array_equal(samples.position, recording.states.position[sorted(chosen)])


def test_the_reference_is_that_of_the_controller_and_nan_where_there_is_none(log: Path, playback: Playback) -> None:
    recording = read_recording(log)
    (arm,) = [trace for trace in recording.controllers if "joint_4" in trace.joints]
    ticks = np.searchsorted(recording.states.time, playback.times)
    column = playback.joint_names.index("joint_4")
    wanted = arm.reference_position[ticks, arm.joints.index("joint_4")]
    np.testing.assert_array_equal(playback.reference[:, column], wanted)
    moved = {name for trace in recording.controllers for name in trace.joints}
    for k, name in enumerate(playback.joint_names):
        assert np.isnan(playback.reference[:, k]).all() == (name not in moved)
    assert np.isfinite(playback.reference_position()).all()


def test_steps_and_phases_stand_where_the_events_say(log: Path, playback: Playback) -> None:
    events = read_recording(log).events
    for step in playback.steps:
        mine = [one for one in events if one.step == step.id]
        assert step.start == next(one.time for one in mine if one.kind == "step_started")
        assert step.end == next(one.time for one in mine if one.kind == "step_ended")
        assert [(phase.name, phase.start) for phase in step.phases] == [
            (one.text, one.time) for one in mine if one.kind == "phase_started"
        ]
    assert [step.verb for step in playback.steps] == ["move", "wait"]
    assert playback.step_at((playback.steps[0].start + playback.steps[0].end) / 2) is playback.steps[0]
    assert playback.verdict is not None and playback.lost is None


@pytest.mark.slow
def test_the_curves_are_those_of_the_log(log: Path, playback: Playback) -> None:
    states = read_recording(log).states
    ticks = np.searchsorted(states.time, playback.times)
    curves = {one.name: one for one in playback.curves()}
    np.testing.assert_array_equal(curves["joint position"].values, states.position[ticks])
    tool = draw(playback.robot).marks[0]
    X = _in_world(tool.frame.removeprefix("robot/"), _transforms(log)[0]) @ tool.X_FM.matrix
    np.testing.assert_allclose(curves["tool position"].values[0], X[:3, 3], atol=1e-9)


def test_no_touch_between_two_times_is_lost() -> None:
    def touch(time: float, *forces: tuple[str, float]) -> ContactSnapshot:
        return ContactSnapshot(time, tuple(Contact("a", b, force, 0.0) for b, force in forces))

    gathered = SampledContacts()
    gathered.add([touch(0.0, ("b", 1.0)), touch(0.011, ("b", 9.0), ("c", 2.0)), touch(0.012)], np.array([0.0, 0.02]))
    gathered.add([touch(0.05, ("c", 3.0))], np.array([0.04, 0.06]))
    found = [[(one.b, one.force) for one in each] for each in gathered.found]
    assert found == [[("b", 1.0)], [("b", 9.0), ("c", 2.0)], [], [("c", 3.0)]]
    assert gathered.times == [(0.0,), (0.011, 0.011), (), (0.05,)]


def test_a_log_that_was_cut_is_shown_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    partial = tmp_path / "wave.mcap.partial"
    partial.write_bytes(log.read_bytes()[: int(log.stat().st_size * 0.8)])
    cut = open_playback(partial)
    assert cut.lost is not None
    assert cut.verdict is not None and cut.verdict.verdict == "error"


@pytest.mark.slow
def test_a_package_that_is_not_there_is_told_and_something_is_drawn_all_the_same(
    log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    without = open_playback(log)
    assert [note for note in without.notes if "'arm7_hand3'" in note and "--package-path" in note]
    robot, whole = without.robot, open_playback(log, package_path=[ROOT / "robots"])
    assert whole.notes == ()
    assert robot is not None
    np.testing.assert_array_equal(without.poses().position, whole.poses().position)
    simple = {link.name for link in robot.links for g in link.collisions if not isinstance(g.shape, Mesh)}
    assert simple
    assert {f"robot/{name}" for name in simple} <= {one.frame for one in draw(robot).layer("visual")}


def test_meshes_of_the_project_that_holds_the_runs_are_found_from_anywhere(
    log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    shutil.copytree(ROOT / "robots", tmp_path / "project" / "robots")
    for folder in ("runs", "downloads"):
        (tmp_path / "project" / folder).mkdir()
    assert open_playback(Path(shutil.copy(log, tmp_path / "project" / "runs" / "lift.mcap"))).notes == ()
    assert open_playback(Path(shutil.copy(log, tmp_path / "project" / "downloads" / "lift.mcap"))).notes != ()


def test_what_has_just_run_is_drawn_with_the_files_that_it_had(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A workspace of ROS: the description is in no folder beside, above or below the files of the project."""
    shutil.copytree(ROOT / "robots" / "arm7_hand3", tmp_path / "ws" / "src" / "arm7_hand3")
    robot = (ROOT / "robots" / "arm7_hand3" / "robot.yaml").read_text()
    project = tmp_path / "projects" / "wave"
    (project / "runs").mkdir(parents=True)
    (project / "robot.yaml").write_text(
        robot.replace("description: urdf", "description: ../../ws/src/arm7_hand3/urdf"), "utf-8"
    )
    task = TASK.replace(f"{ROOT}/robots/arm7_hand3/robot.yaml", "robot.yaml")
    (project / "wave.yaml").write_text(task)
    monkeypatch.chdir(project)
    report = run_task(Path("wave.yaml"))
    assert report.log is not None
    known = open_playback(Path(report.log), meshes=report.meshes)
    assert known.notes == ()
    assert any(isinstance(one.shape, Mesh) for one in known.robot.links[1].visuals)
    assert open_playback(Path(report.log)).notes != ()


def test_a_mesh_that_is_another_file_than_in_the_run_is_told(log: Path, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "robots" / "arm7_hand3", tmp_path / "arm7_hand3")
    victim = tmp_path / "arm7_hand3" / "meshes" / "palm.stl"
    victim.write_bytes(victim.read_bytes() + b" ")
    notes = open_playback(log, package_path=[tmp_path]).notes
    assert [note for note in notes if "palm.stl" in note and "differs from the file" in note] == list(notes)


def test_meshes_that_the_log_carries_need_no_package(log: Path, playback: Playback, tmp_path: Path) -> None:
    assert playback.robot is not None
    shapes = [g.shape for one in playback.robot.links for g in (*one.visuals, *one.collisions)]
    meshes = {one.uri: one.path for one in shapes if isinstance(one, Mesh)}
    carried = {uri: path.read_bytes() for uri, path in meshes.items()}
    hashes = {uri: hashlib.sha256(data).hexdigest() for uri, data in carried.items()}
    search = MeshSearch(tmp_path / "x.mcap", hashes=hashes, embedded=carried | {"package://evil/../../../x.stl": b"x"})
    found = search.robot(playback.robot)
    for link in found.links:
        for geometry in link.visuals:
            if isinstance(geometry.shape, Mesh):
                assert geometry.shape.path.read_bytes() == carried[geometry.shape.uri]
    folder = Path(search.folder.name) if search.folder is not None else tmp_path
    assert not list(folder.parent.glob("x.stl"))
    assert len([one for one in folder.rglob("*") if one.is_file()]) == len(carried) + 1
    assert search.notes == ()


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    for name, content in (("a.mcap", b"not one at all"), ("b.mcap", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InvalidInput) as refused:
            open_playback(tmp_path / name)
        assert refused.value.findings[0].code == "LOG300"


# ------------------------------------------------------------------------------------- logs of other programs

URDF = """<robot name="two">
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <link name="upper"><visual><geometry><box size="0.1 0.1 0.4"/></geometry></visual></link><link name="slide"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="0.3 0 0"/>
    <axis xyz="0 0.6 0.8"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
  <joint name="push" type="prismatic"><parent link="upper"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
</robot>"""
BEGIN = 1_700_000_000_000_000_000


def _foreign(
    path: Path,
    *,
    urdf: bool = True,
    joints: tuple[str, ...] = ("turn", "push"),
    tf: bool = True,
    gaps: bool = False,
    spaces: tuple[str, ...] = ("",),
    one_tf: bool = False,
    without: tuple[str, ...] = (),
    hole: tuple[float, float] = (1.0, 1.0),
) -> Path:
    """A second of a log as rosbag2 writes one, times since 1970; `turn` = sin(t), `push` = 0.1 t; a camera flies by.
    With `gaps` the second joint comes late, and the first is NaN for a while. `spaces`: before the names of topics, but
    with `one_tf` not before `/tf`; the base of the n-th stands at x = 1 + n. `without`: topics that are not there.
    `hole`: times between which there is nothing."""
    message = TYPES.types
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        ids: dict[str, int] = {}

        def put(usual: str, kind: str, ns: int, content: object, spaces: tuple[str, ...] = spaces) -> None:
            data = bytes(TYPES.serialize_cdr(content, kind))
            for topic in (space + usual for space in spaces if space + usual not in without):
                if topic not in ids:
                    schema = writer.register_schema(kind, "ros2msg", schema_text(kind).encode())
                    ids[topic] = writer.register_channel(topic, "cdr", schema)
                writer.add_message(ids[topic], log_time=ns, publish_time=ns, data=data)

        def header(ns: int, frame: str) -> object:
            stamp = message["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
            return message["std_msgs/msg/Header"](stamp, frame)

        def transform(ns: int, parent: str, child: str, xyz: tuple[float, ...], q: tuple[float, ...]) -> object:
            pose = message["geometry_msgs/msg/Transform"](
                message["geometry_msgs/msg/Vector3"](*xyz), message["geometry_msgs/msg/Quaternion"](*q)
            )
            return message["geometry_msgs/msg/TransformStamped"](header(ns, parent), child, pose)

        if urdf:
            kind = "std_msgs/msg/String"
            put("/robot_description", kind, BEGIN - 5 * 10**9, message[kind](URDF))
        for k in range(101):
            t, ns = k / 100, BEGIN + k * 10**7
            if hole[0] < t < hole[1]:
                continue
            if joints:
                if gaps:
                    joints = ("turn", "push") if t >= 0.5 else ("turn",)
                kind, value = "sensor_msgs/msg/JointState", {"turn": np.sin(t), "push": 0.1 * t}
                position = np.array([value[name] for name in joints])
                if gaps and 0.2 < t < 0.4:
                    position[0] = np.nan
                put(
                    "/joint_states", kind, ns, message[kind](header(ns, ""), list(joints), position, *[np.zeros(0)] * 2)
                )
            if tf:
                a, c, s = np.sin(t) / 2, np.cos(0.15), np.sin(0.15)
                # Rx(0.3) then the turn about (0, 0.6, 0.8): Hamilton's product by hand.
                y, z, w = 0.6 * np.sin(a), 0.8 * np.sin(a), np.cos(a)
                q = (s * w, c * y - s * z, c * z + s * y, c * w)
                for n, space in enumerate(("",) if one_tf else spaces):
                    transforms = [
                        transform(ns, "map", "base", (1.0 + n, 2.0, 0.5), (0.0, 0.0, 0.0, 1.0)),
                        transform(ns, "base", "upper", (0.0, 0.0, 0.1), q),
                        transform(ns, "base", "camera", (t, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
                    ]
                    kind = "tf2_msgs/msg/TFMessage"
                    put("/tf", kind, ns, message[kind](transforms), (space,))
        writer.finish()
    return path


def test_a_pause_of_the_recorder_is_a_gap(tmp_path: Path) -> None:
    shown = open_playback(_foreign(tmp_path / "bag.mcap", hole=(0.403, 0.697)), rate=100.0)
    assert np.array(shown.gaps) == pytest.approx(np.array([[0.4, 0.7]]))
    k = int(np.argmax(np.diff(shown.times)))
    assert shown.times[k : k + 2] == pytest.approx([0.4, 0.7])
    np.testing.assert_allclose(shown.position[k : k + 2, 1], [0.04, 0.07], atol=1e-7)
    assert "no data from 0.40 to 0.70 s: the state before is held" in shown.notes
    assert open_playback(_foreign(tmp_path / "whole.mcap")).gaps == ()


def test_a_log_of_another_program_is_shown(tmp_path: Path) -> None:
    shown = open_playback(_foreign(tmp_path / "bag.mcap"), rate=100.0)
    assert (shown.start, shown.end) == pytest.approx((0.0, 1.0))
    assert shown.joint_names == ("turn", "push")
    np.testing.assert_allclose(shown.position[:, 0], np.sin(shown.times), atol=2e-5)  # straight between samples
    np.testing.assert_allclose(shown.position[:, 1], 0.1 * shown.times, atol=1e-7)
    poses, frames = shown.poses(), draw(shown.robot, shown.scene).frames
    base, camera = frames.index("robot/base"), frames.index("camera")
    np.testing.assert_allclose(poses.position[:, base], [[1.0, 2.0, 0.5]] * len(shown.times), atol=1e-9)
    np.testing.assert_allclose(poses.position[:, camera, 0], 1.0 + shown.times, atol=1e-6)
    assert shown.verdict is None and shown.steps == ()
    assert "no verdict" in shown.notes[0]


def test_joints_that_no_joint_state_names_come_from_tf_or_stand_at_zero(tmp_path: Path) -> None:
    whole = open_playback(_foreign(tmp_path / "bag.mcap"), rate=100.0)
    shown = open_playback(_foreign(tmp_path / "bare.mcap", joints=()), rate=100.0)
    np.testing.assert_allclose(shown.position[:, 0], whole.position[:, 0], atol=1e-4)
    assert np.isnan(shown.position[:, 1]).all() and not shown.stance[:, 1].any()
    told = "\n".join(shown.notes)
    assert "no /joint_states" in told
    assert "at zero" in told and "push" in told
    assert "from /tf" in told and "turn" in told


def test_what_a_log_does_not_say_is_no_curve(tmp_path: Path) -> None:
    """One joint is told from 0.5 s on, of the other there is no number from 0.2 s to 0.4 s: the curves have gaps there,
    and the robot is drawn as it was before, or will be."""
    shown = open_playback(_foreign(tmp_path / "bag.mcap", tf=False, gaps=True), rate=100.0)
    times, (turn, push) = shown.times, shown.curves()[0].values.T
    inside, late = (times > 0.201) & (times < 0.399), times > 0.499
    np.testing.assert_array_equal(np.isnan(turn), inside)
    np.testing.assert_array_equal(np.isnan(push), ~late)
    np.testing.assert_allclose(shown.stance[inside, 0], np.sin(0.2), atol=1e-6)
    np.testing.assert_allclose(shown.stance[~late, 1], 0.05, atol=1e-6)
    assert np.isfinite(shown.poses().position).all()
    assert any(
        "held at the nearest known position" in note and "turn" in note and "push" in note for note in shown.notes
    )


def test_a_robot_in_a_namespace_is_the_one_that_is_shown(tmp_path: Path) -> None:
    whole = open_playback(_foreign(tmp_path / "bag.mcap"), rate=10.0)
    path = _foreign(tmp_path / "space.mcap", spaces=("/cell/r1",))
    shown = open_playback(path, rate=10.0)
    np.testing.assert_array_equal(shown.position, whole.position)
    assert shown.notes == whole.notes
    assert moment(path, 5.5).joints == moment(tmp_path / "bag.mcap", 5.5).joints


def test_of_several_robots_a_moment_names_which(tmp_path: Path) -> None:
    path = _foreign(tmp_path / "two.mcap", spaces=("/r1", "/r2"))
    joints = {joint.name: joint for joint in moment(path, 5.5).joints}
    assert list(joints) == ["r1/turn", "r1/push", "r2/turn", "r2/push"]
    assert [joint.unit for joint in joints.values()] == ["rad", "m", "rad", "m"]
    assert joints["r2/turn"].position == pytest.approx(np.sin(0.5))
    poses = {pose.name: pose for pose in moment(path, 5.5).poses}
    frames = {"base": "map", "upper": "base", "camera": "base"}
    tree = {f"{robot}/{child}": f"{robot}/{parent}" for robot in ("r1", "r2") for child, parent in frames.items()}
    assert {name: pose.parent for name, pose in poses.items()} == tree
    assert [poses[f"{robot}/base"].pose.p[0] for robot in ("r1", "r2")] == [1.0, 2.0]


def test_several_robots_are_shown_together_each_as_it_is_shown_alone(tmp_path: Path) -> None:
    path = _foreign(tmp_path / "two.mcap", spaces=("/r1", "/r2"))
    both = open_playback(path, rate=10.0)
    drawing, poses = draw(both.robot, both.scene), both.poses()
    assert any("2 robots in the log: /r1, /r2; --robot /r1 shows one alone" in note for note in both.notes)
    for space in ("r1", "r2"):
        alone = open_playback(path, rate=10.0, space=f"/{space}")
        np.testing.assert_array_equal(both.times, alone.times)
        theirs = alone.poses()
        for k, frame in enumerate(draw(alone.robot, alone.scene).frames):
            if frame == "world":
                continue
            head, _, name = frame.rpartition("/")
            mine = drawing.frames.index(f"{head}/{space}/{name}" if head else f"{space}/{name}")
            np.testing.assert_allclose(poses.position[:, mine], theirs.position[:, k], atol=1e-12)
            turned = abs((poses.quat_xyzw[:, mine] * theirs.quat_xyzw[:, k]).sum(axis=1))
            np.testing.assert_allclose(turned, 1.0, atol=1e-12)
    single = draw(alone.robot, alone.scene)
    assert len(drawing.layer("visual")) == 2 * len(single.layer("visual"))
    assert both.joint_names == ("r1/turn", "r1/push", "r2/turn", "r2/push")


@pytest.mark.parametrize("one_tf", [False, True])
def test_of_several_robots_one_is_chosen(tmp_path: Path, one_tf: bool) -> None:
    path = _foreign(tmp_path / "two.mcap", spaces=("/r1", "/r2"), one_tf=one_tf)
    whole, shown = (
        open_playback(_foreign(tmp_path / "bag.mcap"), rate=10.0),
        open_playback(path, rate=10.0, space="/r2"),
    )
    assert shown.joint_names == whole.joint_names
    np.testing.assert_array_equal(shown.position, whole.position)
    if not one_tf:
        assert whole.robot is not None and shown.robot is not None
        assert shown.robot.X_WB.p[0] == whole.robot.X_WB.p[0] + 1.0
    with pytest.raises(InvalidInput, match="no robot in '/r3'"):
        open_playback(path, space="/r3")
    with pytest.raises(InvalidInput, match="no robot in '/r2'"):
        open_playback(tmp_path / "bag.mcap", space="/r2")


def test_of_a_chosen_robot_it_is_told_what_it_has_not(tmp_path: Path) -> None:
    """Whatever the others have."""
    lacks = ("/r2/robot_description", "/r2/tf")
    shown = open_playback(_foreign(tmp_path / "two.mcap", spaces=("/r1", "/r2"), without=lacks), rate=10.0, space="/r2")
    assert [note.split(" (")[0] for note in shown.notes if note.startswith("'/r2'")] == [
        "'/r2' has no /robot_description",
        "'/r2' has no /tf",
    ]
    still = _foreign(tmp_path / "still.mcap", spaces=("/r1", "/r2"), without=("/r2/joint_states", "/r2/tf"))
    with pytest.raises(InvalidInput, match="nothing to show: '/r2' has neither /joint_states nor /tf") as refused:
        open_playback(still, space="/r2")
    assert "--robot" not in str(refused.value.findings[0].hint)


def test_an_overview_shows_the_joints_of_every_robot(tmp_path: Path) -> None:
    chart = open_chart([_foreign(tmp_path / "two.mcap", spaces=("/r1", "/r2"))], [])
    names = {curve.name for panel in chart.panels for curve in panel.curves}
    assert {f"{space}/joint_states.position[{joint}]" for space in ("r1", "r2") for joint in ("turn", "push")} <= names


def test_robots_that_share_their_frames_are_told_to_be_at_one_place(tmp_path: Path) -> None:
    shown = open_playback(_foreign(tmp_path / "two.mcap", spaces=("/r1", "/r2"), one_tf=True), rate=10.0)
    assert shown.robot is not None
    assert {link.name for link in shown.robot.links} >= {"r1/base", "r2/base"}
    assert any("/r1, /r2 are drawn at one place" in note for note in shown.notes)


def test_without_a_description_the_frames_are_shown(tmp_path: Path) -> None:
    shown = open_playback(_foreign(tmp_path / "frames.mcap", urdf=False, joints=()), rate=10.0)
    assert shown.robot is None and shown.scene is not None
    assert {body.name for body in shown.scene.bodies} == {"base", "upper", "camera"}
    camera = [body.name for body in shown.scene.bodies].index("camera")
    np.testing.assert_allclose(shown.body_position[:, camera, 0], 1.0 + shown.times, atol=1e-9)


def test_steps_that_never_began_are_counted(tmp_path: Path) -> None:
    shown = open_playback(_foreign(tmp_path / "bag.mcap"), rate=10.0)
    steps = tuple(PlaybackStep(f"step_{k}", "move", f"step_{k}", k / 2, (k + 1) / 2, "done") for k in range(2))
    outcomes = tuple(StepOutcome(f"step_{k}", "move", "not_run", None, None, 1.0) for k in range(3))
    verdict = Verdict("t", "failed", 0, "pybullet", 1.0, outcomes, ())
    assert replace(shown, steps=steps).total == 2
    assert replace(shown, steps=steps, verdict=verdict).total == 3


def test_without_a_description_there_are_frames_and_curves(tmp_path: Path) -> None:
    shown = open_playback(_foreign(tmp_path / "bag.mcap", urdf=False))
    assert shown.robot is None
    assert {body.name for body in shown.scene.bodies} >= {"base", "camera"}  # type: ignore[union-attr]
    assert [one.name for one in shown.curves()] == ["joint position"]
    assert "no /robot_description" in "\n".join(shown.notes)
    page = player_page(shown)
    assert "not written by manipcli" in page
    assert '"frames":[' in page and '"curves":[{"name":"joint position"' in page


def test_a_log_with_nothing_that_moves_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as refused:
        open_playback(_foreign(tmp_path / "bag.mcap", joints=(), tf=False))
    assert "/joint_states" in str(refused.value)


def test_an_index_is_that_of_the_nearest_time(playback: Playback) -> None:
    few = replace(playback, times=np.array([0.0, 1.0, 3.0]))
    assert [few.index(t) for t in (-1.0, 0.4, 0.6, 1.9, 2.1, 9.0)] == [0, 0, 1, 1, 2, 2]
