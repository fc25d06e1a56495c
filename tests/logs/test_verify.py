"""A log simulated again from nothing but itself: identical, or what was changed in it is named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.records import Message
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from manipcli.cli.app import main
from manipcli.core.errors import InvalidInput
from manipcli.logs import recorded_task
from manipcli.pipeline import run_task, verify_log
from manipcli.simulate.engines import ENGINES

ROOT = Path(__file__).parents[2]
Rewrite = Callable[..., Path]


CHANGED_NS = 700_000_000


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wrist moves, on the ideal engine; the cube's mesh lies in a package of its own."""
    folder = tmp_path_factory.mktemp("verify")
    package = folder / "things"
    package.mkdir()
    (package / "package.xml").write_text("<package/>")
    corners = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]
    faces = ["f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
    (package / "wedge.obj").write_text("\n".join([*(f"v {x} {y} {z}" for x, y, z in corners), *faces, ""]))
    task = folder / "wave.yaml"
    task.write_text(
        f"task: wave\nrobot: {ROOT}/robots/differential_wrist/robot.yaml\n"
        f"controllers: {ROOT}/controllers/differential_wrist.yaml\n"
        "simulation: {engine: kinematic}\n"
        "scene:\n  wedge: {mesh: {file: 'package://things/wedge.obj'}, mass: 0.1, pose: {xyz: [2, 2, 0]}}\n"
        "steps:\n  - move: {to: {pitch: 0.3}}\n  - wait: 0.2 s\n"
        "expect: [{duration: {below: 20 s}}]\n"
    )
    path = folder / "wave.mcap"
    assert run_task(task, log=path, package_path=[folder]).verdict.verdict == "passed"
    return path


def _change_a_velocity(topic: str, one: Message) -> bytes:
    """The last bit of one velocity of one message."""
    if topic != "/joint_states" or one.log_time != CHANGED_NS:
        return one.data
    at = len(one.data) - 8 * 3 - 8
    # position, velocity and effort each hold two doubles, behind a count and its padding
    data = bytearray(one.data)
    data[at] ^= 1
    return bytes(data)


def test_a_fresh_log_is_identical_with_and_without_its_meshes(log: Path, tmp_path: Path) -> None:
    made = verify_log(log)
    assert made.identical
    assert (made.cut, made.unlike, made.entries) == ("", (), ())
    assert made.messages.messages > 1000
    whole = tmp_path / "embedded.mcap"
    run_task(log.with_name("wave.yaml"), log=whole, package_path=[log.parent], embed_meshes=True)
    elsewhere = whole.rename(tmp_path / "elsewhere.mcap")
    assert verify_log(elsewhere).identical, "it carries its meshes"


def test_one_changed_bit_is_the_message_that_is_named(
    log: Path, tmp_path: Path, rewrite_log: Rewrite, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(log.parent)
    changed = rewrite_log(log, tmp_path / "changed.mcap", message=_change_a_velocity)
    assert main(["judge", str(changed)]) == 0, "nothing but a second simulation would tell"
    capsys.readouterr()
    assert main(["replay", str(changed), "--verify", "--format", "json"]) == 1
    found = json.loads(capsys.readouterr().out)
    first = found["first"]
    assert [one["name"] for one in found["topics"] if one["different"]] == ["/joint_states"]
    assert found["entries"] == []
    assert (first["topic"], first["time"]) == ("/joint_states", 0.7)
    store = get_typestore(Stores.ROS2_JAZZY)
    read: list[Any] = []
    for path in (changed, log):
        with AnyReader([path], default_typestore=store) as reader:
            only = [one for one in reader.connections if one.topic == "/joint_states"]
            messages = [(time, raw, one) for one, time, raw in reader.messages(only)]
            time, raw, one = messages[first["message"]]
            assert time == CHANGED_NS
            read.append(reader.deserialize(raw, one.msgtype))
    field, name = first["field"].rstrip("]").split("[")
    k = list(read[0].name).index(name)
    values = [getattr(message, field)[k] for message in read]
    assert [first["a"], first["b"]] == values
    assert values[0] != values[1]
    assert first["by"] == values[1] - values[0]


def test_what_lies_beside_the_messages_is_compared_too(
    log: Path, tmp_path: Path, rewrite_log: Rewrite, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(log.parent)
    other = rewrite_log(
        log,
        tmp_path / "other.mcap",
        metadata=lambda name, values: values | {"verdict": "failed"} if name == "verdict" else values,
    )
    assert main(["replay", str(other), "--verify"]) == 1
    out = capsys.readouterr().out
    assert "metadata 'verdict', verdict: 'failed' in the log, 'passed' in the re-run" in out
    assert "same messages" in out
    mild = rewrite_log(
        log,
        tmp_path / "mild.mcap",
        attachment=lambda name, data: data.replace(b"0.3", b"0.4") if name == "task.yaml" else data,
    )
    made = verify_log(mild)
    assert not made.identical
    assert "/joint_states" in [topic.name for topic in made.messages.topics if topic.different]
    assert [one.name for one in made.entries if one.kind == "attachment"] == ["plan.json"]


def test_other_versions_and_meshes_are_refused_unless_allowed(
    log: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(log.parent)
    with monkeypatch.context() as patch:
        patch.setattr(recorded_task, "__version__", "0.0.7")
        assert main(["replay", str(log), "--verify"]) == 4
        err = capsys.readouterr().err
        assert "manipcli differs: " in err
        assert "0.0.7 now" in err
        assert "--allow-different" in err
        assert main(["replay", str(log), "--verify", "--allow-different"]) == 0
        assert "differs from the run: manipcli differs: " in capsys.readouterr().out
    wedge = log.parent / "things" / "wedge.obj"
    text = wedge.read_text()
    wedge.write_text(text.replace("0.1", "0.2"))
    try:
        with pytest.raises(InvalidInput, match="differs from the file of the run"):
            verify_log(log)
        made = verify_log(log, allow_different=True)
        assert len(made.unlike) == 1
        wedge.unlink()
        for allowed in (False, True):
            with pytest.raises(InvalidInput, match="not found: the log cannot be re-simulated"):
                verify_log(log, allow_different=allowed)
    finally:
        wedge.write_text(text)


def test_a_log_that_ends_early_is_compared_as_far_as_it_goes(
    log: Path, tmp_path: Path, rewrite_log: Rewrite, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(log.parent)
    cut = tmp_path / "wave.mcap.partial"
    data = log.read_bytes()
    cut.write_bytes(data[: len(data) * 3 // 4])
    made = verify_log(cut)
    assert made.identical
    assert "the file is not finished" in made.cut
    changed = rewrite_log(log, tmp_path / "changed.mcap", message=_change_a_velocity).read_bytes()
    cut.write_bytes(changed[: len(changed) * 95 // 100])
    made = verify_log(cut)
    assert made.messages.first is not None
    assert made.messages.first.time == 0.7


@pytest.mark.slow
def test_a_log_without_its_files_and_a_foreign_one_are_refused(
    log: Path, tmp_path: Path, rewrite_log: Rewrite, capsys: pytest.CaptureFixture[str]
) -> None:
    for missing in ("task.yaml", "robot.yaml", "robot.urdf", "controllers.yaml"):
        other = rewrite_log(
            log, tmp_path / "other.mcap", attachment=lambda n, data, gone=missing: None if n == gone else data
        )
        assert main(["replay", str(other), "--verify"]) == 4
        assert missing in capsys.readouterr().err
    broken = rewrite_log(
        log,
        tmp_path / "broken.mcap",
        attachment=lambda name, data: data.replace(b"pitch", b"patch") if name == "task.yaml" else data,
    )
    assert main(["replay", str(broken), "--verify"]) == 4
    assert "patch" in capsys.readouterr().err
    assert main(["replay", str(log), "--allow-different"]) == 4
    assert main(["replay", str(log), "--verify", "--html", str(tmp_path / "x.html")]) == 4
    assert not (tmp_path / "x.html").exists()


def test_options_that_show_a_run_are_refused_where_it_is_verified(capsys: pytest.CaptureFixture[str]) -> None:
    """And those of verifying where it is shown; no log is opened."""
    shows = ["--picture", "x.png", "--at", "1", "--size", "9x9", "--view", "iso", "--fps", "25", "--speed", "1"]
    shows += ["--robot", "left", "--port", "8765", "--open"]
    assert main(["replay", "absent.mcap", "--verify", *shows]) == 4
    told = "USE080]: --picture, --at, --size, --view, --fps, --speed, --robot, --port, --open: no effect with --verify"
    assert told in capsys.readouterr().err
    assert main(["replay", "absent.mcap", "--allow-different", "--format", "json"]) == 4
    assert "--allow-different, --format json: no effect without --verify" in capsys.readouterr().out


@pytest.mark.parametrize("engine", [member.name for member in ENGINES if member.physics == "full"])
def test_a_run_with_contacts_verifies_in_each_engine(tmp_path: Path, engine: str) -> None:
    """A ball falls on the floor, beside an arm that is held."""
    if engine == "mujoco":
        pytest.importorskip("mujoco")
    task = tmp_path / "drop.yaml"
    task.write_text(
        f"task: drop\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\n"
        f"controllers: {ROOT}/controllers/arm7_hand3.yaml\n"
        f"simulation: {{engine: {engine}, settle: 0 s}}\n"
        "scene:\n  ball: {sphere: {radius: 2 cm}, mass: 50 g, pose: {xyz: [1, 0, 0.07]}}\n"
        "steps:\n  - wait: 0.3 s\n"
        "expect:\n  - eventually: {collision: [ball, floor]}\n"
    )
    path = tmp_path / "drop.mcap"
    assert run_task(task, log=path).verdict.verdict == "passed"
    made = verify_log(path)
    assert (made.identical, made.messages.first, made.entries) == (True, None, ())
    assert made.messages.messages > 300


@pytest.mark.slow
def test_a_failed_run_with_physics_verifies(tmp_path: Path) -> None:
    """Contacts amplify the last bit of anything: a robot, plan or scene that came back otherwise would be seen."""
    path = tmp_path / "run.mcap"
    assert run_task(ROOT / "examples" / "06_failure" / "task.yaml", log=path).verdict.verdict == "failed"
    made = verify_log(path)
    assert made.identical
    assert made.messages.end > 1.0
