"""What is found while collision meshes are read."""

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import TETRAHEDRON, one_link
from manipcli.description.urdf.mesh_element import WITHOUT_IT
from manipcli.shapes.mesh_stl import binary_stl

READING_MESHES: tuple[Check, ...] = (
    reading_check(
        "URDF013",
        name="missing-mesh",
        tier="assets",
        summary="A collision mesh is not found",
        reason=(
            "A link without its collision shape passes through what it should hit. Many descriptions are published "
            f"without their meshes: {WITHOUT_IT}. A missing visual is a warning, URDF033."
        ),
        bad=one_link('filename="package://missing_package/a.stl"', role="collision"),
    ),
    reading_check(
        "URDF200",
        name="unusable-mesh",
        tier="assets",
        summary="A collision mesh is damaged, empty, too large, or of a format that is not read",
        reason=(
            "An engine answers with a crash (an index out of range), with a shape somewhere else (a negative one), "
            "or with none at all, so that an arm passes through what it should hit."
        ),
        bad=one_link('filename="cut.stl"', role="collision"),
        files=lambda: {"cut.stl": b"cut off".ljust(80) + (12).to_bytes(4, "little") + bytes(50 * 11)},
    ),
    reading_check(
        "URDF201",
        name="remote-mesh",
        tier="assets",
        summary="A mesh is named by http, ftp, data: or another address that is not read",
        reason="A description is data: nothing is fetched for it, and what it means may not change with a server.",
        bad=one_link('filename="https://example.org/a.stl"'),
    ),
    reading_check(
        "URDF202",
        name="outside-mesh",
        tier="assets",
        summary="A mesh lies outside of the description's folder and packages",
        reason=(
            "A description from somewhere else could name any file of this machine; links are followed before that is "
            "judged. `--allow-outside` permits it."
        ),
        bad=one_link('filename="/etc/passwd"'),
    ),
    reading_check(
        "URDF210",
        name="flat-mesh",
        tier="assets",
        summary="A collision mesh is flat",
        reason="A collision shape is the hull of its points; a hull without a volume catches nothing.",
        bad=one_link('filename="a.stl"', role="collision"),
        files=lambda: {"a.stl": binary_stl(TETRAHEDRON * (1.0, 1.0, 0.0))},
    ),
)
