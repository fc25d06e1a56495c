"""Checks of the springs in joints of the scene: the physics, which steps them explicitly, must be able to follow."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.units import readable
from manipcli.scene.joint_inertia import moved_inertia
from manipcli.scene.scene import SEPARATOR, Scene
from manipcli.simulate.engines import ENGINES
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec

TOO_STIFF: Final = 366
"""Number of the code of the finding."""
FASTEST: Final = 1.0
"""Largest (w dt)^2 of an oscillation: its period is then 5 % short; above 4 it grows."""


def spring_findings(task: Located[TaskSpec], scene: Scene) -> Iterator[Diagnostic]:
    """Errors for springs with k dt^2 / I above `FASTEST`, with the inertia I that their joint moves."""
    simulation = task.spec.simulation
    if ENGINES[simulation.engine].physics != "full":
        return
    for joint in scene.joints:
        most = FASTEST * moved_inertia(scene, joint) / simulation.step**2 if joint.stiffness > 0.0 else 0.0
        if joint.stiffness <= most:
            continue
        unit = f"{joint.effort_unit}/{joint.unit}"
        body, _, name = joint.name.partition(SEPARATOR)
        message = f"the spring of joint '{joint.name}' has {joint.stiffness:.3g} {unit}, which needs a smaller step; "
        message += f"with {readable(simulation.step, 's')} at most {most:.3g} {unit}"
        hint = "lower `stiffness` or `simulation.step`, or move more mass with the joint"
        yield task.source.finding(TOO_STIFF, ("scene", body, "joints", name, "spring"), message, hint=hint)
