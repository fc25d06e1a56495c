"""From a description to a robot file, a controllers file and a first task whose run passes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from manipcli.model.build_robot import build_robot
from manipcli.onboard.controllers_file import guess_controllers
from manipcli.onboard.first_task import TaskSearch
from manipcli.onboard.robot_draft import RobotDraft, draft_robot
from manipcli.onboard.summary import summary
from manipcli.onboard.writer import Entry, checks, written
from manipcli.report.text import describe
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.spec.load import load_task_text, read_bytes
from manipcli.spec.robot import RobotSpec
from manipcli.task.vocabulary import task_spec

SCHEMA = "yaml-language-server: $schema="


@dataclass(frozen=True, slots=True)
class Request:
    """What the user gave.

    Attributes:
        description: URDF or xacro: a path, or `package://NAME/...`.
        arguments: of the xacro file.
        folder: of the project; relative paths in its files start there.
        package_path, allow_outside: see `build_robot`.
        srdf: a MoveIt SRDF, for groups, poses, end effectors and pairs of links that touch.
        controllers: a controllers file to use instead of a guess.
    """

    description: str
    folder: Path
    arguments: Mapping[str, str]
    package_path: tuple[Path, ...] = ()
    allow_outside: bool = False
    srdf: Path | None = None
    controllers: Path | None = None


@dataclass(frozen=True, slots=True)
class Onboarded:
    """The files by path in the folder, and what the user should know.

    Attributes:
        files: texts by relative path.
        task_file: relative path of the first task.
        passed: whether its run passed.
        summary: what was found, guessed and tried, as lines of text.
        package_path: folders that every command needs; () if the robot file names the packages.
    """

    files: Mapping[str, str]
    task_file: str
    passed: bool
    summary: tuple[str, ...]
    package_path: tuple[Path, ...] = ()


def onboard(request: Request, *, on_progress: Callable[[str], None] = lambda _: None) -> Onboarded:
    """The files for a description.

    Raises:
        InvalidInput: the description has errors that no guess mends.
    """
    name = Path(request.description).name.partition(".")[0]
    given, final = _description(request)
    on_progress("reading the description")
    spec = RobotSpec(robot=name, description=given, args=dict(request.arguments))
    bare, findings = build_robot(
        spec, file=request.folder / "robot.yaml", package_path=request.package_path, allow_outside=request.allow_outside
    )
    on_progress("looking for the arm, the hand and a start")
    draft = draft_robot(bare, floor_scene())

    def robot_text(description: str, poses: Mapping[str, Entry]) -> str:
        return written(_robot_entries(name, description, request, draft, poses), head=_head(request))

    with TemporaryDirectory(prefix="manipcli-") as scratch:
        folder = Path(scratch)

        def write_robot(poses: Mapping[str, Entry]) -> None:
            (folder / "robot.yaml").write_text(robot_text(given, poses))

        write_robot({})
        on_progress("tuning gains")
        parts = draft.parts
        controllers = guess_controllers(
            folder / "robot.yaml",
            folder,
            parts.arm.joints if parts.arm else (),
            parts.hand.joints if parts.hand else (),
            package_path=request.package_path,
            allow_outside=request.allow_outside,
        )
        (folder / "controllers.yaml").write_text(controllers.text)
        search = TaskSearch(
            folder,
            draft,
            write_robot=write_robot,
            package_path=request.package_path,
            allow_outside=request.allow_outside,
            on_progress=on_progress,
        )
        task = search.search()
    task_file = f"tasks/{task.name}.yaml"
    files = {
        "robot.yaml": robot_text(final, task.poses),
        "controllers.yaml": controllers.text,
        task_file: written(task.entries, head=[f"{SCHEMA}../schemas/task.json"]),
    }
    entries = _robot_entries(name, final, request, draft, task.poses)
    doubts = (*checks(entries), *checks(controllers.entries))
    remarks = (*draft.notes, *controllers.notes, *(describe(f) for f in findings if f.severity != "note"))
    return Onboarded(
        files,
        task_file,
        task.passed,
        tuple(summary(found=tuple(_found(draft)), checks=doubts, notes=remarks, task=task)),
        request.package_path,
    )


def floor_scene() -> Scene:
    """A scene with the floor alone."""
    text = "task: floor\nrobot: robot.yaml\ncontrollers: controllers.yaml\nsteps: [{wait: 1 s}]\n"
    return build_scene(load_task_text(text, "floor", model=task_spec()).spec)


def _description(request: Request) -> tuple[str, str]:
    """The description for files anywhere, and as the robot file in the folder names it."""
    if "://" in request.description:
        return request.description, request.description
    path = Path(request.description)
    read_bytes(path)  # the usual error for a missing file
    whole = os.path.realpath(path)
    return whole, os.path.relpath(whole, os.path.realpath(request.folder))


def _head(request: Request) -> list[str]:
    return [
        f"{SCHEMA}schemas/robot.json",
        f"Written by `manipcli init --robot {Path(request.description).name}`. Each guess has its evidence above it; "
        "please look at",
        "those marked CHECK.",
    ]


def _robot_entries(
    name: str, description: str, request: Request, draft: RobotDraft, poses: Mapping[str, Entry]
) -> dict[str, Entry]:
    entries: dict[str, Entry] = {"robot": Entry(name), "description": Entry(description)}
    if request.arguments:
        entries["args"] = Entry(dict(request.arguments))
    entries |= draft.entries
    if poses:
        own = entries["poses"].value
        assert isinstance(own, dict)
        entries["poses"] = Entry({**own, **poses})
    return entries


def _found(draft: RobotDraft) -> list[str]:
    parts, found = draft.parts, []
    if parts.arm is not None:
        found.append(f"arm: {parts.arm_evidence}")
    if parts.hand is not None:
        found.append(f"hand: {parts.hand_evidence}")
    if draft.closure is not None:
        found.append(f"open and closed: {draft.closure.evidence}")
    if draft.frame is not None:
        found.append(f"tool: in '{draft.frame.link}', {draft.frame.evidence}")
    for pose in ("home",):
        poses = draft.entries.get("poses")
        if poses is not None and isinstance(poses.value, dict) and pose in poses.value:
            entry = poses.value[pose]
            if isinstance(entry, Entry) and entry.why:
                found.append(f"{pose}: {entry.why}")
    return found
