"""What is found while collision meshes are read."""

from functools import partial

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import TETRAHEDRON, one_link
from manipcli.description.urdf.link import WITHOUT_IT
from manipcli.shapes.mesh_formats import binary_stl

assets_check = partial(reading_check, "assets")

READING_MESHES: tuple[Check, ...] = (
    assets_check(
        "URDF013",
        "missing-mesh",
        "A collision mesh is not found",
        "A link without its collision shape passes through what it should hit. Many descriptions are published "
        f"without their meshes: {WITHOUT_IT}. A missing visual is a warning, URDF033.",
        one_link('filename="package://missing_package/a.stl"', role="collision"),
    ),
    assets_check(
        "URDF200",
        "unusable-mesh",
        "A collision mesh is damaged, empty, too large, or of a format that is not read",
        "An engine answers with a crash (an index out of range), with a shape somewhere else (a negative one), or "
        "with none at all, so that an arm passes through what it should hit.",
        one_link('filename="cut.stl"', role="collision"),
        files=lambda: {"cut.stl": b"cut off".ljust(80) + (12).to_bytes(4, "little") + bytes(50 * 11)},
    ),
    assets_check(
        "URDF201",
        "remote-mesh",
        "A mesh is named by http, ftp, data: or another address that is not read",
        "A description is data: nothing is fetched for it, and what it means may not change with a server.",
        one_link('filename="https://example.org/a.stl"'),
    ),
    assets_check(
        "URDF202",
        "outside-mesh",
        "A mesh lies outside of the description's folder and packages",
        "A description from somewhere else could name any file of this machine; links are followed before that is "
        "judged. `--allow-outside` permits it.",
        one_link('filename="/etc/passwd"'),
    ),
    assets_check(
        "URDF210",
        "flat-mesh",
        "A collision mesh is flat",
        "A collision shape is the hull of its points; a hull without a volume catches nothing.",
        one_link('filename="a.stl"', role="collision"),
        files=lambda: {"a.stl": binary_stl(TETRAHEDRON * (1.0, 1.0, 0.0))},
    ),
)
