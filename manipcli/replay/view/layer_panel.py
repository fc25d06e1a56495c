"""Checkboxes for the layers of a scene in the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING

from manipcli.replay.view.viser_scene import Shown, ViserScene

if TYPE_CHECKING:
    import viser


def add_layers(gui: viser.GuiApi, scene: ViserScene) -> None:
    """Add a checkbox for each layer, and a search and a size for frames."""

    def add(label: str, layer: Shown, hint: str | None = None) -> None:
        box = gui.add_checkbox(label, layer == "visual", hint=hint)
        box.on_update(lambda _: scene.show(layer, box.value))

    add("visual meshes", "visual")
    clear = gui.add_checkbox("transparent", False, hint="Show frames and centres of mass inside the links.")
    clear.on_update(lambda _: scene.see_through(clear.value))
    edges = gui.add_checkbox("wireframe", False, hint="Edges of the triangles of meshes and shapes.")
    edges.on_update(lambda _: scene.wireframe(edges.value))
    add("collision shapes", "collision", "Convex hulls of the meshes, as in planner and physics.")
    add("inertia boxes", "inertia", "Uniform box with the mass and inertia of each link.")
    add("frames", "frames", "x red, y green, z blue.")
    add("names", "names")
    size = gui.add_slider("size of frames", 0.25, 4.0, 0.25, 1.0)
    size.on_update(lambda _: scene.resize(size.value))
    find = gui.add_text("find frames", "", hint="Show only frames and names with this text in their name.")
    find.on_update(lambda _: scene.find(find.value))
