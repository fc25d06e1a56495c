"""Every robot.yaml of the repository names what its description has."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
import xacro
import yaml

ROBOTS = Path(__file__).parents[2] / "robots"
FILES = sorted(ROBOTS.glob("*/robot.yaml"))
ARMS = [path for path in FILES if "hand" in yaml.safe_load(path.read_text(encoding="utf-8"))["groups"]]


def description(folder: Path, uri: str) -> ElementTree.Element:
    if uri.startswith("package://pybullet_data/"):
        import pybullet_data

        path = Path(pybullet_data.getDataPath()) / uri.removeprefix("package://pybullet_data/")
    else:
        path = folder / uri
    if path.suffix == ".xacro":
        return ElementTree.fromstring(xacro.process_file(str(path)).toxml())
    return ElementTree.parse(path).getroot()


def trees(path: Path) -> tuple[dict[str, object], list[ElementTree.Element]]:
    spec = yaml.safe_load(path.read_text(encoding="utf-8"))
    uris = [spec["description"], *(part["description"] for part in spec.get("attach", []))]
    return spec, [description(path.parent, uri) for uri in uris]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_names_in_the_robot_file_are_in_its_description(path: Path) -> None:
    spec, roots = trees(path)
    links = {link.get("name") for root in roots for link in root.findall("link")}
    joints = {joint.get("name"): joint for root in roots for joint in root.findall("joint")}
    independent = {
        name
        for name, joint in joints.items()
        if joint.get("type") in {"revolute", "prismatic", "continuous"} and joint.find("mimic") is None
    }
    assert spec["robot"] == path.parent.name
    assert spec["tool"]["link"] in links  # type: ignore[index]
    assert set(spec["limits"]) == independent  # type: ignore[call-overload]
    for group in spec["groups"].values():  # type: ignore[attr-defined]
        assert set(group.get("joints", ())) <= independent
        assert {group.get("tip", spec["tool"]["link"]), *group.get("chain", {}).values()} <= links  # type: ignore[index]
    for part in spec.get("attach", []):  # type: ignore[attr-defined]
        assert part["parent"] in links


@pytest.mark.parametrize("path", ARMS, ids=lambda path: path.parent.name)
def test_every_arm_has_a_home_and_an_open_hand(path: Path) -> None:
    spec, _ = trees(path)
    poses = spec["poses"]
    assert len(poses["home"]["arm"]) == 7  # type: ignore[index]
    assert poses["home"]["hand"] == "open"  # type: ignore[index]
    assert len(poses["open"]["hand"]) == len(spec["groups"]["hand"]["joints"])  # type: ignore[index]


def test_the_iiwa_carries_the_hand_of_our_own_arm() -> None:
    spec, roots = trees(ROBOTS / "iiwa7" / "robot.yaml")
    assert [root.get("name") for root in roots] == ["lbr_iiwa", "hand3"]
    own, _ = trees(ROBOTS / "arm7_hand3" / "robot.yaml")
    assert spec["groups"]["hand"] == own["groups"]["hand"]  # type: ignore[index]
    assert {name: spec["poses"][name] for name in own["poses"]} == own["poses"]  # type: ignore[index,attr-defined]
