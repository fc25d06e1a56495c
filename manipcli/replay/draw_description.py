"""A picture of a description that `check-urdf` has found sound."""

from __future__ import annotations

from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.lint.inspection import Inspection
from manipcli.model.build_robot import bare_robot
from manipcli.replay.renderer import draw_robot


def draw_description(inspection: Inspection, path: Path) -> tuple[str, ...]:
    """Draw the robot of a description into `path`; one line for each part that could not be drawn.

    Raises:
        InvalidInput: the description has errors.
    """
    parts = inspection.examination.parts
    if parts is None or inspection.examination.errors:
        raise InvalidInput([Diagnostic("USE041", f"'{inspection.path}' has errors and is not drawn")])
    return draw_robot(bare_robot(parts), path)
