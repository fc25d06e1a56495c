"""The Python API: what `import manipcli` offers, and what it costs."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import manipcli

ROOT = Path(__file__).parents[1]


def _python(script: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_importing_the_package_imports_nothing_of_it_but_what_makes_that_so() -> None:
    ours = "print(*(name for name in sys.modules if name.startswith('manipcli')))"
    assert {*_python(f"import sys, manipcli; {ours}")} == {
        "manipcli", "manipcli.core", "manipcli.core.lazy", "manipcli.core.version",
    }  # fmt: skip
    loaded = set(_python("import sys; before = set(sys.modules); import manipcli; print(*set(sys.modules) - before)"))
    assert {name.split(".")[0] for name in loaded} <= {"manipcli", *sys.stdlib_module_names}


@pytest.mark.parametrize("name", manipcli.__all__)
def test_every_public_name_is_there_and_documented(name: str) -> None:
    assert inspect.getdoc(getattr(manipcli, name))
    assert name in dir(manipcli)


def test_what_types_are_checked_by_is_what_is_there() -> None:
    """The imports under TYPE_CHECKING name every public name, in the module that it comes from."""
    tree = ast.parse(Path(manipcli.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    seen = {alias.name: f"{node.module}" for node in imports for alias in node.names}
    assert seen == {name: f"manipcli.{home}" for name, home in manipcli._HOMES.items()}
    assert sorted(seen) == manipcli.__all__


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'manipcli' has no attribute 'run_tusk'"):
        _ = manipcli.run_tusk


def test_a_name_can_be_imported_from_the_package() -> None:
    assert _python("from manipcli import InvalidInput; print(InvalidInput.code)") == ["USE000"]
