"""What the robot file mends of a description, and what is told about it."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.onboard.first_task import FirstTask
from manipcli.onboard.source import read_source
from manipcli.onboard.summary import summary
from tests.onboard import small_robots as small

LINKS = [f"l{k}" for k in range(7)]


def mesh(kind: str, file: str) -> str:
    return f'<{kind}><geometry><mesh filename="{file}"/></geometry></{kind}>'


def test_links_whose_visual_meshes_lack_too_are_told(tmp_path: Path) -> None:
    box = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    rows = {
        "l1": mesh("collision", "only.stl") + box,
        "l2": mesh("collision", "both.stl") + mesh("visual", "both.stl") + box,
        "l3": mesh("collision", "both.stl") + mesh("visual", "both.stl"),
    }
    text = small.robot(small.arm(LINKS))
    for name, shapes in rows.items():
        before, after = text.split(f'<link name="{name}">')
        inertial, rest = after.split("<collision>", 1)
        text = f'{before}<link name="{name}">{inertial}{shapes}{rest.split("</collision>", 1)[1]}'
    (tmp_path / "small.urdf").write_text(text)
    source = read_source(str(tmp_path / "small.urdf"), {}, tmp_path, package_path=(), allow_outside=False)
    assert source.entries["collision"].value == {"l1": "from_visual", "l2": "from_visual", "l3": "none"}
    notes = "\n".join(source.notes)
    assert "2 of its collision meshes are not found or unusable: both.stl, only.stl; add them" in notes
    assert "1 link with a part of the shapes alone, as visual meshes are not found either: l2" in notes
    assert "1 link without any shape, which planning and physics do not see: l3" in notes


def test_the_same_evidence_is_told_once() -> None:
    task = FirstTask("wait", {}, {}, "the robot holds still", True, ())
    lines = list(summary(found=(), checks=[("a", "why"), ("b", ""), ("c", "other")], notes=(), task=task))
    assert "  a, b: why" in lines
    assert "  c: other" in lines


def test_a_link_denser_than_metal_is_estimated(tmp_path: Path) -> None:
    text = small.robot(small.arm(LINKS)).replace('<mass value="0.5"/>', '<mass value="5000"/>', 3)
    (tmp_path / "small.urdf").write_text(text)
    source = read_source(str(tmp_path / "small.urdf"), {}, tmp_path, package_path=(), allow_outside=False)
    rows = {name: {"density": 1000.0} for name in ("l1", "l2")}  # the base, 0.1 m wide, is as dense as this allows
    inertials = source.entries["inertials"]
    assert inertials.value["links"].keys() >= rows.keys()
    assert inertials.check and "denser than any metal" in inertials.why
    volume = (0.2 - 0.08) * 0.05 * 0.05
    assert source.robot.link("l2").inertial.mass == pytest.approx(1000.0 * volume, rel=0.01)
