"""From a description to a robot file, a controllers file and a first task whose run passes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from manipcli.description.srdf import read_srdf
from manipcli.onboard.controllers_file import ControllersGuess, WrittenControllers, given_controllers
from manipcli.onboard.first_task import FirstTask, TaskSearch
from manipcli.onboard.from_srdf import stated_parts
from manipcli.onboard.robot_draft import RobotDraft, draft_robot
from manipcli.onboard.source import HandSource, read_source
from manipcli.onboard.summary import summary
from manipcli.onboard.writer import Entry, block, checks, written
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.spec.load import load_task_text
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
        hand: a hand from another description, to attach.
    """

    description: str
    folder: Path
    arguments: Mapping[str, str]
    package_path: tuple[Path, ...] = ()
    allow_outside: bool = False
    srdf: Path | None = None
    controllers: Path | None = None
    hand: HandSource | None = None


@dataclass(frozen=True, slots=True)
class Onboarded:
    """The files by path in the folder, and what the user should know.

    Attributes:
        files: texts by relative path.
        task_file: relative path of the first task.
        passed: whether its run passed.
        summary: what was found, guessed and tried, as lines of text.
    """

    files: Mapping[str, str]
    task_file: str
    passed: bool
    summary: tuple[str, ...]


def onboard(request: Request, *, on_progress: Callable[[str], None] = lambda _: None) -> Onboarded:
    """The files for a description.

    Raises:
        InvalidInput: the description has errors that no guess mends.
    """
    on_progress("reading the description")
    source = read_source(
        request.description,
        request.arguments,
        request.folder,
        package_path=request.package_path,
        allow_outside=request.allow_outside,
        hand=request.hand,
    )
    on_progress("looking for the arm, the hand and a start")
    stated = None
    if request.srdf is not None:
        srdf = read_srdf(request.srdf, package_path=request.package_path, arguments=request.arguments)
        stated = stated_parts(source.robot, srdf)
    draft = draft_robot(source.robot, floor_scene(), stated)
    head = _head(request)
    given = None
    if request.controllers is not None:
        given = given_controllers(request.controllers, source.robot, request.arguments)

    with TemporaryDirectory(prefix="manipcli-") as scratch:
        folder = Path(scratch)

        def write_robot(poses: Mapping[str, Entry]) -> None:
            entries = {**source.anywhere, **_with_poses(draft, poses)}
            (folder / "robot.yaml").write_text(written(entries, head=head), encoding="utf-8")

        write_robot({})
        parts = draft.parts
        variants: Iterable[Callable[[str], WrittenControllers]]
        if given is not None:
            variants = [lambda _: given]
        else:
            on_progress("tuning gains")
            variants = ControllersGuess(
                folder / "robot.yaml",
                parts.arm.joints if parts.arm else (),
                parts.hand.joints if parts.hand else (),
                package_path=request.package_path,
                allow_outside=request.allow_outside,
            ).variants()
        why: str | None = ""
        found: list[tuple[WrittenControllers, FirstTask]] = []
        with TaskSearch(
            folder,
            draft,
            write_robot=write_robot,
            package_path=request.package_path,
            allow_outside=request.allow_outside,
            on_progress=on_progress,
        ) as search:
            for variant in variants:
                controllers = variant(why or "")
                (folder / "controllers.yaml").write_text(controllers.text, encoding="utf-8")
                why = search.unsteady()
                if why is None:
                    found.append((controllers, search.search()))
                    why = found[-1][1].dropped
                    if not why:  # other controllers would not hold the block better
                        break
            controllers, task = (
                min(found, key=lambda pair: bool(pair[1].dropped)) if found else (controllers, search.search())
            )
    task_file = f"tasks/{task.name}.yaml"
    entries = {**source.entries, **_with_poses(draft, task.poses)}
    files = {
        "robot.yaml": written(entries, head=head),
        "controllers.yaml": controllers.text,
        task_file: written(task.entries, head=[f"{SCHEMA}../schemas/task.json"]),
    }
    doubts = (*checks(entries), *checks(controllers.entries))
    remarks = (*source.notes, *draft.notes, *controllers.notes)
    return Onboarded(
        files,
        task_file,
        task.passed,
        tuple(summary(found=tuple(_found(draft)), checks=doubts, notes=remarks, task=task)),
    )


def floor_scene() -> Scene:
    """A scene with the floor alone."""
    text = "task: floor\nrobot: robot.yaml\ncontrollers: controllers.yaml\nsteps: [{wait: 1 s}]\n"
    return build_scene(load_task_text(text, "floor", model=task_spec()).spec)


def _head(request: Request) -> list[str]:
    hand = f" --hand {Path(request.hand.description).name}" if request.hand is not None else ""
    return [
        f"{SCHEMA}schemas/robot.json",
        f"Written by `manipcli init --robot {Path(request.description).name}{hand}`.",
        "Each guess has its evidence above it; please look at those marked CHECK.",
    ]


def _with_poses(draft: RobotDraft, poses: Mapping[str, Entry]) -> dict[str, Entry]:
    """The entries of the draft, with further poses."""
    entries = dict(draft.entries)
    if poses:
        entries["poses"] = Entry({**block(entries["poses"]), **poses})
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
    home = block(draft.entries["poses"]).get("home") if "poses" in draft.entries else None
    if home is not None and home.why:
        found.append(f"home: {home.why}")
    return found
