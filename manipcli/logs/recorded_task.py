"""The task of a log, ready to re-run, from its attachments and the files of its meshes."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput, Loc, Place
from manipcli.core.geometry import frozen
from manipcli.core.version import __version__
from manipcli.judge.drawn import SAMPLE, Drawn
from manipcli.logs.mesh_search import MeshSearch
from manipcli.logs.part_of import recorded_part
from manipcli.logs.recorded_files import (
    attached,
    recorded_controllers_file,
    recorded_packages,
    recorded_robot,
    recorded_robot_file,
    recorded_scene,
    recorded_task_file,
    robot_of,
)
from manipcli.plan.outline import PLAN_FILE, PlanOutline
from manipcli.record.recording import EMBEDDED, Recording
from manipcli.run.run_log import mesh_files
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.simulate.engines import ENGINES
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec
from manipcli.task.believed_scene import believing
from manipcli.task.consistency import disagreements
from manipcli.task.sample import sampled
from manipcli.task.sensor_checks import sensed
from manipcli.task.task import Task
from manipcli.task.vary import bind


@dataclass(frozen=True, slots=True)
class RecordedTask:
    """The task of a log.

    Attributes:
        task: task of the run.
        embedded: whether the log embeds its meshes.
        unlike: versions and meshes that differ from the run, one finding each.
        keep: owner of the temporary folder of the embedded files.
    """

    task: Task
    embedded: bool
    unlike: tuple[Diagnostic, ...]
    keep: MeshSearch


def recorded_task(
    recording: Recording, path: Path, *, package_path: Sequence[Path], allow_outside: bool
) -> RecordedTask:
    """The task of a log.

    Args:
        recording: the log.
        path: path of the log.
        package_path, allow_outside: where meshes are searched that the log does not embed, see `MeshSearch`.

    Raises:
        InvalidInput: an attachment is missing or invalid, or a mesh is not found.
    """
    task = recorded_task_file(recording, path)
    robot_file = recorded_robot_file(recording, path)
    controllers = recorded_controllers_file(recording, path)
    meshes = MeshSearch(
        path,
        hashes=recording.metadata.get("meshes", {}),
        embedded=recording.embedded_meshes(),
        package_path=package_path,
        allow_outside=allow_outside,
        robot=recorded_packages(recording, path),
    )
    robot = meshes.robot(recorded_robot(recording, path))
    # Scene bodies can come from files that the log does not hold; then the recorded scene is used.
    from_files = any(body.mesh is not None or body.urdf is not None for body in task.spec.scene.values())
    found_scene = meshes.scene(recorded_scene(recording, path)) if from_files else None

    def scene_of(file: Located[TaskSpec]) -> Scene:
        if found_scene is None:
            return build_scene(file.spec)
        return replace(
            found_scene, gravity=frozen(file.spec.simulation.gravity)
        )  # the recorded gravity is the sampled one

    scene = scene_of(task)
    found = disagreements(task, controllers, robot, scene, sensed(task, robot_file, robot, scene))
    if any(finding.severity == "error" for finding in found):
        raise InvalidInput(found)
    made = Task(
        file=task,
        robot_file=robot_file,
        controllers_file=controllers,
        robot=robot,
        scene=scene,
        findings=(*task.findings, *robot_file.findings, *controllers.findings, *found),
        places=_places(recording, path, task.spec),
        part=recorded_part(recording, path, task.spec, robot, scene),
    )
    drawn = _drawn(recording, path)
    if drawn is not None:
        made = sampled(
            made,
            bind(task, robot_file, controllers)[0],
            drawn,
            robot_of=lambda file: meshes.robot(robot_of(recording, path, file.spec)),
            scene_of=scene_of,
        )
    else:
        made = believing(made)
    files = mesh_files(made)
    _check_there(files, path, meshes)
    unlike = (*_versions(recording, path, made), *_meshes(recording, path, files))
    return RecordedTask(made, EMBEDDED in recording.metadata, unlike, meshes)


def _drawn(recording: Recording, path: Path) -> Drawn | None:
    """The sampled values of the run; None for a task as written."""
    if SAMPLE not in recording.metadata:
        return None
    try:
        return Drawn.from_metadata(recording.metadata[SAMPLE])
    except ValueError:
        message = f"{path.name}: invalid values of its sample"
        raise InvalidInput([Diagnostic("LOG103", message)]) from None


def _places(recording: Recording, path: Path, spec: TaskSpec) -> dict[Loc, str]:
    """Where steps, blocks and expectations are written, from the plan in the log; {} without a plan."""
    plan = PlanOutline.read(attached(recording, path, PLAN_FILE))
    places = [*(step.place for step in plan.steps), *(block.place for block in plan.blocks), *plan.judged]
    keys: list[Loc] = [("steps", k) for k in range(len(spec.steps))]
    keys += [*(("blocks", k) for k in range(len(spec.blocks))), *spec.judged_at]
    return dict(zip(keys, places, strict=True)) if len(places) == len(keys) and all(places) else {}


def _check_there(files: Mapping[str, Path], path: Path, meshes: MeshSearch) -> None:
    absent = [uri for uri, file in files.items() if not file.is_file()]
    if absent:
        more = f" (and {len(absent) - 1} more)" if len(absent) > 1 else ""
        message = f"mesh '{absent[0]}' not found{more}: the log cannot be re-simulated"
        hint = "; ".join(meshes.notes) or "set the location of its package with --package-path DIR"
        raise InvalidInput([Diagnostic("LOG400", message, Place(str(path), 0, 0), hint=hint)])


def _versions(recording: Recording, path: Path, task: Task) -> Iterator[Diagnostic]:
    engine = ENGINES[task.spec.simulation.engine]
    now = {"manipcli": __version__, engine.name: engine.version()}
    then = recording.metadata.get("versions", {})
    for name in dict.fromkeys((*then, *now)):
        if then.get(name) != now.get(name):
            message = f"{name} differs: {then.get(name, '(unknown)')} in the run, {now.get(name, 'not used')} now"
            yield Diagnostic("LOG401", message, Place(str(path), 0, 0), severity="warning")


def _meshes(recording: Recording, path: Path, files: Mapping[str, Path]) -> Iterator[Diagnostic]:
    then = recording.metadata.get("meshes", {})
    for uri, file in files.items():
        if hashlib.sha256(file.read_bytes()).hexdigest() != then.get(uri):
            message = f"mesh '{uri}' differs from the file of the run"
            yield Diagnostic("LOG402", message, Place(str(path), 0, 0), severity="warning")
