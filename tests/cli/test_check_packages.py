"""`check` finds files where `run` finds them."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.cli.app import main

LINK = (
    '<robot name="one"><link name="base"><inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link></robot>'
)
INCLUDING = (
    '<robot name="one" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    '<xacro:include filename="$(find parts)/one.xacro"/></robot>'
)


@pytest.mark.parametrize("name", ["robot.yaml", "one.urdf"])
def test_it_looks_for_packages_where_it_is_told(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere" / "parts").mkdir(parents=True)
    (tmp_path / "elsewhere" / "parts" / "one.xacro").write_text(LINK)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    Path("robot.yaml").write_text("robot: one\ndescription: package://parts/one.xacro\n")
    Path("one.urdf").write_text(INCLUDING)
    assert main(["check", name]) == 1
    assert "parts" in capsys.readouterr().out
    assert main(["check", name, "--package-path", str(tmp_path / "elsewhere")]) == 0
