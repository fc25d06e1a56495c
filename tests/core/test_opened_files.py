"""What a call has read, and whether it is still the same."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import os, sys
from pathlib import Path
from manipcli.core.opened_files import opened_by
folder = Path(sys.argv[1])
def read():
    (folder / "a").read_text()
    os.close(os.open(folder / "b", os.O_RDONLY))
    try:
        open(folder / "c")
    except FileNotFoundError:
        return "read"
(folder / "a").write_text("1"); (folder / "b").write_text("1"); (folder / "d").write_text("1")
os.chdir(folder)
result, files = opened_by(read)
(folder / "d").write_text("other"); (folder / "d").read_text()
assert (result, {path.name for path, _ in files.stamps}, files.unchanged()) == ("read", {"a", "b", "c"}, True)
for name, change in (("a", "longer"), ("c", "new"), ("b", None)):
    _, files = opened_by(read)
    assert files.unchanged()
    (folder / name).write_text(change) if change is not None else (folder / name).unlink()
    assert not files.unchanged(), name
sys.path.insert(0, str(folder))
sys.dont_write_bytecode = False
for name, prefix, bytecode in (("module", None, folder / "__pycache__"), ("other", str(folder / "x"), folder / "x")):
    sys.pycache_prefix = prefix
    (folder / f"{name}.py").write_text("")
    _, files = opened_by(lambda: __import__(name))
    assert files.unchanged() and list(bytecode.rglob(f"{name}*")), "its first import compiles it"
print("well")
"""
"""In its own process: an audit hook stays until the end of its process."""


def test_a_change_of_any_opened_file_is_found_and_of_no_other(tmp_path: str) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.stdout == "well\n", done.stderr
