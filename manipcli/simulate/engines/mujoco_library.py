"""Import of MuJoCo, silenced: it writes warnings to stdout and to MUJOCO_LOG.TXT in the current folder."""

from __future__ import annotations

from types import ModuleType
from typing import Final

INSTALL: Final = "install it: pip install 'manipcli[mujoco]'"
MAJOR: Final = "4"
"""Version of mujoco-core that the engine is written for."""


def installed() -> bool:
    """Whether a suitable MuJoCo is installed; it is not imported."""
    return version().partition(".")[0] == MAJOR


def library() -> ModuleType:
    """MuJoCo without console output and log file; the engine reads its warnings from the counters of each world."""
    import mujoco

    config = mujoco.MjLogConfig.get()
    if config.logto_console or config.logto_file:
        config.logto_console = config.logto_file = False
        mujoco.MjLogConfig.set(config)
    loaded: ModuleType = mujoco
    return loaded


def version() -> str:
    """Of the installed distribution (`mujoco` contains mujoco-core); "unknown" if it is missing."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed_version

    try:
        return installed_version("mujoco-core")
    except PackageNotFoundError:
        return "unknown"
