"""Defaults of options from a file: the nearest one, the command line first, and nothing that lifts a protection."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pytest
import typer

from manipcli.cli import app
from manipcli.cli.option_defaults import defaults_of, options_of
from manipcli.core.errors import ExitCode, InvalidInput


def walk(
    *,
    steps: Annotated[int | None, typer.Option("--steps", metavar="N")] = None,
    jobs: Annotated[int | None, typer.Option("-n", metavar="N")] = None,
    names: Annotated[list[str] | None, typer.Option("--name")] = None,
    package_path: Annotated[list[Path] | None, typer.Option("--package-path")] = None,
    out: Annotated[Path | None, typer.Option("--out")] = None,
    force: Annotated[bool, typer.Option("--force")] = False,
    slow: Annotated[bool, typer.Option("--slow")] = False,
) -> None: ...


def run(*, out: Annotated[Path | None, typer.Option("--out")] = None) -> None: ...


COMMANDS = {"walk": walk, "run": run}


def values(folder: Path, command: str = "walk") -> dict[str, object]:
    return dict(defaults_of(command, COMMANDS, folder=folder).values)


def refusal(folder: Path) -> list[str]:
    with pytest.raises(InvalidInput) as raised:
        defaults_of("walk", COMMANDS, folder=folder)
    return [
        f"{each.place.line}:{each.place.column} {each.message}"
        for each in raised.value.findings
        if each.place is not None
    ]


def test_options_are_read_from_the_signature() -> None:
    found = options_of(walk)
    assert set(found) == {"steps", "n", "name", "package-path", "out", "force", "slow"}
    assert {name for name, option in found.items() if option.path} == {"package-path", "out"}
    assert {name for name, option in found.items() if option.repeatable} == {"name", "package-path"}
    assert {name for name, option in found.items() if option.flag} == {"force", "slow"}


def test_a_sub_command_has_a_section_of_its_own(tmp_path: Path) -> None:
    commands = {"go walk": walk, "go run": run, "run": run}

    def told(text: str) -> tuple[object, ...]:
        (tmp_path / "manipcli.toml").write_text(text)
        found = defaults_of("go walk", commands, folder=tmp_path)
        return dict(found.values), *found.told

    place = tmp_path / "manipcli.toml"
    assert told("[go.walk]\nsteps = 3\n[go.run]\n") == ({"steps": "3"}, f"--steps 3 ({place}:2)")
    assert told("steps = 4\n[run]\n") == ({"steps": "4"}, f"--steps 4 ({place}:1)")
    for wrong in ("[go]\nsteps = 3\n", "[go.walks]\nsteps = 3\n", "[go.walk]\nsteps = 3\n[go.rum]\n"):
        with pytest.raises(InvalidInput, match="no option or command 'go'"):
            told(wrong)
    with pytest.raises(InvalidInput, match=r"3:1.*`manipcli go walk` has no option --stepps"):
        told("\n[go.walk]\nstepps = 3\n")


def test_a_section_counts_before_the_whole_file(tmp_path: Path) -> None:
    (tmp_path / "manipcli.toml").write_text('name = ["a"]\nsteps = 2\n[walk]\nsteps = 3\nn = 4\nslow = true\n')
    assert values(tmp_path) == {"names": ["a"], "steps": "3", "jobs": "4", "slow": True}
    assert values(tmp_path, "run") == {}


def test_the_nearest_file_counts_and_paths_belong_to_its_folder(tmp_path: Path) -> None:
    below = tmp_path / "a" / "b"
    below.mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text('[tool.manipcli]\nout = "x"\npackage-path = ["p"]\n')
    assert values(below) == {"out": str(tmp_path / "x"), "package_path": [str(tmp_path / "p")]}
    (tmp_path / "a" / "pyproject.toml").write_text("[tool.other]\n")  # without our table
    assert values(below)["out"] == str(tmp_path / "x")
    (tmp_path / "a" / "manipcli.toml").write_text('[walk]\nout = "y"\n')
    assert values(below) == {"out": str(tmp_path / "a" / "y")}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("steps = 1\n[walk]\n  stps = 2\n", ["3:3 `manipcli walk` has no option --stps"]),
        ("force = true\n", ["1:1 --force cannot be set here: it lifts a protection"]),
        ("[walk]\nforce = true\n", ["2:1 --force cannot be set here: it lifts a protection"]),
        ('[run]\nout = "../../x"\n', ["2:1 '../../x' is not below '{folder}'"]),
        ('out = "/etc/passwd"\n', ["1:1 '/etc/passwd' is not below '{folder}'"]),
        ("steps = [1, 2]\n", ["1:1 --steps takes one value, not a list"]),
        ("slow = 1\n", ["1:1 --slow is true or false, not 1"]),
        ("steps = true\n", ["1:1 --steps is not a flag, not True"]),
        ("steps = 1\nsteps = 2\n", ["2:10 not TOML: Cannot overwrite a value"]),
        ("[dance]\nsteps = 2\n", ["1:2 there is no option or command 'dance'"]),
        ("wlk = 1\nslw = 2\n", ["1:1 there is no option or command 'wlk'", "2:1 there is no option or command 'slw'"]),
    ],
)
def test_errors_name_the_place(tmp_path: Path, text: str, expected: list[str]) -> None:
    (tmp_path / "manipcli.toml").write_text(text)
    found = refusal(tmp_path)
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        assert one.startswith(other.format(folder=tmp_path)), one


def test_a_link_does_not_lead_out(tmp_path: Path) -> None:
    folder = tmp_path / "inside"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    (folder / "manipcli.toml").write_text('out = "link/x"\n')
    assert "is not below" in refusal(folder)[0]


def test_a_default_applies_and_the_command_line_counts_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "manipcli.toml").write_text('[list]\nformat = "json"\n')
    assert app.main(["list", "steps"]) == ExitCode.PASSED
    assert capsys.readouterr().out.startswith("{")
    assert app.main(["list", "steps", "--format", "text", "-v"]) == ExitCode.PASSED
    captured = capsys.readouterr()
    assert not captured.out.startswith("{")
    assert captured.err == f"default: --format json ({tmp_path / 'manipcli.toml'}:2)\n"


def test_a_bad_default_is_told_with_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "manipcli.toml").write_text('[list]\nformat = "xml"\n')
    assert app.main(["list", "steps"]) == ExitCode.USAGE
    assert f"hint: it is a default: --format xml ({tmp_path / 'manipcli.toml'}:2)" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text", ['[check-urdf]\nallow-env = ["HOME"]\n', 'allow-env = ["HOME"]\n', "[run]\nforce = true\n"]
)
def test_a_file_that_comes_with_a_task_opens_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    """Not even the environment of the person who checks somebody's description."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.urdf.xacro").write_text('<robot name="$(env HOME)"><link name="a"/></robot>')
    (tmp_path / "manipcli.toml").write_text(text)
    assert app.main(["check-urdf", "a.urdf.xacro"]) == ExitCode.USAGE
    assert "cannot be set here: it lifts a protection" in capsys.readouterr().err


def test_the_table_of_a_project_in_the_own_file(tmp_path: Path) -> None:
    (tmp_path / "manipcli.toml").write_text("[tool.manipcli.walk]\nsteps = 3\n")
    with pytest.raises(InvalidInput) as raised:
        defaults_of("walk", COMMANDS, folder=tmp_path)
    (found,) = raised.value.findings
    assert found.hint == "in manipcli.toml write `[check]` instead of `[tool.manipcli.check]`"
