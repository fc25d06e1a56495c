"""Arms that cannot yield or feel are refused before anything runs, with what to add."""

from pathlib import Path

import pytest
import yaml

from manipcli.core.errors import InvalidInput
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]


def written(folder, *, interface, engine="mujoco", sensors=None):
    """The task of a press with an arm that takes `interface`."""
    controllers = yaml.safe_load((ROOT / "controllers" / "panda.yaml").read_text())
    arm = controllers["controllers"]["arm_controller"]
    arm["command_interface"] = interface
    arm.pop("inverse_dynamics")
    arm.pop("constraints")
    if interface == "position":
        arm.pop("gains")
    (folder / "controllers.yaml").write_text(yaml.safe_dump(controllers))
    task = yaml.safe_load((ROOT / "tasks" / "press.yaml").read_text())
    task |= {"controllers": "controllers.yaml", "robot": str(ROOT / "robots" / "panda" / "robot.yaml")}
    task |= {"simulation": {"engine": engine}} | ({} if sensors is None else {"sensors": sensors})
    (folder / "task.yaml").write_text(yaml.safe_dump(task))
    return folder / "task.yaml"


WRIST = {"wrist": {"type": "force_torque", "link": "panda_hand"}}


@pytest.mark.parametrize(
    ("more", "code", "hint"),
    [
        ({"interface": "position"}, "TASK341", "link: panda_link7"),
        ({"interface": "position", "sensors": {"low": {"type": "force_torque", "link": "panda_link3"}}}, "TASK341", ""),
        ({"interface": "velocity"}, "TASK340", "command_interface: effort"),
        ({"interface": "effort", "sensors": {"felt_force": WRIST["wrist"]}}, "TASK343", "rename the sensor"),
    ],
)
def test_an_arm_that_cannot_feel_or_yield_is_refused(tmp_path, more, code, hint):
    with pytest.raises(InvalidInput) as refusal:
        load_task(written(tmp_path, **more), allow_outside=True)
    (finding,) = [each for each in refusal.value.findings if each.code.startswith("TASK34")]
    assert finding.code == code
    assert finding.place is not None
    assert hint in (finding.hint or "")


def test_arms_that_feel_and_yield_pass_and_rigid_drives_are_warned_of(tmp_path):
    def codes(**more):
        found = load_task(written(tmp_path, **more), allow_outside=True).findings
        return [each.code for each in found if each.code.startswith("TASK34")]

    assert codes(interface="effort") == []
    assert codes(interface="position", sensors=WRIST) == []
    assert codes(interface="position", sensors=WRIST, engine="pybullet") == ["TASK342"]
    assert codes(interface="position", engine="kinematic") == []
