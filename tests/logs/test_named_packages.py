"""A robot whose package only its robot file names, and whose inertials are estimated: its log verifies and replays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.logs.replay import open_playback
from manipcli.pipeline import run_task, verify_log
from manipcli.record.read.reading import open_recording
from manipcli.shapes.mesh_formats import binary_stl

CORNERS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
MESH = '<{0}><geometry><mesh filename="package://arm_pkg/a.stl"/></geometry></{0}>'


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """`work/tasks/t.yaml` and `work/robots/robot.yaml`; the package is in `elsewhere/deep/arm`, under another name."""
    package, work = tmp_path / "elsewhere" / "deep" / "arm", tmp_path / "work"
    for folder in (package, work / "tasks", work / "robots", work / "runs"):
        folder.mkdir(parents=True)
    (package / "a.stl").write_bytes(binary_stl(CORNERS[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]))
    (package / "package.xml").write_text("<package><name>arm_pkg</name></package>")
    shapes = MESH.format("visual") + MESH.format("collision")
    (work / "robots" / "r.urdf").write_text(
        f'<robot name="r"><link name="base"/><link name="tip">{shapes}</link><joint name="j" type="revolute">'
        '<parent link="base"/><child link="tip"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    (work / "robots" / "robot.yaml").write_text(
        "robot: r\ndescription: r.urdf\npackages: {arm_pkg: ../../elsewhere/deep/arm}\ninertials: estimate\n"
    )
    (work / "c.yaml").write_text(
        "controllers:\n  j: {type: joint_trajectory, joints: [j], command_interface: position}\n"
    )
    (work / "tasks" / "t.yaml").write_text(
        "task: t\nrobot: ../robots/robot.yaml\ncontrollers: ../c.yaml\nfloor: false\nsteps: [{wait: 0.1}]\n"
    )
    monkeypatch.chdir(work)
    return work


def test_replay_finds_what_run_found(project: Path) -> None:
    log = project / "runs" / "t.mcap"
    assert run_task(project / "tasks" / "t.yaml", log=log).verdict.verdict == "passed"
    assert not open_playback(log).notes
    verification = verify_log(log)
    assert not verification.entries
    recording = open_recording(log)
    assert recording.metadata["inertials"]["tip"].startswith("estimated: 0.167 kg")
    assert str(project.parent).encode() not in log.read_bytes()


def test_a_folder_that_is_no_package_is_read_only_where_that_is_allowed(project: Path) -> None:
    """A robot file or a log of unknown origin names a folder outside of its project."""
    log, task = project / "runs" / "t.mcap", project / "tasks" / "t.yaml"
    robot = project / "robots" / "robot.yaml"
    (project.parent / "elsewhere" / "deep" / "arm" / "package.xml").unlink()
    with pytest.raises(InvalidInput) as refused:
        run_task(task, log=log)
    (finding,) = [finding for finding in refused.value.findings if finding.code == "ROBOT370"]
    assert "--allow-outside" in (finding.hint or "")
    assert finding.place is not None
    assert (Path(finding.place.file).name, finding.place.line, finding.place.column) == ("robot.yaml", 3, 21)
    assert run_task(task, log=log, allow_outside=True).verdict.verdict == "passed"
    assert open_playback(log).notes
    assert not open_playback(log, allow_outside=True).notes
    hidden = project / "robots" / ".own"
    (project.parent / "elsewhere" / "deep" / "arm").rename(hidden)
    robot.write_text(robot.read_text().replace("../../elsewhere/deep/arm", ".own"))
    with pytest.raises(InvalidInput):
        run_task(task, log=log, force=True)
