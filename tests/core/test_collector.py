"""The garbage collector is spared in processes of commands, and left alone in those of others."""

from __future__ import annotations

import gc
import subprocess
import sys

from manipcli.cli.app import main

AT_THE_END = """
import atexit, gc, sys
atexit.register(lambda: print(gc.get_freeze_count() > 0, gc.get_threshold()[0] > 10_000))
from manipcli.cli.app import main
sys.argv[1:] = ["--version"]
main()
"""


def test_a_command_ends_without_looking_through_all_that_it_imported() -> None:
    done = subprocess.run([sys.executable, "-c", AT_THE_END], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-2:] == ["True", "True"]


def test_a_program_that_calls_the_command_line_keeps_its_collector() -> None:
    before = gc.get_threshold()
    assert main(["--version"]) == 0
    assert gc.get_threshold() == before
