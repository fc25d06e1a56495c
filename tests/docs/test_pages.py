"""Every command of every page runs with the shown output, or is at least one that the command line accepts."""

from __future__ import annotations

import functools
import importlib.util
import re
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

from manipcli.cli import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
OPERATORS = set("();<>|&")


def _console() -> ModuleType:
    spec = importlib.util.spec_from_file_location("console", ROOT / "docs" / "scripts" / "console.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["console"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


console = _console()


def _name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def _runnable() -> list[Path]:
    """The last pages of all chains: each is run with the pages before it."""
    runs = [
        page for page in PAGES if any(fence.language == "console" for fence in console.fences(page.read_text("utf-8")))
    ]
    earlier = {other for page in runs for other in console.before(page)[:-1]}
    return [page for page in runs if page not in earlier]


@pytest.mark.slow
@pytest.mark.pages
@pytest.mark.parametrize("page", _runnable(), ids=_name)
def test_the_commands_of_a_page_print_what_it_shows(page: Path) -> None:
    """Measured numbers within a share: another processor rounds differently, and contact amplifies it."""
    ran = console.run(page)
    told = f"run `python docs/scripts/console.py --write {_name(page)}` and review the difference"
    found = [
        text for each, commands in ran.items() for text in console.differences(each, commands, share=console.ELSEWHERE)
    ]
    assert found == [], "\n\n".join([told, *found])


def called(script: str) -> Iterator[list[str]]:
    """The words after `manipcli` of each of its calls in a shell script; variables are taken as 1."""
    script = re.sub(r"<<-?\s*'?(\w+)'?([^\n]*)\n.*?\n\s*\1\b", r"\2", script.replace("\\\n", " "), flags=re.DOTALL)
    part: list[str] = []
    for word in _words(script):
        if set(word) - OPERATORS:
            part.append(word)
            continue
        names = [Path(each).name for each in part]
        if "manipcli" in names[:-1] and "install" not in names:
            yield [re.sub(r"\$(\w+|\{.*?\})", "1", each) for each in part[names.index("manipcli") + 1 :]]
        part = []


def _words(script: str) -> Iterator[str]:
    """The words and operators of a script; the end of a line is a `;`."""
    held = ""
    for line in script.splitlines():
        lexer = shlex.shlex(held + line, posix=True, punctuation_chars=True)
        lexer.whitespace_split = True
        try:
            yield from [*lexer, ";"]
            held = ""
        except ValueError:  # a quotation that goes on in the next line
            held = f"{held}{line}\n"


def _commands() -> list[tuple[str, list[str]]]:
    return [
        (f"{_name(page)}:{fence.first}", words)
        for page in PAGES
        if "codes" not in page.parts  # these have bad commands on purpose
        for fence in console.fences(page.read_text("utf-8"))
        if fence.language in ("bash", "sh") and fence.title is None
        for words in called("\n".join(fence.lines))
    ]


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Callable[..., str]:
    """What the command line says against the words of a command; commands that it accepts do nothing."""

    def idle(function: Callable[..., object]) -> Callable[..., object]:
        return functools.wraps(function)(lambda *_, **__: None)

    monkeypatch.setattr(app, "COMMANDS", {name: idle(function) for name, function in app.COMMANDS.items()})
    monkeypatch.chdir(tmp_path)

    def check(*words: str) -> str:
        capsys.readouterr()
        code = app.main(words)
        return "" if code == 0 else capsys.readouterr().err

    return check


def test_commands_that_do_not_run_are_accepted_by_the_command_line(refused: Callable[..., str]) -> None:
    commands = _commands()
    assert commands
    assert {
        f"{place}: manipcli {shlex.join(words)}": said for place, words in commands if (said := refused(*words))
    } == {}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "task.yaml", "--sett", "a=1"], "No such option"),
        (["rum", "task.yaml"], "No such command"),
        (["run"], "Missing argument"),
        (["topic", "echoo", "/a"], "No such command"),
        (["replay", "a.mcap", "--port", "many"], "whole number"),
        (["run", "task.yaml", "--set", "a=1"], ""),
        (["topic", "echo", "/joint_states", "--once"], ""),
    ],
)
def test_a_command_that_the_command_line_refuses_is_found(
    words: list[str], said: str, refused: Callable[..., str]
) -> None:
    assert (said in refused(*words)) if said else (refused(*words) == "")


def test_the_calls_of_a_script() -> None:
    script = """cd manipcli && pip install manipcli  # manipcli run nothing
for n in 1 2; do srun .venv/bin/manipcli sweep t.yaml \\
    --samples $n > "a b.csv"; done
cat <<'EOF' > file
manipcli it's no command
EOF
git clone manipcli; manipcli run 'a b.yaml' | tee log; python -m manipcli list"""
    assert [*called(script)] == [["sweep", "t.yaml", "--samples", "1"], ["run", "a b.yaml"], ["list"]]
