"""What every preflight check promises, over the registry."""

from __future__ import annotations

import inspect
import re
import sys
from functools import cache
from pathlib import Path

import pytest

from manipcli.preflight import checks
from manipcli.preflight.checks import PREFLIGHT_CHECKS
from manipcli.preflight.preflight import Check, Subject
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

HOME = Path(__file__).parents[2] / "tasks" / "home.yaml"
FILES = sorted(path.stem for path in Path(checks.__file__).parent.glob("*.py") if path.stem != "__init__")
every_check = pytest.mark.parametrize("check", PREFLIGHT_CHECKS.members, ids=PREFLIGHT_CHECKS.names)


@cache
def sound() -> Subject:
    task = load_task(HOME)
    return Subject(task, plan_task(task))


def test_every_file_of_the_folder_is_one_check() -> None:
    assert sorted(PREFLIGHT_CHECKS.names) == FILES


@every_check
def test_it_says_what_it_looks_for_and_declares_its_codes(check: Check) -> None:
    module = sys.modules[check.findings.__module__]
    assert module.__name__.rpartition(".")[2] == check.name
    assert (module.__doc__ or "").strip().endswith(".")
    assert set(check.codes) == set(re.findall(r'"((?:CTRL|TASK)\d{3})"', inspect.getsource(module)))


@every_check
def test_it_knows_no_type_of_controller(check: Check) -> None:
    """It asks members of the seam, so that a new type is examined like the others."""
    source = inspect.getsource(sys.modules[check.findings.__module__])
    assert re.findall(r"control\.controllers\.\w+|\w+(?:Controller|Trajectory|Gripper|Torque)Spec", source) == []


@every_check
def test_it_is_silent_on_a_sound_task(check: Check) -> None:
    assert list(check.findings(sound())) == []


@pytest.mark.parametrize("check", [one for one in PREFLIGHT_CHECKS if not one.needs_plan], ids=lambda one: one.name)
def test_without_a_plan_it_examines_the_named_poses(check: Check) -> None:
    assert list(check.findings(Subject(load_task(HOME), None))) == []
