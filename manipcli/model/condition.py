"""The contract of conditions: pure functions of scene and state with a signed margin in a stated unit.

One family, used live (`until`) and judged (`expect`): both call the same `margin`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from manipcli.core.geometry import Array
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.spec.base import Model

S = TypeVar("S", bound=Model)


@dataclass(frozen=True, slots=True)
class Condition(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word in YAML.
        spec: what the user writes under that word.
        unit: of the margin, SI: "m", "rad", ...
        margin: (spec, scene, start, state) -> (...) signed: positive where the condition holds. `start` is the state
            at time 0 (no leading axes), for words such as `to: start`.
    """

    name: str
    spec: type[S]
    unit: str
    margin: Callable[[S, Scene, WorldState, WorldState], Array]
