"""What holds for the project as a whole: layers, sizes, lazy imports, and commands that the README promises."""

from __future__ import annotations

import importlib
import itertools
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "manipcli"
MODULES = sorted(PACKAGE.rglob("*.py"))
HEAVY = {
    "coal", "lxml", "matplotlib", "mcap", "mujoco", "numpy", "pinocchio", "pybullet", "pydantic", "rich", "ruckig",
    "scipy", "toppra", "viser", "xacro", "yaml",
}  # fmt: skip


def _name(module: Path) -> str:
    return ".".join(module.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _loaded(statement: str) -> set[str]:
    """Top-level packages in the interpreter after one statement."""
    script = f"import sys; {statement}; print(*sys.modules)"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=environment)
    return {name.split(".")[0] for name in done.stdout.split()}


def test_no_module_does_more_than_one_thing() -> None:
    long = {_name(module): lines for module in MODULES if (lines := len(module.read_text().splitlines())) > 400}
    assert long == {}


def test_every_module_says_what_it_is_for() -> None:
    silent = [_name(module) for module in MODULES if (text := module.read_text()) and not text.startswith('"""')]
    assert silent == []


def test_there_is_no_drawer_for_the_rest() -> None:
    assert {module.stem for module in MODULES} & {"utils", "helpers", "common", "misc"} == set()


@pytest.mark.parametrize("module", [module for module in MODULES if "__all__" in module.read_text()], ids=_name)
def test_public_names_exist(module: Path) -> None:
    imported = importlib.import_module(_name(module))
    assert [name for name in imported.__all__ if not hasattr(imported, name)] == []


def test_nothing_is_left_undone_and_no_path_of_one_machine_is_named() -> None:
    # Put together here, so that this file does not hold them.
    forbidden = ("TO" + "DO", "FIX" + "ME", "XX" + "X", "NotImplemented" + "Error", "/" + "work/", "../" + "shared")
    pattern = re.compile("|".join(map(re.escape, forbidden)))
    kinds = {".py", ".md", ".yaml", ".toml", ".xacro", ".urdf", ".sh"}
    folders = ("manipcli", "tests", "tasks", "robots", "controllers", "examples", "benchmarks", ".ci")
    files = [path for folder in folders for path in sorted((ROOT / folder).rglob("*")) if path.suffix in kinds]
    files += [ROOT / ".ci" / "run", *sorted(ROOT.glob("*.md")), ROOT / "pyproject.toml"]
    found = [
        f"{path.relative_to(ROOT)}:{number}: {match.group()}"
        for path in files
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if (match := pattern.search(line))
    ]
    assert found == []


def test_help_loads_nothing_heavy() -> None:
    assert _loaded("import manipcli.cli.app") & HEAVY == set()


@pytest.mark.slow
def test_the_registry_of_engines_loads_no_physics() -> None:
    assert _loaded("import manipcli.simulate.engines") & {"mujoco", "pybullet"} == set()


@pytest.mark.slow
def test_reading_a_file_loads_no_arrays_and_no_physics() -> None:
    names = [_name(module) for module in MODULES if module.parent == PACKAGE / "spec"]
    assert _loaded(f"import {', '.join(names)}") & (HEAVY - {"pydantic", "yaml", "rich"}) == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layer", "line"),
    [
        ("core", "from manipcli.spec import base"),
        ("plan", "from manipcli.simulate import engine"),
        ("record", "from manipcli.simulate import engine"),
        ("report", "import manipcli.cli.app"),
        ("cli", "from manipcli.plan import step"),
    ],
)
def test_a_forbidden_import_fails_the_lint(tmp_path: Path, layer: str, line: str) -> None:
    shutil.copytree(PACKAGE, tmp_path / "manipcli", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (tmp_path / "manipcli" / layer / "poison.py").write_text(f'"""Forbidden."""\n\n{line}\n')
    broken = _lint(tmp_path)
    assert broken.returncode == 1, broken.stdout + broken.stderr
    assert f"manipcli.{layer}.poison" in broken.stdout


def test_imports_point_up() -> None:
    kept = _lint(ROOT)
    assert kept.returncode == 0, kept.stdout + kept.stderr


def _lint(folder: Path) -> subprocess.CompletedProcess[str]:
    """The layers contract, checked in `folder`: its own package comes first on the path."""
    script = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    environment = {**os.environ, "PYTHONPATH": str(folder), "NO_COLOR": "1"}
    return subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=False, env=environment
    )


def test_the_map_shows_every_package_in_the_order_of_the_layers() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["id"] == "layers")
    groups = [{name.strip(" ()") for name in layer.split("|")} for layer in reversed(layers)]
    table = (ROOT / "ARCHITECTURE.md").read_text().partition("| package | holds |")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| `(\w+)` \|", table, flags=re.MULTILINE)
    remaining = iter(rows)
    assert [set(itertools.islice(remaining, len(group))) for group in groups] == groups
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert sorted(rows) == sorted({*folders, "pipeline"})


@pytest.mark.parametrize("page", ["ARCHITECTURE.md", "CONTRIBUTING.md"])
def test_every_path_that_a_page_names_exists(page: str) -> None:
    named = [*_named_paths((ROOT / page).read_text())]
    assert named
    assert [path for path in named if not _exists(path)] == []


def _named_paths(text: str) -> Iterator[str]:
    """Targets of links, and words in backticks and code blocks that have a slash or the suffix of a file."""
    yield from re.findall(r"\]\((?!https?:)([^)#]+)", text)
    code = re.findall(r"```\w*\n(.*?)```", text, flags=re.DOTALL)
    for part in [*code, *re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))]:
        for word in part.split():
            is_path = re.fullmatch(r"\.?\w[\w.-]*(/[\w.-]+)+/?|\w+/|\w+\.(py|md|toml)", word)
            # ROS types (`geometry_msgs/WrenchStamped`) look like paths; results, sites and environments are not kept.
            if is_path and not word.startswith((".venv/", "runs/", "build/")) and "_msgs/" not in word:
                yield word


def _exists(path: str) -> bool:
    places = (ROOT / path, PACKAGE / path)
    return any(place.exists() for place in places) or ("/" not in path and any(PACKAGE.rglob(path)))


def test_the_readme_begins_with_two_commands_that_stand_alone() -> None:
    commands = re.findall(r"^python3 -m venv .*$", (ROOT / "README.md").read_text(), flags=re.MULTILINE)
    assert len(commands) == 2
    assert commands[0].endswith("manipcli run tasks/pour.yaml")
    assert commands[1].endswith("python -m pytest -n auto")
    assert all("pip install -e " in command for command in commands)


def test_the_readme_is_short_and_shows_the_task_as_it_is() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    (shown,) = re.findall(r"^```yaml\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    task = (ROOT / "tasks" / "pour.yaml").read_text(encoding="utf-8").splitlines(keepends=True)
    assert shown == "".join(line for line in task if not line.startswith("#"))


@pytest.mark.slow
def test_the_readme_shows_what_its_first_command_prints(pour_run: Any, call_cli: Any) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```text\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    printed = call_cli("judge", pour_run.log, cwd=ROOT).out
    # Numbers may differ between machines, and only `run` has the wall time.
    words = [re.findall(r"[A-Za-z_]{3,}", part[: part.index("s simulated")]) for part in (shown, printed)]
    assert words[0] == words[1]
