"""What a description names is found in the documented places, and nowhere else."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from manipcli.description.packages import NotFound, Packages


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """stack/{arm,hand}/{urdf,meshes}, and a file outside of both."""
    for name in ("arm", "hand"):
        for folder in ("urdf", "meshes"):
            (tmp_path / "stack" / name / folder).mkdir(parents=True)
        (tmp_path / "stack" / name / "meshes" / "a.stl").write_bytes(b"solid")
        (tmp_path / "stack" / name / "urdf" / f"{name}.urdf").write_text("<robot/>")
    (tmp_path / "secret.txt").write_text("secret")
    return tmp_path / "stack"


def test_a_package_is_the_folder_of_its_name_above_or_beside_the_file(tree: Path) -> None:
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")
    assert packages.root("arm") == tree / "arm"
    assert packages.root("hand") == tree / "hand"
    assert packages.resolve("package://hand/meshes/a.stl") == tree / "hand" / "meshes" / "a.stl"
    assert packages.resolve("model://arm/meshes/a.stl") == tree / "arm" / "meshes" / "a.stl"


def test_relative_and_file_uris_reach_the_description_s_own_tree(tree: Path) -> None:
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")
    mesh = tree / "arm" / "meshes" / "a.stl"
    assert packages.resolve("../meshes/a.stl") == mesh
    assert packages.resolve(f"file://{mesh}") == mesh
    assert packages.resolve(str(mesh)) == mesh


@pytest.mark.parametrize(
    "uri",
    [
        "../../../secret.txt",
        "package://arm/../../secret.txt",
        "package://arm/%2e%2e/%2e%2e/secret.txt",
        "package://../secret.txt",
        "package://./../../secret.txt",
        "file:///etc/passwd",
        "/etc/passwd",
        "package://etc/passwd",
        "http://example.com/a.stl",
        "data://text",
        "../meshes",
        "../meshes/none.stl",
        "a\0b",
        "file:///a%00b.stl",
        "package://arm/%00.stl",
        "package://arm//../../secret.txt",
    ],
)
def test_what_lies_outside_or_is_no_regular_file_is_refused(tree: Path, uri: str) -> None:
    with pytest.raises(NotFound):
        Packages(tree / "arm" / "urdf" / "arm.urdf").resolve(uri)


@pytest.mark.parametrize("folder", ["robot", "urdf", "description", "."])
@pytest.mark.parametrize("mode", [0o755, 0o1777])
def test_a_folder_of_everything_belongs_to_no_description(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str, mode: int
) -> None:
    """The home folder, or one like /tmp, is not read because a description lies below it; in it, what is not hidden."""
    everything = tmp_path / "all"
    (everything / ".config").mkdir(parents=True)
    (everything / folder).mkdir(exist_ok=True)
    for name in ("secret.yaml", ".config/token", "package.xml", f"{folder}/part.stl"):
        (everything / name).write_text("<package><name>all</name></package>")
    everything.chmod(mode)
    monkeypatch.setenv("HOME", str(everything if mode == 0o755 else tmp_path / "other"))
    packages = Packages(everything / folder / "r.urdf")
    outside = [str(everything / ".config/token"), "package://.config/token"]
    for uri in outside if folder == "." else [*outside, str(everything / "secret.yaml")]:
        with pytest.raises(NotFound):
            packages.resolve(uri)
    assert packages.resolve("part.stl") == everything / folder / "part.stl"


def test_a_package_is_known_by_its_package_xml_too(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tree / "arm" / "package.xml").write_text(
        '<?xml version="1.0"?>\n<package>\n <name> arm_description </name></package>'
    )
    mesh = tree / "arm" / "meshes" / "a.stl"
    assert Packages(tree / "arm" / "urdf" / "arm.urdf").resolve("package://arm_description//meshes/a.stl") == mesh
    other = tmp_path / "elsewhere" / "r.urdf"
    with pytest.raises(NotFound):
        Packages(other).root("arm_description")
    assert Packages(other, package_path=[tmp_path]).root("arm_description") == tree / "arm"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert Packages(other).root("arm_description") == tree / "arm"
    (tree / "COLCON_IGNORE").touch()
    with pytest.raises(NotFound):
        Packages(other).root("arm_description")


def test_a_link_that_leaves_the_tree_is_refused_unless_allowed(tree: Path) -> None:
    link = tree / "arm" / "meshes" / "link.stl"
    link.symlink_to(tree.parent / "secret.txt")
    description = tree / "arm" / "urdf" / "arm.urdf"
    with pytest.raises(NotFound, match="outside"):
        Packages(description).resolve("package://arm/meshes/link.stl")
    assert Packages(description, allow_outside=True).resolve("package://arm/meshes/link.stl").name == "secret.txt"


@pytest.mark.parametrize(("source", "allowed"), [("hand", True), ("foot", False), (None, False)])
def test_a_package_may_be_links_to_its_own_source(
    tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str | None, allowed: bool
) -> None:
    """As `colcon build --symlink-install` leaves it, file by file."""
    (tmp_path / "src" / "h" / "meshes").mkdir(parents=True)
    (tmp_path / "src" / "h" / "meshes" / "h.stl").touch()
    if source is not None:
        (tmp_path / "src" / "h" / "package.xml").write_text(f"<package><name>{source}</name></package>")
    share = tmp_path / "install" / "share" / "hand"
    (share / "meshes").mkdir(parents=True)
    (share / "meshes" / "h.stl").symlink_to(tmp_path / "src" / "h" / "meshes" / "h.stl")
    (share / "package.xml").write_text("<package><name>hand</name></package>")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    packages = Packages(tmp_path / "elsewhere" / "r.urdf")
    if allowed:
        assert packages.resolve("package://hand/meshes/h.stl") == tmp_path / "src" / "h" / "meshes" / "h.stl"
        assert packages.resolve(str(share / "meshes" / "h.stl")).name == "h.stl"  # as $(find hand)/meshes/h.stl
    else:
        with pytest.raises(NotFound, match="outside"):
            packages.resolve("package://hand/meshes/h.stl")


@pytest.mark.parametrize("target", ["gone.stl", "link.stl"])
def test_a_link_that_leads_to_no_file_is_called_one(tree: Path, target: str) -> None:
    (tree / "arm" / "meshes" / "link.stl").symlink_to(target)
    with pytest.raises(NotFound, match=r"'\.\./meshes/link.stl' is a broken symbolic link") as refused:
        Packages(tree / "arm" / "urdf" / "arm.urdf").resolve("../meshes/link.stl")
    assert refused.value.hint is None


@pytest.mark.parametrize("uri", ["package:///a.stl", "package://", "package://../a.stl", "package://%2e%2e/a.stl"])
def test_what_cannot_be_a_package_is_not_looked_for(tree: Path, uri: str) -> None:
    with pytest.raises(NotFound, match="is not a valid package name") as refused:
        Packages(tree / "arm" / "urdf" / "arm.urdf").resolve(uri)
    assert "package://NAME/path" in (refused.value.hint or "")


def test_a_pipe_is_refused_at_once(tree: Path) -> None:
    os.mkfifo(tree / "arm" / "meshes" / "pipe.stl")
    with pytest.raises(NotFound, match="regular file"):
        Packages(tree / "arm" / "urdf" / "arm.urdf").resolve("../meshes/pipe.stl")


def test_the_package_path_comes_first(tree: Path, tmp_path: Path) -> None:
    other = tmp_path / "elsewhere"
    (other / "hand").mkdir(parents=True)
    description = tree / "arm" / "urdf" / "arm.urdf"
    assert Packages(description, package_path=[other]).root("hand") == other / "hand"
    assert Packages(description, package_path=[other / "hand"]).root("hand") == other / "hand"


def test_ros_variables_are_searched(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ws" / "robot_one").mkdir(parents=True)
    (tmp_path / "install" / "share" / "robot_two").mkdir(parents=True)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere{os.pathsep}{tmp_path / 'ws'}")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")
    assert packages.root("robot_one") == tmp_path / "ws" / "robot_one"
    assert packages.root("robot_two") == tmp_path / "install" / "share" / "robot_two"


def test_an_installed_python_package_is_found_without_importing_it(tmp_path: Path) -> None:
    before = "pybullet_data" in sys.modules
    path = Packages(tmp_path / "robot.yaml").resolve("package://pybullet_data/franka_panda/panda.urdf")
    assert path.is_file()
    assert ("pybullet_data" in sys.modules) == before
    assert Packages(path).portable(path) == "package://pybullet_data/franka_panda/panda.urdf"


def test_the_package_that_was_meant_is_named(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")

    def hint(name: str) -> str | None:
        with pytest.raises(NotFound) as refused:
            packages.resolve(f"package://{name}/meshes/a.stl")
        return refused.value.hint

    assert hint("pybulet_data") == (
        "did you mean 'pybullet_data'? Otherwise add the folder that contains 'pybulet_data' with --package-path DIR, "
        "or to the robot file: packages: {pybulet_data: FOLDER}"
    )
    assert (hint("my_robot") or "").startswith("add the folder that contains 'my_robot' with --package-path DIR")
    (tree / "other").mkdir()
    (tree / "other" / "package.xml").write_text("<package><name>my_robots</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tree))
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")
    assert (hint("my_robot") or "").startswith("did you mean 'my_robots'?")


def test_an_unknown_package_tells_where_it_was_looked_for(tree: Path) -> None:
    with pytest.raises(NotFound) as caught:
        Packages(tree / "arm" / "urdf" / "arm.urdf").root("gripper")
    assert str(tree / "gripper") in caught.value.message
    assert "--package-path" in (caught.value.hint or "")


def test_a_portable_uri_resolves_to_the_same_file(tree: Path) -> None:
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")
    mesh = packages.resolve("../meshes/a.stl")
    assert packages.portable(mesh) == "package://arm/meshes/a.stl"
    assert packages.resolve(packages.portable(mesh)) == mesh


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("link6.STL", "link7.STL", False),
        ("laser_link.STL", "l_wheel_link.STL", False),
        ("estop_link.STL", "bellows_link.STL", False),
        ("link6.STL", "Link_6.stl", True),
        ("elbow_flex_link.STL", "elbow_flx_link.STL", True),
    ],
)
def test_the_mesh_of_another_part_was_not_meant(tmp_path: Path, name: str, known: str, meant: bool) -> None:
    (tmp_path / "r.urdf").touch()
    (tmp_path / known).touch()
    with pytest.raises(NotFound) as refused:
        Packages(tmp_path / "r.urdf").resolve(name)
    assert refused.value.hint == (f"did you mean '{known}'?" if meant else None)


@pytest.mark.parametrize(
    ("uri", "hint"), [("arn.urdf", "arm.urdf"), ("../meshes/texture.png", None), ("none/arm.urdf", None)]
)
def test_the_file_that_was_meant_is_named(tree: Path, uri: str, hint: str | None) -> None:
    with pytest.raises(NotFound) as refused:
        Packages(tree / "arm" / "urdf" / "arm.urdf").resolve(uri)
    assert refused.value.hint == (None if hint is None else f"did you mean '{hint}'?")


def test_what_lies_outside_is_not_named_either(tree: Path) -> None:
    description = tree / "arm" / "urdf" / "arm.urdf"
    for allowed, hint in ((False, None), (True, "did you mean 'secret.txt'?")):
        with pytest.raises(NotFound) as refused:
            Packages(description, allow_outside=allowed).resolve("../../../secrt.txt")
        assert refused.value.hint == hint


def test_a_system_that_knows_no_home_reads_descriptions_all_the_same(
    tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", nobody)
    packages = Packages(tree / "arm" / "urdf" / "arm.urdf")
    assert packages.resolve("package://arm/meshes/a.stl") == tree / "arm" / "meshes" / "a.stl"
