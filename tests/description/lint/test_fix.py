"""What is mended means the same as before, or what it can only have meant; all the rest of the text stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.description.expanded import read_description
from manipcli.description.lint.fix import mended
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import read_parts

TEXT = """<?xml version="1.0"?>
<!-- é: a remark -->
<robot>\r
  <link name="a"/> <link name=' b '/>
  <joint name="j" type="continuous"><parent link="a"/><child link="b "/>
    <axis   xyz = '0  3 -4'/><origin
      rpy="0 0  1 "
      xyz="1 2 3"/></joint>
</robot>
"""


def mend(path: Path) -> tuple[str, list[str]]:
    data, changes = mended(path, read_description(path, packages=Packages(path)))
    return data.decode(), [change.attribute for change in changes]


@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["plain", "byte order mark"])
def test_only_what_is_mended_changes(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "my_arm.urdf"
    path.write_bytes((mark + TEXT).encode())
    text, attributes = mend(path)
    expected = TEXT.replace("<robot>", '<robot name="my_arm">').replace("' b '", "'b'").replace('"b "', '"b"')
    expected = expected.replace("0  3 -4", "0 0.6 -0.8").replace('"0 0  1 "', '"0 0 1"')
    assert text == mark + expected
    assert sorted(attributes) == ["link", "name", "name", "rpy", "xyz"]
    before = read_parts(read_description(path, packages=Packages(path)))
    path.write_bytes(text.encode())
    after = read_parts(read_description(path, packages=Packages(path)))
    assert after.findings == ()
    np.testing.assert_allclose(after.joints[0].axis, before.joints[0].axis, rtol=0, atol=1e-15)
    assert mend(path) == (text, [])


def test_a_mesh_named_by_an_absolute_path_is_named_by_its_package(tmp_path: Path) -> None:
    package = tmp_path / "arm"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    mesh = package / "meshes" / "a b.stl"
    mesh.write_bytes(b"")
    path = package / "r.urdf"
    for uri in (str(mesh), mesh.as_uri().replace("%20", " ")):
        shape = f'<visual><geometry><mesh filename="{uri}"/></geometry></visual>'
        path.write_text(f'<robot name="r"><link name="a">{shape}</link></robot>')
        text, _ = mend(path)
        assert 'filename="package://arm/meshes/a b.stl"' in text
    path.write_text(path.read_text().replace(str(mesh), "/nowhere/x.stl").replace("file://", ""))
    assert mend(path)[1] == []


def test_values_that_need_escapes_stay_what_they_are(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text('<robot name="r"><link name=" a&amp;&quot;&lt; "/></robot>')
    text, _ = mend(path)
    path.write_text(text)
    assert read_parts(read_description(path, packages=Packages(path))).root == 'a&"<'


def test_another_encoding_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_bytes('<?xml version="1.0" encoding="latin-1"?><robot><link name="\xe9"/></robot>'.encode("latin-1"))
    with pytest.raises(InvalidInput, match="not UTF-8"):
        mend(path)
