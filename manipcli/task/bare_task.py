"""A task without a purpose: a robot alone on the floor, in its `home` pose, or in another one under `start`."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from manipcli.spec.load import load_robot, read_bytes
from manipcli.task.vocabulary import robot_spec


@contextmanager
def bare_task(robot: Path, controllers: Path) -> Iterator[Path]:
    """The path of a task file, while the context is open. Its only step waits: a task has at least one.

    Args:
        robot: a robot file.
        controllers: its controllers file.

    Raises:
        InvalidInput: a file is missing; the robot file is of another kind or faulty.
    """
    read_bytes(controllers)
    name = re.sub(r"[^A-Za-z0-9_]+", "_", load_robot(robot, model=robot_spec()).spec.robot).strip("_")[:80] or "robot"
    entries = {"task": name, "robot": str(robot.resolve()), "controllers": str(controllers.resolve())}
    lines = [f"{key}: {json.dumps(value)}" for key, value in entries.items()]
    with TemporaryDirectory(prefix="manipcli-") as folder:
        path = Path(folder) / f"{name}.yaml"
        path.write_text("\n".join([*lines, "steps: [wait: 1 s]", ""]), encoding="utf-8")
        yield path
