"""YAML data that a xacro file loads: read by a loader class of its own, with the unit tags that ROS users know."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from manipcli.model.bounds import bounds
from manipcli.model.expression import Beyond, Refused

UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180.0,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}


def load_yaml(path: Path, evaluate: Callable[[str], object]) -> object:
    """The data of a YAML file.

    Args:
        path: a regular file.
        evaluate: computes the text under a unit tag (`!degrees 2 * 45`).

    Raises:
        Refused: too large, unknown tags, not YAML, or a value under a unit tag that is no number.
    """
    import yaml

    class Loader(yaml.SafeLoader):
        """Private, so that the constructors added here do not reach anyone else's safe_load."""

    def construct(factor: float) -> Callable[[Loader, yaml.ScalarNode], float]:
        def constructor(loader: Loader, node: yaml.ScalarNode) -> float:
            value = evaluate(str(loader.construct_scalar(node)))
            if not isinstance(value, int | float):
                raise Refused(f"{path.name}: a number is expected, not '{value}'")
            return float(value) * factor

        return constructor

    for tag, factor in UNITS.items():
        Loader.add_constructor(tag, construct(factor))
    most = bounds().yaml_bytes
    with path.open("rb") as stream:
        data = stream.read(most + 1)
    if len(data) > most:
        raise Beyond(f"{path.name} is larger than {most} bytes", "yaml_bytes")
    try:
        return yaml.load(data, Loader=Loader)
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise Refused(f"{path.name}: {error}") from error
