"""The scene as the robot believes it to be at the start: bodies with `known:` moved by an error drawn within it.

The deviates of a body follow from seed, sample and name as those of `vary:`, path `known/NAME`, so that other bodies
change nothing. An error with which the believed body overlaps another one is drawn once more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Transform
from manipcli.scene.containing import contains
from manipcli.scene.known import Known, displaced
from manipcli.scene.scene import Body, Scene
from manipcli.scene.start_overlap import overlaps
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec
from manipcli.task.task import GroundTruth, Task
from manipcli.task.vary import deviate

DRAWS: Final = 200
"""Errors drawn for one body before the task is refused."""
AS_WRITTEN: Final = -1
"""In place of the number of a sample, for a task as written."""


def believed_scene(file: Located[TaskSpec], scene: Scene, sample: int | None) -> Scene:
    """The believed scene of a task; the `scene` itself where everything is known exactly.

    Args:
        file: the task.
        scene: the true one.
        sample: number of the sample; None for the task as written.

    Raises:
        InvalidInput: no error of a body leaves it free of overlap.
    """
    uncertain = {name: Known.of(spec.known) for name, spec in file.spec.scene.items() if spec.known is not None}
    if not uncertain:
        return scene
    waiting = {name: contents(scene, name, uncertain) for name in uncertain}
    bodies = {body.name: body for body in scene.bodies}
    for name, known in uncertain.items():
        inside = waiting.pop(name)
        rest = [body for body in bodies.values() if not any(body.name in (one, *held) for one, held in waiting.items())]
        for draw in range(DRAWS):
            deviates = [
                deviate(file.spec.simulation.seed, AS_WRITTEN if sample is None else sample, f"known/{name}/{draw}", k)
                for k in range(4)
            ]
            moved = _moved(bodies, name, inside, known, deviates)
            group = set(moved)
            placed = [moved.get(body.name, body) for body in rest]
            if all((a in group) == (b in group) for a, b, _ in overlaps(placed, scene.joints)):
                break
        else:
            message = f"no error within the `known` of '{name}' leaves it free of overlap ({DRAWS} drawn)"
            hint = "make `known` smaller, or move the bodies near it apart"
            raise InvalidInput([Diagnostic("TASK229", message, file.place("scene", name, "known"), hint=hint)])
        bodies |= moved
    return replace(scene, bodies=tuple(bodies.values()))


def believing(task: Task) -> Task:
    """A task as written, planned with its believed scene.

    Raises:
        InvalidInput: as `believed_scene`.
    """
    scene = believed_scene(task.file, task.scene, None)
    if scene is task.scene:
        return task
    return replace(task, scene=scene, truth=GroundTruth(task.robot, task.scene, task.controllers_file, task.sensors))


def contents(scene: Scene, container: str, uncertain: Mapping[str, object]) -> tuple[str, ...]:
    """The bodies that are in an uncertain container at the start and have no `known` of their own.

    What is in several containers is in the innermost one that is uncertain.
    """
    around = scene.body(container)
    others = [scene.body(name) for name in uncertain if name != container]

    def nearer(body: Body) -> bool:
        return any(
            contains(other, other.X_WO, body, body.X_WO) and contains(around, around.X_WO, other, other.X_WO)
            for other in others
        )

    return tuple(
        body.name
        for body in scene.movable
        if body.name not in uncertain and contains(around, around.X_WO, body, body.X_WO) and not nearer(body)
    )


def _moved(
    bodies: Mapping[str, Body], name: str, inside: tuple[str, ...], known: Known, deviates: list[float]
) -> dict[str, Body]:
    """A body with an error, and what is inside it."""
    body = bodies[name]
    a, b, c, d = deviates
    X_WO = displaced(body.X_WO, *known.error((a, b, c, d)))
    shift: Transform = X_WO @ body.X_WO.inverse()
    return {
        name: replace(body, X_WO=X_WO, known=known),
        **{each: replace(bodies[each], X_WO=shift @ bodies[each].X_WO) for each in inside},
    }
