"""`manipcli plot`: what it draws and writes, and what it says when it cannot."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from manipcli.cli.app import main
from manipcli.logs.plot import open_chart

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run without physics: half a second of a move and a wait."""
    folder = tmp_path_factory.mktemp("plot")
    path = folder / "home.mcap"
    words = ["run", str(ROOT / "tasks" / "home.yaml"), "--log", str(path), "--set", "simulation.engine=kinematic", "-q"]
    assert main(words) in (0, 1)
    return path


def test_an_overview_is_drawn_where_nothing_is_asked_for(log: Path) -> None:
    axes = [panel.axis for panel in open_chart([log], []).panels]
    assert axes[:3] == ["position [rad]", "velocity [rad/s]", "effort [N m]"]
    assert any(panel.title.endswith("error.positions") for panel in open_chart([log], []).panels)


def test_without_an_output_the_options_that_make_one_are_named(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(log)]) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert "error[USE065]: an output is missing" in told.err
    assert all(option in told.err for option in ("-o FILE.svg", "--csv -", "--fields"))


@pytest.mark.slow
def test_a_table_to_stdout_and_to_a_file_is_the_same(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["plot", str(log), "joint_states.position[joint_1,joint_4]", "--from", "0.1", "--to", "200 ms"]
    assert main([*words, "--csv", "-"]) == 0
    out = capsys.readouterr().out
    assert main([*words, "--csv", str(tmp_path / "a.csv")]) == 0
    assert (tmp_path / "a.csv").read_text() == out
    head, *rows = csv.reader(out.splitlines())
    assert head == ["time", "joint_states.position[joint_1]", "joint_states.position[joint_4]"]
    assert (float(rows[0][0]), float(rows[-1][0])) == (0.1, 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["svg", "png", "pdf", "PNG"])
def test_a_figure_goes_to_a_file(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    path.write_bytes(b"old")
    assert main(["plot", str(log), "joint_states.velocity", "-o", str(path)]) == 0
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", f"drawn: {path}\n")
    assert path.stat().st_size > 5000
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


@pytest.mark.slow
def test_a_log_whose_name_is_no_text_is_drawn(log: Path, tmp_path: Path) -> None:
    odd = tmp_path / "p\udcf6.mcap"
    odd.write_bytes(log.read_bytes())
    assert main(["plot", str(odd), "-o", str(tmp_path / "a.svg")]) == 0


def test_logs_over_each_other_and_a_partial_one(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cut = tmp_path / "other.mcap.partial"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size * 4 // 5])
    assert main(["plot", str(log), str(cut), "joint_states.position[joint_4]", "--csv", "-"]) == 0
    told = capsys.readouterr()
    assert "note: other: the file is not finished" in told.err
    assert {row.partition(",")[0] for row in told.out.splitlines()} == {"log", "home", "other"}
    (panel,) = open_chart([log, cut], ["joint_states.position[joint_4]"]).panels
    assert [one.end for one in panel.curves] == pytest.approx([one.times[-1] for one in panel.curves], abs=0.01)
    assert panel.curves[0].end > panel.curves[1].end


@pytest.mark.slow
def test_the_axes_of_a_vector_share_a_panel_and_words_with_commas_too(log: Path) -> None:
    def panels(*words: str) -> list[tuple[str, str, tuple[str, ...]]]:
        return [(one.title, one.axis, one.labels) for one in open_chart([log], words).panels]

    moves = open_chart([log], ["tf.translation.x"]).panels[0].labels[-1]
    assert panels(f"tf[{moves}].translation") == [
        ("tf.transform.translation", "translation [m]", (f"{moves} x", f"{moves} y", f"{moves} z"))
    ]
    assert panels(f"tf[{moves}].translation.z") == [("tf.transform.translation.z", "translation z [m]", (moves,))]
    words = "joint_states.position[joint_1],arm_controller/controller_state.reference.positions[joint_1]"
    ((title, _, labels),) = panels(words)
    assert title == ""
    assert [label.split()[0] for label in labels] == [word.partition("[")[0] for word in words.split(",")]


@pytest.mark.slow
def test_a_word_without_a_value_is_told(log: Path) -> None:
    chart = open_chart([log], ["joint_states.position[joint_1]", "contacts.force"])
    assert chart.notes == ("no value of contacts.force in this time range",)
    assert len(chart.panels) == 1


def test_what_there_is_to_plot_is_listed(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(log), "--fields"]) == 0
    out = capsys.readouterr().out
    fields = [line.split()[0] for line in out.splitlines()[1:]]
    assert "joint_states.position" in fields
    assert "tf.transform.translation.x" in fields
    assert main(["plot", str(log), "--fields", "--format", "json"]) == 0
    (listed,) = json.loads(capsys.readouterr().out)["logs"]
    assert [one["name"] for one in listed["fields"]] == fields
    assert main(["plot", str(log), "--format", "json"]) == 4
    assert json.loads(capsys.readouterr().out)["errors"][0]["code"] == "USE064"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["joint_state.position"], "PLOT002", "did you mean 'joint_states'?"),
        (["joint_states.positions"], "PLOT002", "did you mean 'position'?"),
        (["joint_states.position[jiont_1]"], "PLOT002", "did you mean 'joint_1'?"),
        (["task/events.kind"], "PLOT002", "no numeric fields in this message"),
        (["--from", "move_9"], "PLOT003", "is not a time or step"),
        (["--from", "2 m"], "PLOT003", "is not a time or step"),
        (["--from", "0.3", "--to", "0.2"], "PLOT003", "empty time range: --from 0.3 is not before --to 0.2"),
        (["joint_states.position", "--from", "500"], "PLOT004", "no value of joint_states.position in this time range"),
        (["--from", "500"], "PLOT004", "no value in this time range"),
        (["-o", "a.gif"], "USE061", ".svg, .png, .pdf"),
        (["-o", "/dev/null/a.svg"], "USE082", "--output '/dev/null/a.svg': cannot create folder '/dev/null'"),
        (["gone.mcap"], "LOG300", "No such file"),
        (["joint_states.position"] * 31, "PLOT005", "more than 400 curves"),
    ],
)
def test_what_cannot_be_plotted_is_refused(
    log: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    code: str,
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plot", str(log), *words, *([] if "-o" in words else ["--csv", "-"])]) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert f"error[{code}]" in told.err
    assert says in told.err
    assert list(tmp_path.iterdir()) == []


def test_a_joint_is_told_to_stand_in_brackets(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for given in ("joint_states.joint_4.position", "joint_states.joint_4"):
        assert main(["plot", str(log), given, "--csv", "-"]) == 4
        hint = "select an element with brackets: joint_states[joint_4].FIELD; fields: position, velocity, effort\n"
        assert hint in capsys.readouterr().err
    assert open_chart([log], ["joint_states[joint_4].position"]).panels[0].labels == ("joint_4",)
    assert main(["plot", str(log), "joint_states.positions", "--csv", "-"]) == 4
    assert "brackets" not in capsys.readouterr().err


def test_what_a_hint_says_of_a_body_can_be_plotted(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    moves = open_chart([log], ["tf.translation.x"]).panels[0].labels[-1]
    assert main(["plot", str(log), f"tf.{moves}.z", "--csv", "-"]) == 4
    hint = capsys.readouterr().err
    assert f"tf[{moves}].FIELD; fields: transform.translation.x, " in hint
    for field in hint.split("fields: ")[1].splitlines()[0].split(", "):
        assert open_chart([log], [f"tf[{moves}].{field.strip()}"]).panels[0].labels == (moves,)


def test_without_a_log_it_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", "joint_states.position"]) == 4
    assert "error[USE060]: LOG is missing" in capsys.readouterr().err
