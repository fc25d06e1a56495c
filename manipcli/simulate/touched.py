"""Contacts of the link or body that carries a sensor."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.conditions.condition import Problem
from manipcli.model.grasp import LINK
from manipcli.model.state import Contact
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import Engine
from manipcli.spec.mounted_sensor import MountedSpec


def touched_by(engine: Engine, part: str) -> Iterator[tuple[Contact, float]]:
    """Contacts of a part now, and 1.0 where normals point towards it, else -1.0; without those within the robot."""
    for contact in engine.contacts(peek=True):
        if part not in (contact.a, contact.b) or (contact.a.startswith(LINK) and contact.b.startswith(LINK)):
            continue
        yield contact, 1.0 if contact.a == part else -1.0


def needs_a_part(spec: MountedSpec, scene: Scene) -> Iterator[Problem]:
    """A problem of a sensor of contacts in the world: nothing touches it there."""
    if spec.link is not None:
        return
    frame = scene.frame(spec.frame or "")
    name = (spec.frame or "world") if frame is None else frame.parent
    if name in ("world", "base"):
        yield Problem(
            ("frame",) if spec.frame else (),
            f"a sensor of type '{spec.type}' feels the link or body that carries it; '{name}' is neither",
            "write `link: LINK` or `frame: BODY`",
            "SENS104",
        )
