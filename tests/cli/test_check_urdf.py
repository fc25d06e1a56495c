"""`manipcli check-urdf`: exit codes, formats, choosing, mending, explaining."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import main
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.inspection import explained
from manipcli.report.description import render_explanation

ENDS = '<parent link="a"/><child link="b"/>'
LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'
SHAPE = '<geometry><box size="0.5 0.4 0.3"/></geometry>'
LINK_B = f'<link name="b">{INERTIAL}<visual>{SHAPE}</visual><collision>{SHAPE}</collision></link>'
GOOD = (
    f'<robot name="r">\n<link name="a"/>\n{LINK_B}\n'
    f'<joint name="j" type="revolute">{ENDS}<axis xyz="0 0 1"/>{LIMIT}</joint>\n</robot>\n'
)
LONG_AXIS = GOOD.replace('"0 0 1"', '"0 0 2"')
BAD = LONG_AXIS.replace('lower="-1"', 'lower="low"')
XACRO = (
    '<robot name="$(arg name)" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    '<xacro:arg name="name" default="x"/><link name="$(arg name)_base"/></robot>'
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in {"good.urdf": GOOD, "axis.urdf": LONG_AXIS, "bad.urdf": BAD, "arm.urdf.xacro": XACRO}.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folder")
class TestCheckUrdf:
    """In a folder with a good description, one with a warning, one with an error, and a xacro file."""

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("words", "code"),
        [
            (["good.urdf"], 0),
            (["axis.urdf"], 0),
            (["axis.urdf", "--strict"], 1),
            (["axis.urdf", "--strict", "--ignore", "URDF034"], 0),
            (["axis.urdf", "--strict", "--ignore", "URDF03"], 0),
            (["axis.urdf", "--strict", "--select", "schema,topology"], 0),
            (["bad.urdf"], 1),
            (["bad.urdf", "--ignore", "bad-number"], 0),
            (["bad.urdf", "--select", "physics"], 0),
            (["arm.urdf.xacro", "name:=arm"], 0),
            (["arm.urdf.xacro", "nam:=arm"], 1),
            (["good.urdf", "name:=arm"], 1),
            (["absent.urdf"], 4),
            ([], 4),
            (["good.urdf", "name=arm"], 4),
            (["good.urdf", "--select", "URDF999"], 4),
            (["good.urdf", "--in-place"], 4),
            (["arm.urdf.xacro", "--fix"], 4),
            (["--explain", "URDF081"], 0),
            (["--explain", "URDF999"], 4),
            (["."], 1),
        ],
    )
    def test_exit_codes(self, words: list[str], code: int, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["check-urdf", *words]) == code
        assert "Traceback" not in capsys.readouterr().err

    def test_what_cannot_be_read_cannot_be_ignored(self, folder: Path) -> None:
        (folder / "no.urdf").write_text("<robot>")
        assert main(["check-urdf", "no.urdf", "--ignore", "URDF", "--ignore", "XACRO"]) == 1

    def test_text_tells_finding_summary_tree_and_verdict(self, capsys: pytest.CaptureFixture[str]) -> None:
        main(["check-urdf", "bad.urdf", "--tree"])
        lines = capsys.readouterr().out.splitlines()
        assert any(line.startswith("bad.urdf:4:") and "error[URDF004]" in line for line in lines)
        assert "links:         2" in lines
        assert "└─ b  [j: revolute]" in lines
        assert lines[-1] == "✗ failed: bad.urdf: 1 error, 1 warning, 0 notes"

    def test_json_is_one_object_with_the_counts_of_a_refused_robot(self, capsys: pytest.CaptureFixture[str]) -> None:
        main(["check-urdf", "bad.urdf", "--format", "json"])
        answer = json.loads(capsys.readouterr().out)
        assert answer["verdict"] == "failed"
        assert {finding["code"] for finding in answer["findings"]} == {"URDF004", "URDF034"}
        summary = answer["summary"]
        assert (summary["links"], summary["joints"], summary["moving_joints"], summary["mass"]) == (2, 1, 1, 2.0)
        assert summary["groups"] == [{"kind": "chain", "joints": ["j"], "mimics": [], "base": "a", "tip": "b"}]

    def test_sarif_has_what_its_schema_requires(self, capsys: pytest.CaptureFixture[str]) -> None:
        main(["check-urdf", "bad.urdf", "--format", "sarif"])
        log = json.loads(capsys.readouterr().out)
        assert log["version"] == "2.1.0"
        (run,) = log["runs"]
        driver = run["tool"]["driver"]
        assert driver["name"] == "manipcli"
        assert [rule["id"] for rule in driver["rules"]] == [check.code for check in CHECKS]
        assert all(rule["shortDescription"]["text"] for rule in driver["rules"])
        assert {result["ruleId"] for result in run["results"]} == {"URDF004", "URDF034"}
        for result in run["results"]:
            assert driver["rules"][result["ruleIndex"]]["id"] == result["ruleId"]
            assert result["level"] in {"error", "warning", "note", "none"}
            assert result["message"]["text"]
            (location,) = result["locations"]
            physical = location["physicalLocation"]
            assert physical["artifactLocation"]["uri"] == "bad.urdf"
            assert physical["region"]["startLine"] == 4
            assert physical["region"]["startColumn"] >= 1

    def test_sarif_names_files_by_uris(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        (folder / "an arm é.urdf").write_text(BAD)
        main(["check-urdf", "an arm é.urdf", "--format", "sarif"])
        results = json.loads(capsys.readouterr().out)["runs"][0]["results"]
        location = results[0]["locations"][0]["physicalLocation"]["artifactLocation"]
        assert location["uri"] == "an%20arm%20%C3%A9.urdf"

    def test_fix_writes_beside_the_file_and_tells_what_is_left(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main(["check-urdf", "bad.urdf", "--fix"]) == 1
        told = capsys.readouterr()
        assert "written: bad.fixed.urdf" in told.err
        assert "URDF034" not in told.out
        assert (folder / "bad.urdf").read_text() == BAD
        assert (folder / "bad.fixed.urdf").read_text() == BAD.replace('"0 0 2"', '"0 0 1"')

    def test_fix_replaces_no_other_file_unless_told_to(self, folder: Path) -> None:
        other = folder / "bad.fixed.urdf"
        other.write_text("mine")
        assert main(["check-urdf", "bad.urdf", "--fix"]) == 4
        assert other.read_text() == "mine"
        assert main(["check-urdf", "bad.urdf", "--fix", "--force"]) == 1
        assert other.read_text() == BAD.replace('"0 0 2"', '"0 0 1"')
        assert main(["check-urdf", "bad.urdf", "--fix"]) == 1  # it is what would be written

    def test_an_absent_file_is_told_as_sarif_too(self, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["check-urdf", "absent.urdf", "--format", "sarif"]) == 4
        told = capsys.readouterr()
        (result,) = json.loads(told.out)["runs"][0]["results"]
        assert result["level"] == "error" and result["ruleId"].startswith("USE")
        assert told.err == ""

    def test_fix_in_place_replaces_the_file_and_good_files_stay(self, folder: Path) -> None:
        assert main(["check-urdf", "axis.urdf", "--fix", "--in-place", "--strict"]) == 0
        assert (folder / "axis.urdf").read_text() == GOOD
        assert main(["check-urdf", "good.urdf", "--fix"]) == 0
        assert not (folder / "good.fixed.urdf").exists()

    def test_the_environment_is_read_only_where_it_is_allowed(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.setenv("SIDE", "sinister")
        text = XACRO.replace("$(arg name)_base", "$(env SIDE)_$(optenv OTHER none)").replace('"$(arg name)"', '"r"')
        (folder / "e.xacro").write_text(text)
        assert main(["check-urdf", "e.xacro"]) == 1
        assert "sinister" not in capsys.readouterr().out
        assert main(["check-urdf", "e.xacro", "--allow-env", "SIDE", "--allow-env", "OTHER", "--tree"]) == 0
        assert "sinister_none" in capsys.readouterr().out

    def test_check_takes_descriptions_too(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["check", "good.urdf"]) == 0
        (folder / "good.urdf.xml").write_bytes((folder / "good.urdf").read_bytes())
        assert main(["check", "good.urdf.xml"]) == 0
        assert main(["check", "bad.urdf"]) == 1
        assert "URDF004" in capsys.readouterr().out

    def test_every_check_is_explained_and_listed(self, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["check-urdf", "--explain", "urdf081"]) == 0
        assert render_explanation(explained("loop")) in capsys.readouterr().out
        for check in CHECKS:
            assert check.summary in render_explanation(check)
        assert main(["list", "checks"]) == 0
        rows = capsys.readouterr().out.splitlines()
        assert [row.split()[0] for row in rows[1:]] == [check.code for check in CHECKS]
        assert all(" ".join(check.reason.split()) in row for check, row in zip(CHECKS, rows[1:], strict=True))


@pytest.mark.usefixtures("folder")
def test_a_description_may_be_named_by_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "places" / "arms").mkdir(parents=True)
    (tmp_path / "places" / "arms" / "good.urdf").write_text(GOOD)
    named = ["check-urdf", "package://arms/good.urdf"]
    assert main([*named, "--package-path", "places"]) == 0
    capsys.readouterr()
    assert main(named) == 4
    assert "package 'arms' is not found" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path / "places")
    assert main(named) == 0
    monkeypatch.chdir(tmp_path)
    capsys.readouterr()
    assert main(["check-urdf", "package://arms/god.urdf", "--package-path", "places"]) == 4
    told = capsys.readouterr().err
    assert "'package://arms/god.urdf' is not found" in told and "did you mean 'good.urdf'?" in told
