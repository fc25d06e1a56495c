"""A file given in the place of another kind is called what it is, in one finding, instead of by all that it lacks."""

from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "robots" / "panda" / "robot.yaml"
CONTROLLERS = ROOT / "controllers" / "panda.yaml"
TASK = ROOT / "tasks" / "pick_place.yaml"
URDF = ROOT / "examples" / "04_own_robot" / "reacher.urdf"


def refused(path: Path) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as caught:
        load_task(path)
    return caught.value.findings


@pytest.mark.parametrize(
    ("robot", "controllers", "told"),
    [
        (CONTROLLERS, CONTROLLERS, "expected a robot file, not a controllers file"),
        (TASK, CONTROLLERS, "expected a robot file, not a task file"),
        (URDF, CONTROLLERS, "expected a robot file, not a robot description"),
        (ROBOT, ROBOT, "expected a controllers file, not a robot file"),
        (ROBOT, TASK, "expected a controllers file, not a task file"),
    ],
)
def test_a_file_named_in_the_place_of_another(tmp_path: Path, robot: Path, controllers: Path, told: str) -> None:
    task = tmp_path / "task.yaml"
    task.write_text(f"task: mixed\nrobot: {robot}\ncontrollers: {controllers}\nsteps:\n  - wait: 1 s\n")
    (finding,) = refused(task)
    assert (finding.code, finding.message) == ("USE105", told)
    assert finding.place is not None
    assert finding.place.file == str(robot if robot != ROBOT else controllers)


@pytest.mark.parametrize(
    ("path", "kind"), [(ROBOT, "robot file"), (CONTROLLERS, "controllers file"), (URDF, "robot description")]
)
def test_a_file_run_as_a_task(path: Path, kind: str) -> None:
    (finding,) = refused(path)
    assert finding.message == f"expected a task file, not a {kind}"


def test_a_task_that_lacks_its_name_and_steps_is_told_what_it_lacks(tmp_path: Path) -> None:
    task = tmp_path / "task.yaml"
    task.write_text(f"robot: {ROBOT}\ndescription: none\ncontrollers: {CONTROLLERS}\n")
    assert {finding.message for finding in refused(task)} >= {"the key 'task' is missing", "the key 'steps' is missing"}
