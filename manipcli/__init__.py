"""manipcli: robot manipulation tasks, run from YAML files.

    from pathlib import Path
    import manipcli

    report = manipcli.run_task(Path("tasks/pour.yaml"))
    recording = manipcli.read_recording(Path(report.log))

The public names are those of `__all__`. Each is imported on first use (PEP 562), so that `import manipcli` is fast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from manipcli.core.lazy import lazy_exports
from manipcli.core.version import __version__ as __version__

if TYPE_CHECKING:
    from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError, NotPlannable, SimulationFailed
    from manipcli.judge.verdict import Verdict
    from manipcli.model.state import WorldState
    from manipcli.pipeline import Plan, Task, check_files, judge_log, load_task, plan_task, run_task
    from manipcli.record.read.reading import open_recording, read_recording
    from manipcli.record.recording import Recording
    from manipcli.report.run_report import RunReport

__all__ = [
    "Diagnostic",
    "InvalidInput",
    "ManipcliError",
    "NotPlannable",
    "Plan",
    "Recording",
    "RunReport",
    "SimulationFailed",
    "Task",
    "Verdict",
    "WorldState",
    "check_files",
    "judge_log",
    "load_task",
    "open_recording",
    "plan_task",
    "read_recording",
    "run_task",
]

_HOMES = {
    "Diagnostic": "core.errors",
    "InvalidInput": "core.errors",
    "ManipcliError": "core.errors",
    "NotPlannable": "core.errors",
    "SimulationFailed": "core.errors",
    "Verdict": "judge.verdict",
    "WorldState": "model.state",
    "Plan": "pipeline",
    "Task": "pipeline",
    "check_files": "pipeline",
    "judge_log": "pipeline",
    "load_task": "pipeline",
    "plan_task": "pipeline",
    "run_task": "pipeline",
    "open_recording": "record.read.reading",
    "read_recording": "record.read.reading",
    "Recording": "record.recording",
    "RunReport": "report.run_report",
}
"""The module that provides each public name."""


__getattr__ = lazy_exports(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
