"""Names of packages that are imported when they are first used."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

import manipcli


def test_every_public_name_is_there_and_no_other() -> None:
    for name in manipcli.__all__:
        assert getattr(manipcli, name).__name__ == name
    with pytest.raises(AttributeError, match=r"module 'manipcli.*' has no attribute 'nobody'"):
        getattr(manipcli, "nobody")  # noqa: B009  (mypy knows that it is not there)


def test_a_name_is_imported_when_it_is_used_and_kept() -> None:
    code = """
import json, sys
import manipcli
before = "manipcli.judge.verdict" in sys.modules
found = manipcli.Verdict
print(json.dumps([before, "manipcli.judge.verdict" in sys.modules, vars(manipcli)["Verdict"] is found]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == [False, True, True]
