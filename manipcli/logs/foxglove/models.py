"""The shapes of robot and scene as one message that Foxglove draws, with the meshes inside."""

from __future__ import annotations

from collections import defaultdict
from typing import Final

from manipcli.record import schemas
from manipcli.record.encode import encode
from manipcli.record.foreign.join import Added
from manipcli.render.drawing import WORLD, Drawable, Drawing, floors_of
from manipcli.replay.gltf.container import MEDIA_TYPE
from manipcli.replay.gltf.model import model_glb
from manipcli.scene.scene import Scene

TOPIC: Final = "/scene"
_UNIT = {"x": 1.0, "y": 1.0, "z": 1.0}


def models(drawing: Drawing, scene: Scene | None, *, ns: int) -> Added:
    """A message with one entity for each frame that has a shape, at `ns` [ns]; the floor is left out.

    An entity has the name of its frame in `/tf`, and follows it. Bodies that are fixed have no frame of their own:
    theirs is the world.
    """
    floors = floors_of(scene)
    fixed = {body.name: body.X_WO for body in scene.bodies if body.fixed} if scene is not None else {}
    shapes: dict[str, list[Drawable]] = defaultdict(list)
    for drawable in drawing.layer("visual"):
        if drawable.frame not in floors and len(drawable.surface.faces):
            shapes[drawable.frame].append(drawable)
    entities = []
    for frame, drawables in shapes.items():
        name = frame.removeprefix("robot/")
        pose = {}
        if frame in fixed:
            X = fixed[frame]
            pose = {
                "position": dict(zip("xyz", X.p.tolist(), strict=True)),
                "orientation": dict(zip("xyzw", X.quat_xyzw.tolist(), strict=True)),
            }
        model = {"pose": pose, "scale": _UNIT, "media_type": MEDIA_TYPE, "data": model_glb(name, drawables)}
        entities.append(
            {
                "timestamp": {"sec": ns // 10**9, "nanosec": ns % 10**9},
                "frame_id": WORLD if frame in fixed else name,
                "id": name,
                "frame_locked": True,
                "models": [model],
            }
        )
    return Added(TOPIC, schemas.SCENE_UPDATE, ns, encode(schemas.SCENE_UPDATE, {"entities": entities}).data)
