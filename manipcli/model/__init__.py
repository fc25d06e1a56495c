"""What the files mean: robots, scenes, conditions.

The transmissions are public here, each imported when it is first used (PEP 562).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from manipcli.model.transmission import Transmission
    from manipcli.model.transmissions.differential import DifferentialTransmission
    from manipcli.model.transmissions.four_bar import FourBarLinkageTransmission
    from manipcli.model.transmissions.simple import SimpleTransmission

__all__ = ["DifferentialTransmission", "FourBarLinkageTransmission", "SimpleTransmission", "Transmission"]

_HOMES = {
    "Transmission": "transmission",
    "SimpleTransmission": "transmissions.simple",
    "DifferentialTransmission": "transmissions.differential",
    "FourBarLinkageTransmission": "transmissions.four_bar",
}


def __getattr__(name: str) -> object:
    """A public name, from its module; from then on an ordinary attribute."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    found: object = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = found
    return found
