"""What the files mean: robots, scenes, conditions.

The transmissions are public here, each imported when it is first used (PEP 562).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from manipcli.core.lazy import lazy_exports

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


__getattr__ = lazy_exports(__name__, _HOMES)
