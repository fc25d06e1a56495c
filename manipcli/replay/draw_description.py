"""Picture of a description without errors, for `check-urdf`."""

from __future__ import annotations

from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.lint.inspection import Inspection
from manipcli.model.build_robot import bare_robot
from manipcli.replay.renderer import draw_robot


def draw_description(inspection: Inspection, path: Path) -> tuple[str, ...]:
    """Draw the robot of a description into `path`; returns one line for each part that cannot be drawn.

    Raises:
        InvalidInput: the description has errors.
    """
    parts = inspection.examination.parts
    if parts is None or inspection.examination.errors:
        raise InvalidInput([Diagnostic("USE041", f"'{inspection.path}' has errors and cannot be drawn")])
    return draw_robot(bare_robot(parts), path)
