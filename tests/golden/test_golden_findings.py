"""What is found in descriptions that everybody has: a list for each, to be changed knowingly.

A line is the code, the severity and the first name that the message quotes. To write the lists anew, run this file.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from manipcli.description.lint.examine import examine
from manipcli.description.packages import Packages

HERE = Path(__file__).parent
DESCRIPTIONS = {"panda": "franka_panda/panda.urdf", "iiwa": "kuka_iiwa/model.urdf"}
ARM = HERE.parents[1] / "robots" / "arm7_hand3" / "urdf" / "arm7_hand3.urdf.xacro"


def found(path: Path) -> list[str]:
    lines = []
    for finding in examine(path, packages=Packages(path)).findings:
        name = re.search(r"'([^']*)'", finding.message)
        lines.append(f"{finding.code} {finding.severity} {name[1] if name else '-'}")
    return sorted(lines)


def of_pybullet(name: str) -> Path:
    import pybullet_data

    return Path(pybullet_data.getDataPath()) / DESCRIPTIONS[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_the_findings_of_a_known_description_are_those_of_its_list(name: str) -> None:
    expected = (HERE / f"{name}.findings").read_text(encoding="utf-8").splitlines()
    assert found(of_pybullet(name)) == expected


@pytest.mark.slow
def test_there_is_nothing_to_say_of_the_robot_of_this_project() -> None:
    assert found(ARM) == []


if __name__ == "__main__":
    for key in DESCRIPTIONS:
        (HERE / f"{key}.findings").write_text("\n".join(found(of_pybullet(key))) + "\n", encoding="utf-8")
