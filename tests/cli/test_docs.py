"""`manipcli docs`, and the addresses of pages that help and findings end with."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import COMMANDS, main
from manipcli.cli.command_help import page_of
from manipcli.report.doc_pages import URL, address, code_url, doc_pages, section_of

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "reference"
SITE = "https://docs.example/manipcli"


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main([*words]) == 0
    return capsys.readouterr().out


def test_a_page(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("task", "task.md"):
        assert printed(capsys, "docs", name) == (PAGES / "task.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["task#vary", "task.md#vary"])
def test_a_part_of_a_page_ends_at_the_next_heading_of_its_level(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(capsys, "docs", name)
    assert text.startswith("## vary\n")
    assert "\n## " not in text.removeprefix("## ")
    assert text in (PAGES / "task.md").read_text(encoding="utf-8")


def test_of_pages_with_one_name_that_of_the_reference_has_it() -> None:
    pages = doc_pages()
    assert pages["live"] == PAGES / "live.md"
    assert pages["how-to/live"] == ROOT / "docs" / "how-to" / "live.md"


def test_a_comment_in_code_is_no_heading() -> None:
    page = "# A\n\n```bash\n# B\n```\nend\n\n## C\n\n# B\n\nlast"
    assert section_of(page, "a") == "# A\n\n```bash\n# B\n```\nend\n\n## C"
    assert section_of(page, "b") == "# B\n\nlast"
    assert section_of(page, "d") is None


@pytest.mark.parametrize("words", [["run"], ["topic", "echo"]])
def test_the_section_of_a_command(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert f"\nmanipcli {' '.join(words)} [OPTIONS]" in printed(capsys, "docs", *words)


def test_all_pages_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    rows = {row.split(maxsplit=1)[0]: row.split(maxsplit=1)[1] for row in printed(capsys, "docs").splitlines()[1:]}
    assert rows.keys() == doc_pages().keys()
    assert rows["task"] == "The task file"
    assert {path.stem for path in PAGES.glob("*.md")} - {"README"} <= rows.keys() | {"README"}


@pytest.mark.parametrize(
    ("words", "message", "hint"),
    [
        (("tsak",), "there is no page 'tsak'", "did you mean 'task'?"),
        (("plto",), "there is no page 'plto'", "did you mean 'plot'?"),
        (("TASK203",), "there is no page 'TASK203'", "run `manipcli explain TASK203`"),
        (("task203",), "there is no page 'task203'", "run `manipcli explain TASK203`"),
        (("ZZZ",), "there is no page 'ZZZ'", "hint: pages: "),
        (("",), "there is no page ''", "hint: pages: "),
        (("task#varry",), "page 'task' has no heading '#varry'", "did you mean 'vary'?"),
    ],
)
def test_an_unknown_page(words: tuple[str, ...], message: str, hint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["docs", *words]) == 4
    told = capsys.readouterr()
    assert (message in told.err, hint in told.err, told.out) == (True, True, "")


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_names_a_page_that_there_is(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    end = printed(capsys, *command.split(), "--help").splitlines()[-1].strip()
    assert end == f"Docs: manipcli docs {command}"
    assert printed(capsys, *end.removeprefix("Docs: manipcli ").split()).startswith("#")
    monkeypatch.setenv(URL, f"{SITE}/")
    page, _, anchor = page_of(command).partition("#")
    url = f"{SITE}/reference/{page}.html{f'#{anchor}' if anchor else ''}"
    assert printed(capsys, *command.split(), "--help").splitlines()[-1].strip() == f"Docs: {url}"


def test_findings_end_with_where_a_code_is_explained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    task = tmp_path / "task.yaml"
    task.write_text("task: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps:\n  - lfit: {object: cup}\n  - wit: 1 s\n")
    assert main(["check", str(task)]) == 1
    *_, line, summary = capsys.readouterr().out.splitlines()
    assert "failed: 1 file checked" in summary
    assert line == "more about a code: manipcli explain TASK231"
    assert main(["run", str(task)]) == 4
    told = capsys.readouterr().err
    assert told.splitlines()[-1] == line and told.count("more about") == 1
    monkeypatch.setenv(URL, SITE)
    assert main(["check", str(task)]) == 1
    assert f"more about a code: {SITE}/reference/codes/TASK231.html\n" in capsys.readouterr().out
    assert main(["check", str(task), "--format", "json"]) == 1
    assert SITE not in capsys.readouterr().out


@pytest.mark.parametrize("value", [" ", "/", "site", "javascript:alert(1)", "https://a b", "https://a\nb", "https://"])
def test_a_value_that_is_no_address_has_no_effect(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(URL, value)
    assert (code_url("TASK231"), address("task#vary")) == (None, "manipcli docs task#vary")


def test_wrong_usage_has_no_such_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "--sed", "7"]) == 4
    assert "more about" not in capsys.readouterr().err


def test_sarif_has_the_addresses_of_a_site_only(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["check-urdf", str(ROOT / "examples" / "04_own_robot" / "reacher.urdf"), "--format", "sarif"]

    def rules() -> list[dict[str, object]]:
        main(words)
        found: list[dict[str, object]] = json.loads(capsys.readouterr().out)["runs"][0]["tool"]["driver"]["rules"]
        return found

    assert not any("helpUri" in rule for rule in rules())
    monkeypatch.setenv(URL, SITE)
    assert all(rule["helpUri"] == f"{SITE}/reference/codes/{rule['id']}.html" for rule in rules())
