"""What a log says about the machine that wrote it: nothing; and what a log must hold to be judged."""

from __future__ import annotations

import hashlib
import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import judge_log, run_task
from manipcli.plan.outline import PLAN_FILE
from manipcli.record.attachments import CONTROLLERS, ROBOT, SCENE, TASK, URDF
from manipcli.record.read.reading import read_recording

ROOT = Path(__file__).parents[2]
MESH = next((ROOT / "robots").rglob("*.stl"))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a task that names every file by its absolute path."""
    folder = tmp_path_factory.mktemp("somewhere")
    shutil.copy(MESH, folder / "thing.stl")
    task = folder / "task.yaml"
    arm = [f"joint_{k}" for k in range(1, 8)]
    hand = [f"finger_{k}_{part}" for k in (1, 2, 3) for part in ("proximal", "distal")]
    (folder / "all.yaml").write_text(
        "controllers:\n"
        f"  arm: {{type: joint_trajectory, command_interface: position, joints: [{', '.join(arm)}]}}\n"
        f"  hand: {{type: joint_trajectory, command_interface: velocity, joints: [{', '.join(hand)}],"
        f" gains: {{{', '.join(f'{name}: {{p: 1}}' for name in hand)}}}}}\n"
    )
    task.write_text(
        f"task: still\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {folder}/all.yaml\n"
        "simulation: {engine: kinematic}\n"
        f"scene:\n  thing: {{mesh: {{file: {folder}/thing.stl}}, fixed: true, pose: {{xyz: [2, 0, 0.5]}}}}\n"
        "steps: [{wait: 0.05 s}]\n"
        "expect: [{duration: {below: 2 s}}]\n"
    )
    path = folder / "run.mcap"
    assert run_task(task, log=path, allow_outside=True).verdict.verdict == "passed"
    return path


def everything_in(path: Path) -> bytes:
    """All that is written in a log, chunks unpacked, as the mcap library reads it."""
    parts = []
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        parts += [f"{reader.get_header()} {reader.get_summary()}".encode()]
        parts += [attachment.name.encode() + attachment.data for attachment in reader.iter_attachments()]
        parts += [repr(metadata).encode() for metadata in reader.iter_metadata()]
        parts += [repr(schema).encode() + message.data for schema, _, message in reader.iter_messages()]
    return b"\0".join(parts)


@pytest.mark.slow
def test_no_log_names_a_folder_or_the_name_of_this_machine(log: Path) -> None:
    written = everything_in(log)
    here = [ROOT, Path.cwd(), log.parent, Path(os.path.expanduser("~")), Path(os.sep) / "home", Path(os.sep) / "tmp"]  # noqa: PTH111
    for folder in here:
        assert f"{folder}{os.sep}".encode() not in written
    assert len(socket.gethostname()) < 4 or socket.gethostname().encode() not in written
    assert b"thing.stl" in written


def test_meshes_are_named_without_folders_and_hashed(log: Path) -> None:
    meshes = read_recording(log).metadata["meshes"]
    assert [uri for uri in meshes if not uri.startswith("package://")] == []
    (thing,) = [uri for uri in meshes if uri.endswith("thing.stl")]
    assert meshes[thing] == hashlib.sha256(MESH.read_bytes()).hexdigest()


@pytest.mark.parametrize(("controller", "field", "joints"), [("arm", "positions", 7), ("hand", "velocities", 6)])
def test_the_output_of_a_controller_stands_under_its_interface(
    log: Path, controller: str, field: str, joints: int
) -> None:
    store = get_typestore(Stores.EMPTY)
    with log.open("rb") as file:
        schema, _, message = next(make_reader(file).iter_messages([f"/{controller}/controller_state"]))
    assert schema is not None
    store.register(get_types_from_msg(schema.data.decode(), schema.name))
    output = store.deserialize_cdr(message.data, schema.name).output
    written = {name: len(getattr(output, name)) for name in ("positions", "velocities", "effort")}
    assert written == {"positions": 0, "velocities": 0, "effort": 0} | {field: joints}


def test_a_log_judged_again_gives_the_same_verdict(log: Path) -> None:
    assert judge_log(log).verdict == "passed"


@pytest.fixture
def filtered(log: Path, tmp_path: Path, rewrite_log: Callable[..., Path], name: str) -> Path:
    """The log without the attachment `name`."""
    return rewrite_log(log, tmp_path / "filtered.mcap", attachment=lambda one, data: None if one == name else data)


@pytest.mark.parametrize("name", [TASK, ROBOT, URDF, SCENE])
def test_a_log_without_an_attachment_that_judging_needs_is_refused_by_its_name(filtered: Path, name: str) -> None:
    with pytest.raises(InvalidInput, match=rf"attachment '{name}' is missing") as caught:
        judge_log(filtered)
    assert caught.value.findings[0].code == "LOG102"


@pytest.mark.parametrize("name", [CONTROLLERS, PLAN_FILE])
def test_other_attachments_are_not_needed(filtered: Path) -> None:
    assert judge_log(filtered).verdict == "passed"


def test_the_last_record_of_a_name_says_all_that_the_log_says_under_it(log: Path) -> None:
    with log.open("rb") as file:
        by_name = {one.name: dict(one.metadata) for one in make_reader(file).iter_metadata()}
    assert by_name == {name: dict(values) for name, values in read_recording(log).metadata.items()}
    assert by_name["run"] == {
        "task": "still", "seed": "0", "engine": "kinematic", "physics": "none", "period": "0.001",
    }  # fmt: skip
    assert by_name["end"] == {"status": "complete", "cause": ""}


def test_a_name_of_metadata_is_written_once(log: Path) -> None:
    with log.open("rb") as file:
        names = [one.name for one in make_reader(file).iter_metadata()]
    assert len(names) == len(set(names))


def test_a_log_says_the_hashes_of_the_files_that_it_carries(log: Path) -> None:
    with log.open("rb") as file:
        carried = {one.name: hashlib.sha256(one.data).hexdigest() for one in make_reader(file).iter_attachments()}
    assert read_recording(log).metadata["files"] == carried
    assert {*carried} == {TASK, ROBOT, CONTROLLERS, URDF, SCENE, PLAN_FILE}
