"""Visual meshes and textures that are not found."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject, found_while_reading
from manipcli.model.packages import NotFound
from manipcli.model.samples import one_link
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    yield from found_while_reading("URDF033")(subject)
    for element, _ in known_elements(subject.description.root):
        uri = element.attributes.get("filename", "").strip()
        if element.tag == "texture" and uri:
            try:
                subject.packages.resolve(uri)
            except NotFound as error:
                yield Finding("URDF033", f"texture: {error.message}", element.place, error.hint, "warning")


CHECK = Check(
    code="URDF033",
    name="missing-visual",
    tier="assets",
    severity="warning",
    summary="A visual mesh or a texture is not found",
    reason="The link is not drawn; PyBullet refuses the whole robot for it, so engines are given none.",
    bad=one_link('filename="package://missing_package/a.stl"'),
    find=_find,
)
